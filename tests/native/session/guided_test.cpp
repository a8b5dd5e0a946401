// Guided renders: the same mean whatever the guide believes, the same bits for any thread count.
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "integrator/integrator.h"
#include "session/guide_controller.h"
#include "support/render.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

// Teaches a field that all light comes from one wrong direction, sharply, everywhere.
GuidingField poisoned_field(const Bounds3& box, const Vec3& direction, ThreadPool& pool) {
    GuidingField field(GuidingConfig::neural(), box);
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    for (int pass = 0; pass < 20; ++pass) {
        std::vector<RadianceRecord> records(4096);
        for (std::size_t i = 0; i < records.size(); ++i) {
            RadianceRecord& r = records[i];
            r.position = box.lower + box.extent() * Vec3(unit(random), unit(random), unit(random));
            r.normal = glm::normalize(Vec3(unit(random), unit(random), unit(random)) - 0.5f);
            r.wi = glm::normalize(direction + 0.02f * Vec3(unit(random), unit(random), 0.0f));
            r.radiance_cos = 10.0f;
            r.pdf = 0.1f;
            r.key = i;
        }
        field.train(records, pool);
    }
    return field;
}

double mean_red(const Film& film) {
    std::vector<float> pixels(std::size_t{4} * film.width() * film.height());
    film.read(FilmPass::Combined, pixels);
    double sum = 0.0;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        sum += static_cast<double>(pixels[i]);
    }
    return 4.0 * sum / static_cast<double>(pixels.size());
}

TEST(GuidedStatistics, PoisonedGuideKeepsTheClosedForm) {
    ThreadPool pool(2);
    for (const bool nee : {true, false}) {
        SceneDescription description = emitting_box(32, 24);
        description.settings.use_nee = nee;
        const FilmDescription frame = description.film;
        const double exact = exact_radiance(description.settings.max_bounces);
        SceneReport report;
        const CancelFlag cancel;
        const auto scene = build_scene(std::move(description), cancel, report);
        const GuidingField field = poisoned_field(scene->bounds, Vec3(0.6f, 0.0f, 0.8f), pool);
        ASSERT_GT(field.generation(), 0u);
        const std::vector<float> estimate(std::size_t{32} * 24, static_cast<float>(exact));
        for (const bool roulette : {false, true}) {
            GuidingContext guiding;
            guiding.field = &field;
            guiding.fixed_share = {0.5f, 0.5f};
            guiding.adjoint_scale.fill(roulette ? 1.0f : 0.0f);
            guiding.pixel_estimate = estimate;
            Integrator integrator(*scene, pool);
            SharedFilm film(frame);
            ASSERT_TRUE(integrator.render_pass({0, 1024}, guiding, film, {cancel, {}}));
            EXPECT_NEAR(mean_red(film.film) / exact, 1.0, 3e-3)
                << "nee " << nee << ", roulette " << roulette;
            EXPECT_EQ(integrator.statistics().nonfinite, 0u);
        }
    }
}

// Which vertices are guided is decided before their directions are drawn.
TEST(GuidedStatistics, ALimitedPoisonedGuideKeepsTheClosedForm) {
    ThreadPool pool(2);
    SceneDescription description = emitting_box(32, 24);
    const FilmDescription frame = description.film;
    const double exact = exact_radiance(description.settings.max_bounces);
    SceneReport report;
    const CancelFlag cancel;
    const auto scene = build_scene(std::move(description), cancel, report);
    const GuidingField field = poisoned_field(scene->bounds, Vec3(0.6f, 0.0f, 0.8f), pool);
    std::uint64_t asked = std::numeric_limits<std::uint64_t>::max();
    for (const std::uint32_t whole : {kGuideRanks, 7u, 3u, 0u}) {
        GuidingContext guiding;
        guiding.field = &field;
        guiding.fixed_share = {0.5f, 0.5f};
        guiding.limit.whole = whole;
        guiding.limit.part = 0.4f;
        guiding.record = guiding.probe = true;
        guiding.record_probability = 0.1f;
        Integrator integrator(*scene, pool);
        SharedFilm film(frame);
        ASSERT_TRUE(integrator.render_pass({0, 1024}, guiding, film, {cancel, {}}));
        EXPECT_NEAR(mean_red(film.film) / exact, 1.0, 3e-3) << "ranks " << whole;
        BatchStatistics statistics = integrator.statistics();
        EXPECT_LT(statistics[Stage::QueryGuidingField].items, asked) << "ranks " << whole;
        asked = statistics[Stage::QueryGuidingField].items;
    }
}

TEST(GuidedStatistics, LearningKeepsTheClosedForm) {
    for (const GuidingMode mode : {GuidingMode::Neural,
                                   GuidingMode::Slides,
                                   GuidingMode::SlidesPosition,
                                   GuidingMode::SlidesMixture,
                                   GuidingMode::NeuralReflection,
                                   GuidingMode::NeuralRadiance}) {
        SceneDescription description = emitting_box(48, 32);
        description.settings.guiding = mode;
        description.settings.samples = 256;
        const double exact = exact_radiance(description.settings.max_bounces);
        const Rendered result = render(std::move(description));
        EXPECT_NEAR(result.mean(0) / exact, 1.0, 2e-3);
        EXPECT_TRUE(result.progress.guiding.enabled);
        EXPECT_GT(result.items("train"), 0u);
        EXPECT_EQ(result.progress.nonfinite_samples, 0u);
    }
}

TEST(Guided, IsBitEqualForAnyNumberOfThreads) {
    for (const GuidingMode mode : {GuidingMode::Neural,
                                   GuidingMode::Slides,
                                   GuidingMode::SlidesPosition,
                                   GuidingMode::SlidesMixture}) {
        SceneDescription description =
            kSlowdown > 1.0 ? two_rooms(31, 23, 16) : two_rooms(61, 47, 24);
        description.settings.guiding = mode;
        const Rendered one = render(description, 1);
        ASSERT_EQ(one.progress.state, SessionState::Finished);
        EXPECT_GT(one.items("query_guiding_field"), 0u);
        for (const unsigned threads : {2u, 8u}) {
            const Rendered other = render(description, threads);
            EXPECT_EQ(0,
                      std::memcmp(one.combined.data(),
                                  other.combined.data(),
                                  one.combined.size() * sizeof(float)))
                << threads << " threads";
        }
    }
}

// What transmits is left to its material, what reflects is not.
TEST(Guided, TransmissionIsGuidedUnlessItIsLeftToTheMaterial) {
    const auto asked = [](GuidingMode mode, const NodeProgram& program) {
        SceneBuilder builder;
        builder.object(sphere_mesh("ball", Vec3(0.0f), 1.0f), builder.material("ball", program));
        builder.world(background_program(Rgb(1.0f), 1.0f));
        builder.camera(Vec3(0, -4, 0), Vec3(0.0f), 0.6f, 16, 16);
        SceneDescription description = builder.build();
        description.settings.guiding = mode;
        description.settings.samples = 8;
        return render(std::move(description)).items("query_guiding_field");
    };
    const NodeProgram rough_glass = glass_program(Rgb(1.0f), 0.3f, 1.5f);
    const NodeProgram rough_metal = glossy_program(Rgb(1.0f), 0.3f);
    const std::uint64_t all = asked(GuidingMode::Neural, rough_glass);
    EXPECT_GT(all, 0u);
    // The glass' own reflection is still served, where it is most of what scatters.
    EXPECT_LT(asked(GuidingMode::NeuralReflection, rough_glass), all / 2);
    EXPECT_GT(asked(GuidingMode::NeuralReflection, rough_metal), 0u);
    EXPECT_EQ(asked(GuidingMode::NeuralRadiance, rough_glass), all);
}

// A pass without a guide after one with it is what it would have been without either: when the gate
// closes, nothing of the last guided pass may speak for the next paths.
TEST(Guided, PassesAfterTheGuideAreThoseWithoutIt) {
    ThreadPool pool(2);
    SceneDescription description = two_rooms(40, 30, 2);
    const FilmDescription frame = description.film;
    SceneReport report;
    const CancelFlag cancel;
    const auto scene = build_scene(std::move(description), cancel, report);
    const GuidingField field = poisoned_field(scene->bounds, Vec3(0.6f, 0.0f, 0.8f), pool);
    ASSERT_GT(field.generation(), 0u);
    const auto second_pass = [&](const GuidingContext& first) {
        Integrator integrator(*scene, pool);
        SharedFilm before(frame);
        SharedFilm film(frame);
        EXPECT_TRUE(integrator.render_pass({0, 1}, first, before, {cancel, {}}));
        EXPECT_TRUE(integrator.render_pass({1, 1}, GuidingContext{}, film, {cancel, {}}));
        std::vector<float> pixels(std::size_t{frame.crop_width} * frame.crop_height * 4);
        film.film.read(FilmPass::Combined, pixels);
        return pixels;
    };
    GuidingContext guiding;
    guiding.field = &field;
    guiding.fixed_share = {0.5f, 0.5f};
    guiding.record = true;
    guiding.record_probability = 1.0f;
    const std::vector<float> guided = second_pass(guiding);
    const std::vector<float> unguided = second_pass({});
    EXPECT_EQ(0, std::memcmp(guided.data(), unguided.data(), guided.size() * sizeof(float)));
}

// The same mean with and without the guide, and less noise with it where light is hard to find.
TEST(GuidedStatistics, AgreesWithUnguidedAndIsLessNoisy) {
    SceneDescription unguided = two_rooms(48, 36, 128);
    SceneDescription guided = unguided;
    guided.settings.guiding = GuidingMode::Neural;
    const Rendered without = render(std::move(unguided));
    const Rendered with = render(std::move(guided));
    EXPECT_NEAR(with.mean(1) / without.mean(1), 1.0, 0.03);
    EXPECT_LT(with.progress.noise, without.progress.noise);
    EXPECT_GT(with.progress.guiding.guided_share, 0.1);
}

}  // namespace
}  // namespace pharos
