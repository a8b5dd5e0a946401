// The unit of light is nobody's business: a scene with all its light times a power of two renders
// to the picture times that power, bit for bit, whatever the guide learned on the way.
#include <cmath>

#include <gtest/gtest.h>

#include "support/render.h"
#include "support/stress.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

// Huge and tiny emitters in one scene.
SceneDescription scene(GuidingMode guiding, float scale) {
    SceneBuilder builder;
    const auto white = builder.material("white", diffuse_program(Rgb(0.8f)));
    const auto gloss = builder.material("gloss", glossy_program(Rgb(0.8f), 0.2f));
    const auto ember =
        builder.material("ember", diffuse_emission_program(Rgb(0.5f), Rgb(1e-8f * scale)));
    builder.object(box_mesh("rooms", Vec3(-2, -2, 0), Vec3(2, 2, 2.5f), true), white);
    builder.object(box_mesh("wall", Vec3(-2, 0.5f, 0), Vec3(1.6f, 0.6f, 2.5f)), white);
    builder.object(sphere_mesh("gloss", Vec3(-0.8f, -0.6f, 0.5f), 0.5f), gloss);
    builder.object(box_mesh("ember", Vec3(0.5f, -0.8f, 0.2f), Vec3(0.8f, -0.5f, 0.5f)), ember);
    builder.lamp(area_lamp(
        look_at(Vec3(-1.2f, 1.3f, 2.4f), Vec3(-1.2f, 1.3f, 0)), Rgb(1e8f * scale), 0.5f, 0.5f));
    const std::uint32_t side = kSlowdown > 1.0 ? 12 : 40;
    builder.camera(Vec3(0, -1.9f, 1.2f), Vec3(0, 0, 1), 1.0f, side, side * 3 / 4);
    SceneDescription description = builder.build();
    description.settings.samples = 24;
    description.settings.guiding = guiding;
    return description;
}

TEST(Scaling, PowersOfTwoChangeNoOtherBit) {
    std::uint64_t differing = 0;
    std::uint64_t compared = 0;
    for (const GuidingMode mode : {GuidingMode::Off, GuidingMode::Neural, GuidingMode::Slides}) {
        const Rendered one = render(scene(mode, 1.0f), 2);
        ASSERT_GT(one.mean(0), 0.0);
        EXPECT_EQ(one.progress.nonfinite_samples, 0u);
        for (const float scale : {0x1p-20f, 0x1p-3f, 0x1p10f}) {
            const Rendered other = render(scene(mode, scale), 2);
            EXPECT_EQ(other.progress.nonfinite_samples, 0u);
            for (std::size_t i = 0; i < one.combined.size(); ++i) {
                const float expected = i % 4 == 3 ? one.combined[i] : one.combined[i] * scale;
                differing += other.combined[i] == expected ? 0 : 1;
                ++compared;
            }
            EXPECT_EQ(differing, 0u) << "guide " << static_cast<int>(mode) << ", scale " << scale;
        }
    }
    say_stress("light times powers of two, guided too: values that are not",
               compared,
               static_cast<double>(differing),
               0.0);
}

}  // namespace
}  // namespace pharos
