// The learned distribution at a point beside the true one: closed forms, learning, saved weights.
#include "session/field_probe.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/description_builders.h"

namespace pharos {
namespace {

using namespace pharos::testing;

TEST(FieldProbe, DivergenceOfKnownPictures) {
    constexpr std::uint32_t kHeight = 32;
    constexpr std::size_t kCells = 2 * kHeight * kHeight;
    const std::vector<float> uniform(kCells, 3.0f);
    std::vector<float> upper(kCells, 0.0f);
    std::fill(upper.begin() + kCells / 2, upper.end(), 7.0f);
    EXPECT_NEAR(latlong_divergence(uniform, uniform, kHeight), 0.0, 1e-12);
    EXPECT_NEAR(latlong_divergence(upper, uniform, kHeight), std::log(2.0), 1e-12);
    EXPECT_GT(latlong_divergence(uniform, upper, kHeight), 5.0);
}

TEST(FieldProbe, GridLooksRound) {
    EXPECT_NEAR(latlong_direction(0.3f, 1.0f).z, 1.0f, 1e-6f);
    EXPECT_NEAR(latlong_direction(0.3f, 0.0f).z, -1.0f, 1e-6f);
    EXPECT_NEAR(latlong_direction(0.5f, 0.5f).x, 1.0f, 1e-6f);
    EXPECT_NEAR(latlong_direction(0.75f, 0.5f).y, 1.0f, 1e-6f);
}

// In a closed box that emits everywhere the light is the same from all sides.
TEST(FieldProbe, TruthHasTheClosedForm) {
    constexpr float kAlbedo = 0.5f;
    constexpr float kEmitted = 0.25f;
    SceneBuilder b;
    const auto walls = b.material("walls", diffuse_emission_program(Rgb(kAlbedo), Rgb(kEmitted)));
    b.object(box_mesh("box", Vec3(-1), Vec3(1), true), walls);
    b.camera(Vec3(0), Vec3(0.2f, 0.1f, -1), 1.0f, 16, 16);
    SceneDescription d = b.build();
    d.settings.max_bounces = 4;
    ProbeSettings settings;
    settings.x = settings.y = 8;
    settings.height = 16;
    settings.rays = 256;
    settings.train = false;
    SceneReport report;
    const FieldProbe probe = probe_field(std::move(d), settings, report);
    EXPECT_NEAR(probe.position.z, -1.0f, 1e-5f);
    EXPECT_NEAR(probe.normal.z, 1.0f, 1e-6f);
    const float L = kEmitted * (1.0f - std::pow(kAlbedo, 5.0f)) / (1.0f - kAlbedo);
    double irradiance = 0.0;
    for (std::uint32_t y = 0; y < probe.height; ++y) {
        // The cosine's mean over the row in latitude.
        const float lower = kPi * (static_cast<float>(y) / 16.0f - 0.5f);
        const float upper = lower + kPi / 16.0f;
        const float cosine = y < 8 ? 0.0f : 16.0f * (std::cos(lower) - std::cos(upper)) / kPi;
        double row = 0.0;
        for (std::uint32_t x = 0; x < probe.width; ++x) {
            row += static_cast<double>(probe.truth[y * probe.width + x]) / probe.width;
        }
        EXPECT_NEAR(row, static_cast<double>(L * cosine), 0.01 * static_cast<double>(L)) << y;
        irradiance += row * std::cos(0.5 * static_cast<double>(lower + upper));
    }
    const double cell = std::numbers::pi / 16.0;
    EXPECT_NEAR(irradiance * 2.0 * std::numbers::pi * cell,
                static_cast<double>(L) * std::numbers::pi,
                0.01);
}

SceneDescription lit_from_one_side() {
    SceneBuilder b;
    const auto white = b.material("white", diffuse_program(Rgb(0.6f)));
    const auto lamp = b.material("lamp", emission_program(Rgb(1.0f), 20.0f));
    b.object(box_mesh("room", Vec3(-2, -2, 0), Vec3(2, 2, 2.5f), true), white);
    b.object(quad_mesh("lamp", Vec3(1.95f, -0.6f, 0.8f), Vec3(0, 0, 0.9f), Vec3(0, 1.2f, 0)), lamp);
    b.camera(Vec3(0, 0, 1.5f), Vec3(0.1f, 0, 0), 1.0f, 32, 32);
    SceneDescription d = b.build();
    d.settings.samples = 48;
    d.settings.use_nee = false;
    d.settings.guiding = GuidingMode::Neural;
    return d;
}

TEST(FieldProbe, LearnedComesNearTheTruthAndIsSaved) {
    ProbeSettings settings;
    settings.x = settings.y = 16;
    settings.height = 32;
    settings.rays = 16;
    SceneReport report;
    const FieldProbe learned = probe_field(lit_from_one_side(), settings, report);
    const std::vector<float> uniform(learned.truth.size(), 1.0f);
    const double start = latlong_divergence(learned.truth, uniform, learned.height);
    EXPECT_LT(learned.divergence, 0.5 * start);
    // The brightest direction points to the lamp.
    int brightest = 0;
    for (int k = 1; k < learned.mixture.lobe_count; ++k) {
        brightest = learned.mixture.weight[k] * learned.mixture.kappa[k] >
                            learned.mixture.weight[brightest] * learned.mixture.kappa[brightest]
                        ? k
                        : brightest;
    }
    EXPECT_GT(learned.mixture.mu_x[brightest], 0.7f);

    settings.weights = learned.weights;
    settings.train = false;
    settings.rays = 1;
    const FieldProbe again = probe_field(lit_from_one_side(), settings, report);
    EXPECT_EQ(again.learned, learned.learned);
}

TEST(FieldProbe, WhatCannotBeProbedIsSaid) {
    SceneReport report;
    ProbeSettings settings;
    settings.train = false;
    EXPECT_THROW(static_cast<void>(probe_field({}, settings, report)), std::invalid_argument);
    SceneBuilder b;
    b.camera(Vec3(0), Vec3(1, 0, 0), 1.0f, 4, 4);
    EXPECT_THROW(static_cast<void>(probe_field(b.build(), settings, report)),
                 std::invalid_argument);
    const std::vector<std::byte> broken(10);
    settings.weights = broken;
    settings.x = settings.y = 2;
    EXPECT_THROW(static_cast<void>(probe_field(lit_from_one_side(), settings, report)),
                 std::invalid_argument);
}

}  // namespace
}  // namespace pharos
