// Whole renders whose result is known in closed form.
#include <cmath>

#include <gtest/gtest.h>

#include "support/description_builders.h"
#include "support/render.h"

namespace pharos {
namespace {

using namespace pharos::testing;

SceneDescription with_samples(SceneBuilder& builder, std::uint32_t samples) {
    SceneDescription description = builder.build();
    description.settings.samples = samples;
    description.film.filter = PixelFilter::Box;
    description.film.filter_width = 1.0f;
    return description;
}

// Inside a closed box that emits e everywhere and reflects a: L = e (1 - a^(n+1)) / (1 - a) after n
// scatterings, whichever way the light is sampled.
TEST(ClosedFormStatistics, EmittingBox) {
    constexpr double kEmitted = 0.5;
    constexpr double kAlbedo = 0.5;
    for (const bool nee : {true, false}) {
        for (const std::uint32_t max_bounces : {0u, 1u, 4u, 12u}) {
            SceneBuilder builder;
            const auto material =
                builder.material("walls",
                                 diffuse_emission_program(Rgb(static_cast<float>(kAlbedo)),
                                                          Rgb(static_cast<float>(kEmitted))));
            builder.object(box_mesh("box", Vec3(-1, -2, -1.5f), Vec3(1.5f, 1, 1), true), material);
            builder.camera(Vec3(0.2f, 0, 0), Vec3(1, 0.3f, 0.2f), 1.2f, 32, 24);
            SceneDescription description = with_samples(builder, 256);
            description.settings.use_nee = nee;
            description.settings.max_bounces = max_bounces;
            const Rendered result = render(std::move(description));
            const double exact = kEmitted *
                                 (1.0 - std::pow(kAlbedo, static_cast<double>(max_bounces) + 2.0)) /
                                 (1.0 - kAlbedo);
            for (std::size_t channel = 0; channel < 3; ++channel) {
                EXPECT_NEAR(result.mean(channel) / exact, 1.0, 1e-3)
                    << "nee " << nee << ", max_bounces " << max_bounces;
            }
            EXPECT_EQ(result.progress.nonfinite_samples, 0u);
        }
    }
}

// A white object in a white world is invisible, lobe by lobe (those that lose no energy).
TEST(ClosedFormStatistics, WhiteFurnace) {
    const std::vector<std::pair<const char*, NodeProgram>> lobes{
        {"diffuse", diffuse_program(Rgb(1.0f))},
        {"mirror", glossy_program(Rgb(1.0f), 0.0f)},
        {"glossy", glossy_program(Rgb(1.0f), 0.08f)},
        {"glass", glass_program(Rgb(1.0f), 0.0f, 1.5f)},
        {"transparent", transparent_program(Rgb(1.0f))},
    };
    for (const auto& [name, program] : lobes) {
        SceneBuilder builder;
        const auto material = builder.material(name, program);
        builder.object(sphere_mesh("ball", Vec3(0), 1.0f, 32, 64), material);
        builder.world(background_program(Rgb(1.0f), 1.0f));
        builder.camera(Vec3(0, -4, 0), Vec3(0), 0.4f, 24, 24);
        SceneDescription description = with_samples(builder, 256);
        description.settings.max_bounces = 64;
        description.settings.transmission_bounces = 64;
        description.settings.glossy_bounces = 64;
        const Rendered result = render(std::move(description));
        EXPECT_NEAR(result.mean(0), 1.0, 0.003) << name;
        EXPECT_EQ(result.progress.nonfinite_samples, 0u) << name;
    }
}

// A pane of index 1.5 seen head-on passes (1 - R) / (1 + R) of what is behind it, R = 0.04.
TEST(ClosedFormStatistics, DielectricSlab) {
    SceneBuilder builder;
    const auto glass = builder.material("glass", glass_program(Rgb(1.0f), 0.0f, 1.5f));
    const auto light = builder.material("light", emission_program(Rgb(1.0f), 1.0f));
    builder.object(box_mesh("pane", Vec3(-50, -50, 0), Vec3(50, 50, 0.1f)), glass);
    builder.object(quad_mesh("panel", Vec3(-50, -50, -1), Vec3(100, 0, 0), Vec3(0, 100, 0)), light);
    builder.camera(Vec3(0, 0, 5), Vec3(0, 0, 0), 0.01f, 32, 32);
    SceneDescription description = with_samples(builder, 2048);
    description.settings.max_bounces = 64;
    description.settings.transmission_bounces = 64;
    description.settings.glossy_bounces = 64;
    const Rendered result = render(std::move(description));
    EXPECT_NEAR(result.mean(0) / (0.96 / 1.04), 1.0, 1e-3);
}

// A plane under a uniform sky, and the pixel filter sums to one on a flat picture.
TEST(ClosedFormStatistics, WhitePlaneUnderWhiteSky) {
    for (const PixelFilter filter :
         {PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris}) {
        SceneBuilder builder;
        const auto white = builder.material("white", diffuse_program(Rgb(0.7f, 0.5f, 0.2f)));
        builder.object(quad_mesh("plane", Vec3(-100, -100, 0), Vec3(200, 0, 0), Vec3(0, 200, 0)),
                       white);
        builder.world(background_program(Rgb(1.0f, 2.0f, 3.0f), 0.5f));
        builder.camera(Vec3(0, 0, 3), Vec3(0), 0.6f, 32, 32);
        SceneDescription description = builder.build();
        description.settings.samples = 128;
        description.film.filter = filter;
        description.film.filter_width = 1.5f;
        const Rendered result = render(std::move(description));
        EXPECT_NEAR(result.mean(0) / 0.35, 1.0, 2e-3);
        EXPECT_NEAR(result.mean(1) / 0.5, 1.0, 2e-3);
        EXPECT_NEAR(result.mean(2) / 0.3, 1.0, 2e-3);
    }
}

// A sky beside a lamp takes no more than its share of the samples: sun and sky add up at low noise.
TEST(ClosedFormStatistics, SkyAndSunShareTheSamples) {
    SceneBuilder builder;
    const auto white = builder.material("white", diffuse_program(Rgb(1.0f)));
    builder.object(quad_mesh("plane", Vec3(-100, -100, 0), Vec3(200, 0, 0), Vec3(0, 200, 0)),
                   white);
    builder.world(background_program(Rgb(1.0f), 0.5f));
    builder.lamp(sun_lamp(look_at(Vec3(0, 0, 5), Vec3(0)), Rgb(3.0f), 0.0f));
    builder.camera(Vec3(0, 0, 3), Vec3(0), 0.6f, 32, 32);
    const Rendered result = render(with_samples(builder, 64));
    EXPECT_NEAR(result.mean(0) / (0.5 + 3.0 / static_cast<double>(kPi)), 1.0, 5e-3);
    EXPECT_LT(result.progress.noise, 0.15);
}

// Light passes a half-transparent pane on its way to the floor, by shadow ray and by chance alike.
TEST(ClosedFormStatistics, TransparentShadow) {
    for (const bool nee : {true, false}) {
        SceneBuilder builder;
        const auto white = builder.material("white", diffuse_program(Rgb(1.0f)));
        const auto pane = builder.material("pane", transparent_program(Rgb(0.25f, 0.5f, 1.0f)));
        builder.object(quad_mesh("floor", Vec3(-100, -100, 0), Vec3(200, 0, 0), Vec3(0, 200, 0)),
                       white);
        builder.object(quad_mesh("pane", Vec3(-500, -500, 1), Vec3(1000, 0, 0), Vec3(0, 1000, 0)),
                       pane);
        builder.world(background_program(Rgb(1.0f), 1.0f));
        builder.camera(Vec3(0, 0, 0.9f), Vec3(0), 0.6f, 24, 24);
        SceneDescription description = with_samples(builder, 256);
        description.settings.use_nee = nee;
        description.settings.max_bounces = 0;
        const Rendered result = render(std::move(description));
        EXPECT_NEAR(result.mean(0) / 0.25, 1.0, 0.01) << nee;
        EXPECT_NEAR(result.mean(1) / 0.5, 1.0, 0.01) << nee;
        EXPECT_NEAR(result.mean(2) / 1.0, 1.0, 0.01) << nee;
    }
}

// A lamp whose nodes emit a colour shines as one of that strength, also where rays meet it by
// chance.
TEST(ClosedFormStatistics, LampsHaveNodes) {
    const auto scene = [](const Rgb& strength) {
        SceneBuilder builder;
        const auto floor = builder.material("floor", diffuse_program(Rgb(0.6f)));
        builder.object(quad_mesh("floor", Vec3(-4, -4, 0), Vec3(8, 0, 0), Vec3(0, 8, 0)), floor);
        builder.lamp(area_lamp(look_at(Vec3(0, 0, 2), Vec3(0.2f, 0, 0)), strength, 2.0f, 1.0f));
        builder.lamp(point_lamp(Vec3(1, 0, 1), strength, 0.1f));
        builder.camera(Vec3(0, -3, 2), Vec3(0), 0.8f, 16, 12);
        return with_samples(builder, 64);
    };
    const Rgb color(0.5f, 0.25f, 2.0f);
    const Rendered plain = render(scene(color * 10.0f));
    SceneDescription description = scene(Rgb(10.0f));
    description.light_programs = {emission_program(color * 0.5f, 2.0f)};
    for (LightDescription& light : description.lights) {
        light.program = 0;
    }
    const Rendered by_nodes = render(std::move(description));
    for (std::size_t channel = 0; channel < 3; ++channel) {
        EXPECT_GT(plain.mean(channel), 0.01);
        EXPECT_NEAR(by_nodes.mean(channel) / plain.mean(channel), 1.0, 0.01);
    }
}

}  // namespace
}  // namespace pharos
