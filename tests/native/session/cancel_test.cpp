// Cancelled at random moments: of building scenes whose parts take long, of passes, of training.
// The end comes soon, and the next render is right. Few moments usually, 200 in tests/stress.
#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "image/image_io.h"
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

// From the wish to end until nothing is left of the session: what a host waits for. Of the wall
// clock and the CPU time of the process the smaller: what other programs took does not count.
double cancelled_after(const SceneDescription& d, double seconds) {
    std::optional<RenderSession> session(std::in_place, d, thread_count());
    static_cast<void>(session->wait(std::chrono::milliseconds(static_cast<long>(1e3 * seconds))));
    const Stopwatch since_cancel;
    session->cancel();
    EXPECT_TRUE(session->wait(std::chrono::milliseconds(60000)));
    EXPECT_EQ(session->progress().state, SessionState::Cancelled);
    session.reset();
    return since_cancel.seconds();
}

void expect_soon(const std::string& what, std::vector<double> seconds) {
    std::ranges::sort(seconds);
    const double p95 = seconds[seconds.size() * 95 / 100];
    say_stress((what + ": p95 seconds").c_str(), seconds.size(), p95, 0.25);
    say_stress((what + ": worst seconds").c_str(), seconds.size(), seconds.back(), 1.0);
    EXPECT_LE(seconds.back(), 10.0) << "on any machine";
}

TEST(Cancel, AtRandomMoments) {
    const std::uint64_t count = case_count(20, 200);
    Random random(6);
    std::vector<double> seconds;
    SceneDescription d = two_rooms(512, 384, 1u << 20);
    d.settings.guiding = GuidingMode::Neural;
    for (int i = 0; i < 40; ++i) {
        d.meshes.push_back(sphere_mesh("ball", random.uniform3(), 0.1f, 96));
        d.instances.push_back(d.instances.front());
        d.instances.back().mesh = static_cast<std::uint32_t>(d.meshes.size() - 1);
    }
    for (std::uint64_t i = 0; i < count; ++i) {
        seconds.push_back(cancelled_after(d, random.uniform(0.0f, i % 2 == 0 ? 0.06f : 0.9f)));
    }
    expect_soon("cancel at random moments", seconds);
    SceneDescription next = two_rooms(32, 24, 4);
    EXPECT_EQ(render(next, 2).combined, render(next, 1).combined);
}

SceneBuilder floor_and_camera() {
    SceneBuilder builder;
    const auto grey = builder.material("grey", diffuse_program(Rgb(0.5f)));
    builder.object(box_mesh("floor", Vec3(-20, -20, -1), Vec3(20, 20, 0)), grey);
    builder.lamp(point_lamp(Vec3(0, 0, 8), Rgb(500.0f), 0.1f));
    builder.camera(Vec3(0, -12, 6), Vec3(0, 0, 0), 1.0f, 16, 12);
    builder.settings().samples = 1;
    return builder;
}

Vec3 place(Random& random) {
    return Vec3(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0.1f, 5));
}

SceneDescription many_lamps() {
    SceneBuilder builder = floor_and_camera();
    Random random(1);
    for (std::uint64_t i = case_count(50000, 1000000); i > 0; --i) {
        builder.lamp(point_lamp(place(random), Rgb(1e-3f), 1e-4f));
    }
    return builder.build();
}

Mesh fine_ball() {
    const auto rings = static_cast<std::uint32_t>(case_count(200, 1000));
    return sphere_mesh("ball", Vec3(0, 0, 2), 1.5f, rings, rings);
}

SceneDescription many_emissive_triangles() {
    SceneBuilder builder = floor_and_camera();
    const auto glow = builder.material("glow", diffuse_emission_program(Rgb(0.5f), Rgb(1.0f)));
    builder.object(fine_ball(), glow);
    return builder.build();
}

SceneDescription many_displaced_vertices() {
    SceneBuilder builder = floor_and_camera();
    const auto moving = builder.material("moving", diffuse_program(Rgb(0.5f)));
    ProgramBuilder by;
    by.closure(NodeOpCode::AovValue, 0, {by.scalar(0.1f)});
    builder.description().materials[moving].displacement = by.build();
    builder.object(fine_ball(), moving);
    return builder.build();
}

SceneDescription many_objects_and_materials() {
    SceneBuilder builder = floor_and_camera();
    const std::uint32_t mesh = builder.mesh(box_mesh("box", Vec3(-0.1f), Vec3(0.1f)));
    Random random(2);
    const std::uint64_t count = case_count(10000, 200000);
    for (std::uint64_t i = 0; i < count; ++i) {
        Mat4 m(1.0f);
        m[3] = Vec4(place(random), 1.0f);
        const auto material = static_cast<std::uint32_t>(
            i % 10 == 0 ? builder.material("any", glossy_program(random.uniform3(), 0.3f)) : 0u);
        builder.instance(mesh, {material}, m);
    }
    InstanceAttribute values;
    values.values.assign(count, Vec4(0.5f));
    builder.description().instance_attributes.assign(8, values);
    return builder.build();
}

// All of them are asked for by a material each.
SceneDescription textured(std::vector<ImageDescription> images) {
    SceneBuilder builder = floor_and_camera();
    const std::uint32_t mesh = builder.mesh(box_mesh("box", Vec3(-0.1f), Vec3(0.1f)));
    for (ImageDescription& image : images) {
        ImageUse use;
        use.image = builder.image(std::move(image));
        builder.instance(mesh, {builder.material("textured", image_diffuse_program(use))});
    }
    return builder.build();
}

std::vector<float> noise(std::size_t count) {
    Random random(3);
    std::vector<float> values(count);
    for (float& value : values) {
        value = random.uniform();
    }
    return values;
}

SceneDescription many_image_files(const ScratchFolder& folder) {
    const auto side = static_cast<std::uint32_t>(case_count(256, 2048));
    const std::vector<float> pixels = noise(std::size_t{4} * side * side);
    const ExrPass pass{"", "RGBA", pixels};
    EXPECT_EQ(write_exr(folder.file("a.exr"), side, side, std::span(&pass, 1)), "");
    EXPECT_EQ(write_png(folder.file("b.png"), side, side, pixels), "");
    std::vector<ImageDescription> images(16);
    for (std::size_t i = 0; i < images.size(); ++i) {
        images[i].path = folder.file(i % 2 == 0 ? "a.exr" : "b.png");
    }
    return textured(std::move(images));
}

SceneDescription large_images_and_sky() {
    const auto side = static_cast<std::uint32_t>(case_count(256, 4096));
    std::vector<ImageDescription> images(2);
    for (ImageDescription& image : images) {
        image.width = side;
        image.height = side / 2;
        image.pixels = noise(std::size_t{4} * image.width * image.height);
    }
    SceneDescription d = textured(std::move(images));
    d.world.program = environment_image_program(0, 1.0f);
    return d;
}

// What of a build takes long: each part of it has to listen.
TEST(Cancel, WhileLargeScenesAreBuilt) {
    const ScratchFolder folder;
    const std::uint64_t moments = case_count(3, 34);

    struct Case {
        const char* name;
        SceneDescription (*make)(const ScratchFolder&);
    };

    const Case cases[] = {
        {"lamps", [](const ScratchFolder&) { return many_lamps(); }},
        {"emissive triangles", [](const ScratchFolder&) { return many_emissive_triangles(); }},
        {"displaced vertices", [](const ScratchFolder&) { return many_displaced_vertices(); }},
        {"objects and materials",
         [](const ScratchFolder&) { return many_objects_and_materials(); }},
        {"image files", [](const ScratchFolder& files) { return many_image_files(files); }},
        {"large images, a sky", [](const ScratchFolder&) { return large_images_and_sky(); }},
    };
    Random random(4);
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        SceneDescription d = c.make(folder);
        const Rendered whole = render(d, thread_count());
        ASSERT_EQ(whole.progress.state, SessionState::Finished) << whole.progress.error;
        const double build = whole.statistics.build_seconds;
        std::printf("MEASURED %s: built in %.2f s\n", c.name, build);
        d.settings.samples = 1u << 20;
        std::vector<double> seconds;
        for (std::uint64_t i = 0; i < moments; ++i) {
            const float part =
                (static_cast<float>(i) + random.uniform()) / static_cast<float>(moments);
            seconds.push_back(cancelled_after(d, 1.1 * build * static_cast<double>(part)));
        }
        expect_soon(std::string("cancel while built: ") + c.name, std::move(seconds));
    }
}

}  // namespace
}  // namespace pharos
