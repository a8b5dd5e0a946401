// Scenes that several tests of whole renders use.
#pragma once

#include <cmath>
#include <cstdint>

#include "support/description_builders.h"

namespace pharos::testing {

inline constexpr float kBoxEmitted = 0.5f;
inline constexpr float kBoxAlbedo = 0.5f;

// A closed box that emits everywhere: L is known exactly.
[[nodiscard]] inline SceneDescription emitting_box(std::uint32_t width, std::uint32_t height) {
    SceneBuilder builder;
    const auto material =
        builder.material("walls", diffuse_emission_program(Rgb(kBoxAlbedo), Rgb(kBoxEmitted)));
    builder.object(box_mesh("box", Vec3(-1, -2, -1.5f), Vec3(1.5f, 1, 1), true), material);
    builder.camera(Vec3(0.2f, 0, 0), Vec3(1, 0.3f, 0.2f), 1.2f, width, height);
    SceneDescription description = builder.build();
    description.settings.max_bounces = 6;
    description.settings.samples = 64;
    return description;
}

// e (1 - a^(n + 2)) / (1 - a) with n bounces.
[[nodiscard]] inline double exact_radiance(std::uint32_t max_bounces) {
    const auto a = static_cast<double>(kBoxAlbedo);
    return static_cast<double>(kBoxEmitted) *
           (1.0 - std::pow(a, static_cast<double>(max_bounces) + 2.0)) / (1.0 - a);
}

// A lamp behind a half-open wall: paths differ widely, so that the guide turns on.
[[nodiscard]] inline SceneDescription two_rooms(std::uint32_t width,
                                                std::uint32_t height,
                                                std::uint32_t samples) {
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

}  // namespace pharos::testing
