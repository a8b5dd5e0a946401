// Renders whose guide is fed lies: the picture stays finite and unbiased, and its error is at most
// 1.05 of that without a guide. Long form, 800 passes each: PHAROS_LONG_TESTS=1.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "integrator/integrator.h"
#include "session/guide_controller.h"
#include "support/render.h"
#include "support/test_scenes.h"
#include "support/welch.h"

namespace pharos::testing {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t kWidth = 32;
constexpr std::uint32_t kHeight = 24;
constexpr std::uint32_t kSeeds = 4;

using Attack = std::function<void(RadianceRecord&, std::size_t i, std::uint32_t pass)>;

struct AttackCase {
    const char* name;
    Attack attack;
};

std::vector<AttackCase> attacks() {
    const auto radiance = [](float value) {
        return [value](RadianceRecord& r, std::size_t, std::uint32_t) { r.radiance_cos = value; };
    };
    return {
        {"black", radiance(0.0f)},
        {"faint", radiance(1e-30f)},
        {"bright", radiance(1e30f)},
        {"infinite", radiance(kInfinite)},
        {"not_a_number", radiance(kNan)},
        {"firefly",
         [](RadianceRecord& r, std::size_t i, std::uint32_t pass) {
             r.radiance_cos = i == 77 && pass % 8 == 0 ? 1e30f : r.radiance_cos;
         }},
        {"alternating",
         [](RadianceRecord& r, std::size_t i, std::uint32_t pass) {
             r.radiance_cos = (i + pass) % 2 == 0 ? 1e30f : 1e-30f;
         }},
        {"one_point",
         [](RadianceRecord& r, std::size_t, std::uint32_t) { r.position = Vec3(0.25f); }},
        {"far_apart",
         [](RadianceRecord& r, std::size_t i, std::uint32_t) {
             r.position *= i % 2 == 0 ? 1e9f : 1.0f;
         }},
        {"broken_densities",
         [](RadianceRecord& r, std::size_t i, std::uint32_t) {
             r.pdf = i % 3 == 0 ? 1e-38f : 1e38f;
         }},
        {"one_direction",
         [](RadianceRecord& r, std::size_t, std::uint32_t) {
             r.wi = Vec3(0, 0, 1);
             r.radiance_cos = 1.0f;
         }},
    };
}

struct Attacked {
    std::vector<float> combined;
    std::uint64_t nonfinite = 0;
};

// As a session does it, with the attack between the pass and the training.
Attacked render_under(const Attack& attack, SceneDescription description, std::uint32_t passes) {
    const CancelFlag cancel;
    SceneReport report;
    const GuidingMode mode = description.settings.guiding;
    const auto scene = build_scene(std::move(description), cancel, report);
    const std::uint64_t pixels = std::uint64_t{kWidth} * kHeight;
    ThreadPool pool(2);
    Integrator integrator(*scene, pool);
    SharedFilm film(scene->description.film);
    GuideController guide(mode, scene->bounds, pixels);
    for (std::uint32_t pass = 0; pass < passes; ++pass) {
        const std::uint64_t vertices = integrator.statistics().vertices;
        EXPECT_TRUE(integrator.render_pass(
            {pass, 1, guide.weight(pass)}, guide.next_pass(), film, {cancel, {}}));
        guide.see(film.film, pass + 1);
        RecordBuffer records = integrator.take_records();
        std::ranges::sort(records.radiance, {}, &RadianceRecord::key);
        for (std::size_t i = 0; i < records.radiance.size(); ++i) {
            attack(records.radiance[i], i, pass);
        }
        SelectionPass work;
        work.paths = static_cast<double>(pixels);
        work.vertices = static_cast<double>(integrator.statistics().vertices - vertices);
        guide.learn(std::move(records), work, film.film, pool);
    }
    Attacked result;
    result.combined.resize(pixels * 4);
    film.film.read(FilmPass::Combined, result.combined);
    result.nonfinite = integrator.statistics().nonfinite;
    return result;
}

std::uint32_t passes_under_attack(std::uint32_t usual) {
    return std::getenv("PHAROS_LONG_TESTS") != nullptr ? 800 : usual;
}

// The guide of the slides is used everywhere, whatever it has learned.
TEST(AttackStatistics, PictureKeepsTheClosedForm) {
    SceneDescription description = emitting_box(kWidth, kHeight);
    const double exact = exact_radiance(description.settings.max_bounces);
    for (const GuidingMode mode : {GuidingMode::Slides, GuidingMode::Neural}) {
        description.settings.guiding = mode;
        for (const AttackCase& c : attacks()) {
            SCOPED_TRACE(c.name);
            const Attacked result = render_under(c.attack, description, passes_under_attack(24));
            Moments moments;
            for (std::size_t i = 0; i < result.combined.size(); i += 4) {
                moments.add(static_cast<double>(result.combined[i]) / exact);
            }
            EXPECT_LT(std::abs(moments.mean - 1.0), 5.0 * std::sqrt(moments.variance()));
            EXPECT_EQ(result.nonfinite, 0u);
        }
    }
}

double squared_error(const std::vector<float>& picture, const std::vector<float>& reference) {
    double sum = 0.0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
        const auto d = static_cast<double>(picture[i]) - static_cast<double>(reference[i]);
        sum +=
            d * d / (static_cast<double>(reference[i]) * static_cast<double>(reference[i]) + 0.01);
    }
    return sum;
}

// Sum over seeds, so that one firefly does not decide.
double error_under(const Attack& attack, SceneDescription description, const Rendered& reference) {
    double sum = 0.0;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
        description.settings.seed = seed;
        const Attacked result = render_under(attack, description, passes_under_attack(64));
        EXPECT_EQ(result.nonfinite, 0u);
        sum += squared_error(result.combined, reference.combined);
    }
    return sum;
}

// A guide that is fed lies is not used; one that is fed lies and truth may be, when it gains.
TEST(AttackStatistics, ErrorIsThatOfAnUnguidedRender) {
    SceneDescription description = two_rooms(kWidth, kHeight, 1024);
    const Rendered reference = render(description);
    const auto leave_alone = [](RadianceRecord&, std::size_t, std::uint32_t) {};
    const double unguided = error_under(leave_alone, description, reference);
    description.settings.guiding = GuidingMode::Neural;
    for (const AttackCase& c : attacks()) {
        SCOPED_TRACE(c.name);
        const double ratio = error_under(c.attack, description, reference) / unguided;
        RecordProperty(c.name, std::to_string(ratio));
        EXPECT_LT(ratio, 1.05);
    }
}

}  // namespace
}  // namespace pharos::testing
