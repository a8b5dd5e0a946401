// What is slow: the noisy object and the light behind its noise are named, by shares that add up.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "support/description_builders.h"
#include "support/render.h"

namespace pharos::testing {
namespace {

// Two walls side by side: one is lit by a card close by through a slit that few rays find, the
// other is lit evenly by a far small lamp.
SceneDescription two_walls() {
    SceneBuilder b;
    const auto white = b.material("white", diffuse_program(Rgb(0.8f)));
    const auto hidden =
        b.material("emitter", diffuse_emission_program(Rgb(0.0f), Rgb(40.0f)), false);
    b.object(quad_mesh("quiet", Vec3(-2, 0, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), white);
    b.object(quad_mesh("noisy", Vec3(0.2f, 0, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), white);
    b.object(quad_mesh("screen", Vec3(0.1f, -3, -1), Vec3(0, 3, 0), Vec3(0, 0, 2)), white);
    b.object(quad_mesh("card", Vec3(1.0f, -0.6f, 0.9f), Vec3(0.3f, 0, 0), Vec3(0, 0.3f, 0)),
             hidden);
    LightDescription lamp;
    lamp.name = "far";
    lamp.to_world[3] = Vec4(-1.0f, -4.0f, 0.0f, 1.0f);
    lamp.strength = Rgb(200.0f);
    b.lamp(lamp);
    b.camera(Vec3(0, -6, 0), Vec3(0, 0, 0), 0.7f, 48, 24);
    SceneDescription d = b.build();
    d.settings.samples = 32;
    d.passes.wanted = pass_bit(FilmPass::Effort);
    return d;
}

struct Effort {
    std::vector<EffortShare> rows;
    std::vector<float> picture;
    std::vector<float> combined;

    [[nodiscard]] double share(EffortKind kind, const std::string& name) const {
        for (const EffortShare& row : rows) {
            if (row.kind == kind && row.name == name) {
                return row.share;
            }
        }
        return 0.0;
    }
};

Effort measure(SceneDescription description, unsigned threads = 0) {
    const RenderSession session(std::move(description), threads);
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    EXPECT_EQ(session.progress().state, SessionState::Finished) << session.progress().error;
    Effort effort;
    effort.rows = session.effort();
    const std::size_t pixels = std::size_t{session.width()} * session.height();
    effort.picture.resize(pixels);
    session.read(FilmPass::Effort, effort.picture);
    effort.combined.resize(4 * pixels);
    session.read(FilmPass::Combined, effort.combined);
    return effort;
}

TEST(Effort, NoisyObjectAndItsLightAreNamed) {
    const Effort effort = measure(two_walls());
    EXPECT_GT(effort.share(EffortKind::Object, "noisy"), 0.6);
    EXPECT_LT(effort.share(EffortKind::Object, "quiet"), 0.2);
    EXPECT_GT(effort.share(EffortKind::Light, "card"), 0.6);
    for (const EffortKind kind : {EffortKind::Object, EffortKind::Light}) {
        double sum = 0.0;
        double before = 1.0;
        for (const EffortShare& row : effort.rows) {
            if (row.kind == kind) {
                sum += row.share;
                EXPECT_LE(row.share, before);
                before = row.share;
            }
        }
        EXPECT_NEAR(sum, 1.0, 0.05);
    }
}

TEST(Effort, PassIsVarianceTimesCost) {
    // Every sample of an emitting card in the open is the same and one ray: no effort.
    SceneBuilder b;
    b.object(quad_mesh("card", Vec3(-9, 0, -9), Vec3(18, 0, 0), Vec3(0, 0, 18)),
             b.material("emitter", emission_program(Rgb(2.0f), 1.0f), false));
    b.camera(Vec3(0, -6, 0), Vec3(0, 0, 0), 0.7f, 8, 8);
    SceneDescription even = b.build();
    even.settings.samples = 8;
    even.passes.wanted = pass_bit(FilmPass::Effort);
    for (const float value : measure(std::move(even)).picture) {
        EXPECT_NEAR(value, 0.0f, 1e-9f);
    }
    const Effort effort = measure(two_walls());
    const auto mean = [&](std::size_t first) {
        double sum = 0.0;
        for (std::size_t y = 0; y < 24; ++y) {
            for (std::size_t x = first; x < first + 12; ++x) {
                sum += static_cast<double>(effort.picture[48 * y + x]);
            }
        }
        return sum;
    };
    EXPECT_GT(mean(30), 4.0 * mean(6));
}

TEST(Effort, ChangesNoBitAndNothingIsNotedWithoutIt) {
    SceneDescription without = two_walls();
    without.passes.wanted = 0;
    const Effort effort = measure(two_walls());
    EXPECT_EQ(effort.picture, measure(two_walls(), 1).picture);
    EXPECT_EQ(effort.combined, measure(without).combined);
    EXPECT_TRUE(measure(without).rows.empty());
}

}  // namespace
}  // namespace pharos::testing
