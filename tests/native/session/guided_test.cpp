// Guided renders: the same mean whatever the guide believes, the same bits for any thread count.
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "integrator/integrator.h"
#include "session/guide_controller.h"
#include "support/description_builders.h"
#include "support/render.h"

namespace pharos {
namespace {

using namespace pharos::testing;

constexpr float kEmitted = 0.5f;
constexpr float kAlbedo = 0.5f;

// A closed box that emits everywhere: L is known exactly.
SceneDescription emitting_box(std::uint32_t width, std::uint32_t height) {
    SceneBuilder builder;
    const auto material =
        builder.material("walls", diffuse_emission_program(Rgb(kAlbedo), Rgb(kEmitted)));
    builder.object(box_mesh("box", Vec3(-1, -2, -1.5f), Vec3(1.5f, 1, 1), true), material);
    builder.camera(Vec3(0.2f, 0, 0), Vec3(1, 0.3f, 0.2f), 1.2f, width, height);
    SceneDescription description = builder.build();
    description.settings.max_bounces = 6;
    description.settings.samples = 64;
    return description;
}

double exact_radiance(std::uint32_t max_bounces) {
    const double a = static_cast<double>(kAlbedo);
    return static_cast<double>(kEmitted) *
           (1.0 - std::pow(a, static_cast<double>(max_bounces) + 2.0)) / (1.0 - a);
}

// A lamp behind a half-open wall: paths differ widely, so that the guide turns on.
SceneDescription two_rooms(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
    SceneBuilder builder;
    const auto white = builder.material("white", diffuse_program(Rgb(0.8f)));
    const auto gloss = builder.material("gloss", glossy_program(Rgb(0.8f), 0.2f));
    const auto glass = builder.material("glass", glass_program(Rgb(1.0f), 0.0f, 1.5f));
    builder.object(box_mesh("rooms", Vec3(-2, -2, 0), Vec3(2, 2, 2.5f), true), white);
    builder.object(box_mesh("wall", Vec3(-2, 0.5f, 0), Vec3(1.6f, 0.6f, 2.5f)), white);
    builder.object(sphere_mesh("gloss", Vec3(-0.8f, -0.6f, 0.5f), 0.5f), gloss);
    builder.object(sphere_mesh("glass", Vec3(0.6f, -0.8f, 0.4f), 0.4f), glass);
    builder.lamp(
        area_lamp(look_at(Vec3(-1.2f, 1.3f, 2.4f), Vec3(-1.2f, 1.3f, 0)), Rgb(100.0f), 0.5f, 0.5f));
    builder.camera(Vec3(0, -1.9f, 1.2f), Vec3(0, 0, 1), 1.0f, width, height);
    SceneDescription description = builder.build();
    description.settings.samples = samples;
    return description;
}

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
            guiding.fixed_share = 0.5f;
            guiding.roulette = roulette;
            guiding.pixel_estimate = estimate;
            Integrator integrator(*scene, pool);
            SharedFilm film(frame);
            ASSERT_TRUE(integrator.render_pass({0, 1024, 1.0}, guiding, film, {cancel, {}}));
            std::vector<float> pixels(estimate.size() * 4);
            film.film.read(FilmPass::Combined, pixels);
            double mean = 0.0;
            for (std::size_t i = 0; i < pixels.size(); i += 4) {
                mean += static_cast<double>(pixels[i]) / static_cast<double>(estimate.size());
            }
            EXPECT_NEAR(mean / exact, 1.0, 3e-3) << "nee " << nee << ", roulette " << roulette;
            EXPECT_EQ(integrator.statistics().nonfinite, 0u);
        }
    }
}

TEST(GuidedStatistics, LearningKeepsTheClosedForm) {
    for (const GuidingMode mode : {GuidingMode::Neural, GuidingMode::Slides}) {
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
    for (const GuidingMode mode : {GuidingMode::Neural, GuidingMode::Slides}) {
        SceneDescription description = two_rooms(61, 47, 24);
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

TEST(Guided, PassWeightsDependOnTheNumberAlone) {
    EXPECT_GT(pass_weight(0), 0.0);
    for (std::uint32_t pass = 0; pass < 100; ++pass) {
        EXPECT_LE(pass_weight(pass), pass_weight(pass + 1));
    }
    EXPECT_EQ(pass_weight(100), 1.0);
}

}  // namespace
}  // namespace pharos
