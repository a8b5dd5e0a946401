// Scenes of sizes nobody builds on purpose: few of each usually, all of them in tests/stress.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "core/memory.h"
#include "scene/dump.h"
#include "scene/scene.h"
#include "session/memory_estimate.h"
#include "support/random.h"
#include "support/render.h"
#include "support/scratch.h"
#include "support/stress.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;
using test::Random;

void add_floor_and_camera(SceneBuilder& builder,
                          std::uint32_t width = 16,
                          std::uint32_t height = 12) {
    const auto grey = builder.material("grey", diffuse_program(Rgb(0.5f)));
    builder.object(box_mesh("floor", Vec3(-20, -20, -1), Vec3(20, 20, 0)), grey);
    builder.lamp(point_lamp(Vec3(0, 0, 8), Rgb(500.0f), 0.1f));
    builder.camera(Vec3(0, -12, 6), Vec3(0, 0, 0), 1.0f, width, height);
    builder.settings().samples = 2;
    builder.settings().guiding = GuidingMode::Neural;
}

// Renders, and says how long all of it took.
void expect_picture(const char* what, std::uint64_t count, SceneDescription d) {
    const Stopwatch since_start;
    const Rendered result = render(std::move(d), 2);
    const double seconds = since_start.seconds();
    ASSERT_EQ(result.progress.state, SessionState::Finished) << result.progress.error;
    EXPECT_EQ(result.progress.nonfinite_samples, 0u);
    EXPECT_TRUE(std::isfinite(result.mean(0)));
    EXPECT_GT(result.mean(0), 0.0);
    say_stress((std::string(what) + ": seconds to a picture").c_str(), count, seconds, 120.0);
}

TEST(LargeScenes, ManyInstances) {
    const std::uint64_t count = case_count(5000, 100000);
    SceneBuilder builder;
    add_floor_and_camera(builder);
    const auto red = builder.material("red", diffuse_program(Rgb(0.8f, 0.1f, 0.1f)));
    const std::uint32_t mesh = builder.mesh(box_mesh("box", Vec3(-0.1f), Vec3(0.1f)));
    Random random(1);
    for (std::uint64_t i = 0; i < count; ++i) {
        Mat4 m(1.0f);
        m[3] = Vec4(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0, 3), 1);
        builder.instance(mesh, {red}, m);
    }
    expect_picture("instances", count, builder.build());
}

TEST(LargeScenes, ManyTinyLights) {
    const std::uint64_t count = case_count(20000, 1000000);
    SceneBuilder builder;
    add_floor_and_camera(builder);
    Random random(2);
    for (std::uint64_t i = 0; i < count; ++i) {
        builder.lamp(
            point_lamp(Vec3(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0.1f, 5)),
                       Rgb(1e-3f),
                       1e-4f));
    }
    expect_picture("tiny lights", count, builder.build());
}

TEST(LargeScenes, ManyMaterials) {
    const std::uint64_t count = case_count(1000, 10000);
    SceneBuilder builder;
    add_floor_and_camera(builder);
    const std::uint32_t mesh = builder.mesh(box_mesh("box", Vec3(-0.1f), Vec3(0.1f)));
    Random random(3);
    for (std::uint64_t i = 0; i < count; ++i) {
        Mat4 m(1.0f);
        m[3] = Vec4(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0, 3), 1);
        const auto material = builder.material(std::to_string(i),
                                               glossy_program(random.uniform3(), random.uniform()));
        builder.instance(mesh, {material}, m);
    }
    expect_picture("materials", count, builder.build());
}

TEST(LargeScenes, ManyImages) {
    const std::uint64_t count = case_count(100, 1000);
    SceneBuilder builder;
    add_floor_and_camera(builder);
    const std::uint32_t mesh = builder.mesh(box_mesh("box", Vec3(-0.1f), Vec3(0.1f)));
    Random random(4);
    for (std::uint64_t i = 0; i < count; ++i) {
        ImageDescription image;
        image.name = std::to_string(i);
        image.width = image.height = 32;
        image.pixels.assign(32 * 32 * 4, random.uniform());
        ImageUse use;
        use.image = builder.image(std::move(image));
        Mat4 m(1.0f);
        m[3] = Vec4(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0, 3), 1);
        const auto material = builder.material(std::to_string(i), image_diffuse_program(use));
        builder.instance(mesh, {material}, m);
    }
    expect_picture("images", count, builder.build());
}

// Mesh and structure of smooth triangles with texture coordinates, single and shared.
TEST(LargeScenes, BytesOfATriangle) {
    const auto rings = static_cast<std::uint32_t>(case_count(708, 708));
    for (const std::uint32_t users : {1u, 2u}) {
        SceneBuilder builder;
        add_floor_and_camera(builder);
        Mesh ball = sphere_mesh("ball", Vec3(0, 0, 2), 1.0f, rings, rings);
        ball.uv_maps.push_back({"UVMap", std::vector<Vec2>(3 * ball.triangles.size(), Vec2(0.5f))});
        const std::uint64_t triangles = ball.triangles.size();
        const auto grey = builder.material("grey", diffuse_program(Rgb(0.5f)));
        const std::uint32_t mesh = builder.mesh(std::move(ball));
        for (std::uint32_t user = 0; user < users; ++user) {
            builder.instance(mesh, {grey});
        }
        SceneReport report;
        const auto scene = build_scene(builder.build(), CancelFlag(), report);
        const double bytes = static_cast<double>(scene->bytes()) / static_cast<double>(triangles);
        say_stress(users == 1 ? "bytes of a triangle: mesh and structure"
                              : "bytes of a triangle of a shared mesh: mesh and structure",
                   triangles,
                   bytes,
                   150.0);
        EXPECT_LE(bytes, 150.0);
    }
}

TEST(LargeScenes, SixteenThousandPixelsWide) {
    SceneBuilder builder;
    add_floor_and_camera(builder, 16384, static_cast<std::uint32_t>(case_count(2, 64)));
    expect_picture("pixels in a row", 16384, builder.build());
}

TEST(LargeScenes, BordersOfOnePixel) {
    const std::uint64_t count = case_count(20, 400);
    Random random(5);
    for (std::uint64_t i = 0; i < count; ++i) {
        SceneDescription d = two_rooms(64, 48, 3);
        d.settings.guiding = static_cast<GuidingMode>(i % 3);
        d.film.crop_x = random.index(64);
        d.film.crop_y = random.index(48);
        d.film.crop_width = d.film.crop_height = 1;
        const Rendered result = render(std::move(d), 2);
        ASSERT_EQ(result.progress.state, SessionState::Finished) << result.progress.error;
        ASSERT_EQ(result.progress.nonfinite_samples, 0u);
    }
    say_stress("borders of one pixel: failures", count, 0.0, 0.0);
}

// Film, images and structures of this size exist nowhere: the answer comes before anything is
// asked for, and the next render works.
TEST(Memory, WhatCannotFitIsSaidBeforeItIsBuilt) {
    SceneDescription d = two_rooms(1u << 20, 1u << 20, 1);
    EXPECT_GT(estimate_memory(d), std::uint64_t{1} << 47);
    const auto begin = std::chrono::steady_clock::now();
    const Rendered result = render(std::move(d), 2);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
    EXPECT_EQ(result.progress.state, SessionState::Failed);
    EXPECT_TRUE(result.progress.out_of_memory) << result.progress.error;
    EXPECT_NE(result.progress.error.find("Out of memory"), std::string::npos);
    EXPECT_EQ(render(two_rooms(8, 8, 1), 2).progress.state, SessionState::Finished);
}

TEST(Memory, EstimateIsNotOverTheTruth) {
    SceneDescription d = two_rooms(256, 256, 1);
    const std::uint64_t estimate = estimate_memory(d);
    const Rendered result = render(std::move(d), 2);
    EXPECT_LE(estimate, result.progress.memory_bytes);
    EXPECT_GE(estimate, result.progress.memory_bytes / 4);
    EXPECT_GT(available_memory(), std::uint64_t{1} << 20);
}

// Scripts that need a scene without Blender ask for this one: PHAROS_WRITE_DUMP names the file, and
// PHAROS_DUMP_RINGS adds a ball of twice its square in triangles, PHAROS_DUMP_IMAGE a texture.
TEST(Scripts, TakeADumpFromHere) {
    const ScratchFolder folder;
    const char* wanted = std::getenv("PHAROS_WRITE_DUMP");
    const std::string path = wanted != nullptr ? wanted : folder.file("scene.pharos");
    SceneDescription d = two_rooms(96, 72, 8);
    if (const char* rings = std::getenv("PHAROS_DUMP_RINGS"); rings != nullptr) {
        const auto count = static_cast<std::uint32_t>(std::atoi(rings));
        d.meshes.push_back(sphere_mesh("ball", Vec3(0, -1, 1), 0.2f, count, count));
        d.instances.push_back(d.instances.back());
        d.instances.back().mesh = static_cast<std::uint32_t>(d.meshes.size() - 1);
    }
    if (const char* image = std::getenv("PHAROS_DUMP_IMAGE"); image != nullptr) {
        d.images.emplace_back().path = image;
        ImageUse use;
        use.image = 0;
        d.materials[0].program = image_diffuse_program(use);
    }
    write_dump(d, path);
    EXPECT_EQ(read_dump(path).instances.size(), d.instances.size());
}

}  // namespace
}  // namespace pharos
