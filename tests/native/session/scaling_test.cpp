// The unit of light is nobody's business: a scene with all its light times a power of two renders
// to the picture times that power, bit for bit, whatever the guide learned on the way. Nor is that
// of length, and a scene far away is the same to what floats know of places there.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <glm/gtc/matrix_transform.hpp>
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

// Any other number rounds: the picture follows it within what sums of floats allow.
TEST(Scaling, LightTimesAnythingScalesThePicture) {
    const Rendered one = render(scene(GuidingMode::Off, 1.0f), 2);
    double worst = 0.0;
    for (const float scale : {1e-6f, 1e-3f, 30.0f, 1e6f}) {
        const Rendered other = render(scene(GuidingMode::Off, scale), 2);
        EXPECT_EQ(other.progress.nonfinite_samples, 0u);
        for (std::size_t i = 0; i < one.combined.size(); ++i) {
            const double expected =
                static_cast<double>(one.combined[i]) * static_cast<double>(scale);
            if (i % 4 != 3 && expected > 0.0) {
                worst = std::max(worst,
                                 std::abs(static_cast<double>(other.combined[i]) / expected - 1.0));
            }
        }
    }
    say_stress("light times 1e-6 to 1e6: worst relative difference of a value",
               4 * one.combined.size(),
               worst,
               1e-5);
    EXPECT_LE(worst, 1e-5);
}

// A lit room of 4 m, its furniture instanced and single, seen from inside: as large as `scale`
// says, and then moved.
SceneDescription placed_room(float scale, const Vec3& away) {
    SceneDescription d = two_rooms(48, 36, 64);
    Mat4 place = glm::translate(Mat4(1.0f), away);
    place = glm::scale(place, Vec3(scale));
    for (InstanceDescription& instance : d.instances) {
        instance.to_world = place * instance.to_world;
    }
    for (LightDescription& lamp : d.lights) {
        lamp.to_world = glm::translate(Mat4(1.0f), away) * lamp.to_world;
        lamp.to_world[3] =
            place * glm::inverse(glm::translate(Mat4(1.0f), away)) * lamp.to_world[3];
        lamp.size_u *= scale;
        lamp.size_v *= scale;
        lamp.strength *= scale * scale;
    }
    d.camera.to_world[3] = place * d.camera.to_world[3];
    d.camera.near_clip *= scale;
    d.camera.far_clip *= scale;
    d.settings.guiding = GuidingMode::Off;
    return d;
}

struct Difference {
    double mean = 0.0;    // relative
    double relmse = 0.0;  // of the pictures
};

Difference difference(const Rendered& picture, const Rendered& reference) {
    Difference d;
    double sum = 0.0;
    double reference_sum = 0.0;
    const std::size_t count = reference.combined.size();
    for (std::size_t i = 0; i < count; ++i) {
        const auto a = static_cast<double>(picture.combined[i]);
        const auto b = static_cast<double>(reference.combined[i]);
        sum += a;
        reference_sum += b;
        d.relmse += (a - b) * (a - b) / (b * b + 0.01) / static_cast<double>(count);
    }
    d.mean = std::abs(sum / reference_sum - 1.0);
    return d;
}

TEST(Scaling, SizesChangeNothing) {
    const Rendered reference = render(placed_room(1.0f, Vec3(0.0f)), 2);
    for (const float scale : {1e-4f, 1e-3f, 1e-2f, 1e2f, 1e4f, 1e6f}) {
        const Rendered other = render(placed_room(scale, Vec3(0.0f)), 2);
        ASSERT_EQ(other.progress.state, SessionState::Finished) << other.progress.error;
        EXPECT_EQ(other.progress.nonfinite_samples, 0u);
        const Difference d = difference(other, reference);
        const std::string size = std::to_string(std::lround(std::log10(scale)));
        say_stress(("room times 10^" + size + ": relative difference of the mean").c_str(),
                   1,
                   d.mean,
                   0.005);
        EXPECT_LE(d.mean, 0.005) << scale;
    }
}

TEST(Scaling, PlacesChangeLittle) {
    const Rendered reference = render(placed_room(1.0f, Vec3(0.0f)), 2);
    constexpr std::array<std::pair<float, double>, 4> kBars{
        {{1e3f, 1e-4}, {1e4f, 1e-3}, {1e5f, 1e-2}, {1e6f, 1e9}}};
    for (const auto& [metres, bar] : kBars) {
        const Rendered other = render(placed_room(1.0f, metres * Vec3(0.8f, -0.6f, 0.1f)), 2);
        ASSERT_EQ(other.progress.state, SessionState::Finished) << other.progress.error;
        EXPECT_EQ(other.progress.nonfinite_samples, 0u);
        const Difference d = difference(other, reference);
        const std::string far = std::to_string(std::lround(std::log10(metres)));
        say_stress(("room moved by 10^" + far + " m: relMSE").c_str(), 1, d.relmse, bar);
        EXPECT_LE(d.relmse, bar) << metres;
    }
}

}  // namespace
}  // namespace pharos
