#include "session/render_session.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include <gtest/gtest.h>

#include "session/pass_schedule.h"
#include "support/description_builders.h"
#include "support/render.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

// A room with a lamp, a glossy and a glass ball: every stage but textures has work.
SceneDescription room(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
    SceneBuilder builder;
    const auto white = builder.material("white", diffuse_program(Rgb(0.8f)));
    const auto gloss = builder.material("gloss", glossy_program(Rgb(0.9f, 0.7f, 0.4f), 0.3f));
    const auto glass = builder.material("glass", glass_program(Rgb(1.0f), 0.0f, 1.5f));
    builder.object(box_mesh("room", Vec3(-2, -2, 0), Vec3(2, 2, 3), true), white);
    builder.object(sphere_mesh("gloss", Vec3(-0.8f, 0.3f, 0.6f), 0.6f), gloss);
    builder.object(sphere_mesh("glass", Vec3(0.8f, -0.2f, 0.5f), 0.5f), glass);
    builder.lamp(area_lamp(look_at(Vec3(0, 0, 2.9f), Vec3(0)), Rgb(60.0f), 0.7f, 0.4f));
    builder.camera(Vec3(0, -1.9f, 1.4f), Vec3(0, 0, 1), 0.8f, width, height);
    SceneDescription description = builder.build();
    description.settings.samples = samples;
    return description;
}

TEST(PassSchedule, CoversEverySampleOnce) {
    for (const std::uint64_t pixels : {1ull, 4096ull, 65536ull, 8294400ull}) {
        std::uint32_t done = 0;
        while (done < 1000) {
            const PassSettings pass = next_pass(done, 1000, pixels);
            ASSERT_EQ(pass.first_sample, done);
            ASSERT_GE(pass.samples, 1u);
            ASSERT_TRUE(pass.samples == 1 || pass.samples * pixels <= kPathsPerPass);
            done += pass.samples;
        }
        EXPECT_EQ(done, 1000u);
        EXPECT_EQ(next_pass(0, 1000, pixels).samples, 1u);
    }
}

TEST(RenderSession, IsBitEqualForAnyNumberOfThreads) {
    const Rendered one = render(room(61, 47, 8), 1);
    ASSERT_EQ(one.progress.state, SessionState::Finished);
    ASSERT_GT(one.mean(0), 0.01);
    for (unsigned threads : {2u, 8u}) {
        const Rendered other = render(room(61, 47, 8), threads);
        ASSERT_EQ(one.combined.size(), other.combined.size());
        EXPECT_EQ(
            0,
            std::memcmp(
                one.combined.data(), other.combined.data(), one.combined.size() * sizeof(float)));
    }
}

TEST(RenderSessionStatistics, SeedsDifferAndAgreeInTheMean) {
    SceneDescription first = room(40, 30, 64);
    SceneDescription second = first;
    second.settings.seed = 7;
    const Rendered a = render(std::move(first));
    const Rendered b = render(std::move(second));
    EXPECT_NE(a.combined, b.combined);
    EXPECT_NEAR(a.mean(0) / b.mean(0), 1.0, 0.02);
}

// A border renders the very pixels of the full frame.
TEST(RenderSession, BorderEqualsTheFullFrame) {
    SceneDescription full = room(40, 30, 4);
    SceneDescription border = full;
    border.film.crop_x = 11;
    border.film.crop_y = 5;
    border.film.crop_width = 17;
    border.film.crop_height = 9;
    const Rendered whole = render(std::move(full));
    const Rendered part = render(std::move(border));
    for (std::size_t y = 0; y < 9; ++y) {
        for (std::size_t x = 0; x < 17 * 4; ++x) {
            EXPECT_EQ(part.combined[y * 17 * 4 + x], whole.combined[(y + 5) * 40 * 4 + 11 * 4 + x]);
        }
    }
}

TEST(RenderSessionStatistics, NeeAndPlainPathTracingAgree) {
    SceneDescription with = room(32, 24, 256);
    SceneDescription without = with;
    without.settings.use_nee = false;
    without.settings.samples = 1024;
    const Rendered a = render(std::move(with));
    const Rendered b = render(std::move(without));
    EXPECT_EQ(b.items("sample_direct_light"), 0u);
    EXPECT_EQ(b.items("trace_shadow_rays"), 0u);
    EXPECT_NEAR(a.mean(1) / b.mean(1), 1.0, 0.03);
}

// What the room does not need: its light is a lamp, its materials are opaque and of one colour
// each.
constexpr const char* kNotInTheRoom[] = {"add_escaped_radiance",
                                         "add_emitted_radiance",
                                         "evaluate_textures",
                                         "transmit_shadow_rays",
                                         "query_guiding_field",
                                         "train"};

TEST(RenderSession, SkippedStagesCountNothing) {
    const Rendered result = render(room(32, 24, 2));
    for (const char* const stage : kNotInTheRoom) {
        EXPECT_EQ(result.items(stage), 0u) << stage;
    }
    EXPECT_EQ(result.items("generate_camera_rays"), 32u * 24u * 2u);
    EXPECT_GT(result.items("add_lamp_radiance"), 0u);
}

// A floor with an image, lit through a pane: a look-up for each camera ray, since no other path
// comes back to the floor, and shadow rays pass the pane.
TEST(RenderSession, TexturesAndTransmissionAreStages) {
    SceneBuilder b;
    ImageDescription picture;
    picture.width = picture.height = 2;
    picture.pixels.assign(4 * 4, 0.5f);
    const auto floor =
        b.material("floor", image_diffuse_program({.image = b.image(std::move(picture))}));
    const auto pane = b.material("pane", transparent_program(Rgb(0.5f)));
    b.object(quad_mesh("floor", Vec3(-9, -9, 0), Vec3(18, 0, 0), Vec3(0, 18, 0)), floor);
    b.object(quad_mesh("pane", Vec3(-9, -9, 2), Vec3(18, 0, 0), Vec3(0, 18, 0)), pane);
    b.lamp(area_lamp(look_at(Vec3(0, 0, 3), Vec3(0)), Rgb(60.0f), 0.7f, 0.4f));
    b.camera(Vec3(0, -1, 1), Vec3(0), 0.8f, 32, 24);
    b.settings().samples = 8;
    const Rendered result = render(b.build());
    EXPECT_EQ(result.items("evaluate_textures"), 32u * 24u * 8u);
    EXPECT_GT(result.items("transmit_shadow_rays"), 0u);
    EXPECT_LE(result.items("transmit_shadow_rays"), result.items("trace_shadow_rays"));
    for (const StageStatistics& stage : result.statistics.stages) {
        EXPECT_GE(stage.seconds, 0.0) << stage.name;
        EXPECT_LT(stage.seconds, 60.0) << stage.name;  // times inside each other: none below zero
    }
}

// Share of all stages' time that went to those named, in percent; none of them may have items.
double percent_of_time(const Rendered& result, std::span<const char* const> skipped) {
    double all = 0.0;
    double share = 0.0;
    for (const StageStatistics& stage : result.statistics.stages) {
        all += stage.seconds;
        if (std::ranges::find(skipped, stage.name) != skipped.end()) {
            share += stage.seconds;
            EXPECT_EQ(stage.items, 0u) << stage.name;
        }
    }
    return 100.0 * share / all;
}

TEST(RenderSessionStatistics, SkippedStagesTakeNoTime) {
    SceneBuilder sky;
    const auto white = sky.material("white", diffuse_program(Rgb(0.8f)));
    sky.object(box_mesh("box", Vec3(-1), Vec3(1)), white);
    sky.world(background_program(Rgb(1.0f), 1.0f));
    sky.camera(Vec3(0, -4, 0), Vec3(0), 0.8f, 64, 48);
    SceneDescription without_lamps = sky.build();
    without_lamps.settings.samples = 64;
    SceneDescription without_world = room(64, 48, 64);
    SceneDescription without_nee = without_world;
    without_nee.settings.use_nee = false;
    const char* const of_plain_paths[] = {"sample_direct_light", "trace_shadow_rays"};
    const char* const of_sky[] = {"add_lamp_radiance", "add_emitted_radiance"};
    const auto percent = [](const SceneDescription& d, std::span<const char* const> skipped) {
        return least_of(0.5, [&] { return percent_of_time(render(d), skipped); });
    };
    EXPECT_LT(percent(without_world, kNotInTheRoom), 0.5);
    EXPECT_LT(percent(without_nee, of_plain_paths), 0.5);
    EXPECT_LT(percent(without_lamps, of_sky), 0.5);
}

TEST(RenderSession, CancelKeepsThePicture) {
    constexpr double kBar = 1.0 * kSlowdown;
    const double seconds = least_of(kBar, [] {
        RenderSession session(room(256, 256, 100000), 2);
        while (session.progress().samples < 2) {
            EXPECT_FALSE(session.wait(std::chrono::milliseconds(5)));
        }
        const Stopwatch since_cancel;
        session.cancel();
        EXPECT_TRUE(session.wait(std::chrono::seconds(60)));
        const double elapsed = since_cancel.seconds();
        EXPECT_EQ(session.progress().state, SessionState::Cancelled);
        std::vector<float> count(256 * 256);
        EXPECT_TRUE(session.read(FilmPass::SampleCount, count));
        EXPECT_GE(*std::min_element(count.begin(), count.end()), 2.0f);
        return elapsed;
    });
    EXPECT_LT(seconds, kBar);
}

TEST(RenderSession, TimeLimitStopsAndDelivers) {
    constexpr double kBar = 3.0 * kSlowdown;
    const double seconds = least_of(kBar, [] {
        SceneDescription description = room(128, 128, 1000000);
        description.settings.time_limit = 0.3f;
        const Stopwatch since_start;
        const Rendered result = render(std::move(description));
        const double elapsed = since_start.seconds();
        EXPECT_EQ(result.progress.state, SessionState::Finished);
        EXPECT_LT(result.progress.samples, 1000000u);
        EXPECT_GT(result.mean(0), 0.01);
        return elapsed;
    });
    EXPECT_LT(seconds, kBar);
}

// Found by fuzz_scene: as nanoseconds they are no 64-bit number, and the deadline was in the past.
TEST(RenderSession, TimeLimitsBeyondTheClockAreNone) {
    for (const float limit : {1e10f, 1.76805e34f, std::numeric_limits<float>::infinity()}) {
        SceneDescription description = room(8, 8, 6);
        description.settings.time_limit = limit;
        SessionOptions options;
        options.threads = 1;
        options.pass_samples = 1;
        RenderSession session(std::move(description), options);
        ASSERT_TRUE(session.wait(std::chrono::seconds(60)));
        EXPECT_EQ(session.progress().state, SessionState::Finished);
        EXPECT_EQ(session.progress().samples, 6u) << limit;
    }
}

TEST(RenderSession, PassesAreNoLongerThanAsked) {
    SceneDescription description = room(24, 16, 16);
    description.settings.guiding = GuidingMode::Slides;
    SessionOptions options;
    options.threads = 2;
    options.pass_samples = 1;
    options.snapshot_samples = {3, 7, 11, 13};
    RenderSession session(std::move(description), options);
    ASSERT_TRUE(session.wait(std::chrono::minutes(4)));
    const auto snapshots = session.snapshots();
    ASSERT_EQ(snapshots.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(snapshots[i].samples, options.snapshot_samples[i]);
    }
    EXPECT_GE(snapshots[3].wall_seconds, snapshots[0].wall_seconds);
    EXPECT_GE(session.progress().guiding.snapshots, 10u);  // it has learned after every sample
}

TEST(RenderSession, SnapshotsAreShorterRenders) {
    SceneDescription description = room(24, 16, 16);
    SessionOptions options;
    options.threads = 2;
    options.snapshot_samples = {16, 4};
    RenderSession session(description, options);
    ASSERT_TRUE(session.wait(std::chrono::minutes(4)));
    const auto snapshots = session.snapshots();
    ASSERT_EQ(snapshots.size(), 2u);
    EXPECT_EQ(snapshots[0].samples, 4u);
    description.settings.samples = 4;
    EXPECT_EQ(snapshots[0].combined, render(std::move(description)).combined);
    EXPECT_GE(snapshots[1].cpu_seconds, snapshots[0].cpu_seconds);  // clocks may be coarse
}

TEST(RenderSession, ErrorsAreSentences) {
    SceneDescription no_camera = room(8, 8, 1);
    no_camera.has_camera = false;
    const Rendered failed = render(std::move(no_camera));
    EXPECT_EQ(failed.progress.state, SessionState::Failed);
    EXPECT_NE(failed.progress.error.find("camera"), std::string::npos);

    SceneDescription outside = room(8, 8, 1);
    outside.film.crop_x = 5;
    EXPECT_EQ(render(std::move(outside)).progress.state, SessionState::Failed);

    RenderSession session(room(8, 8, 1));
    std::vector<float> wrong(7);
    EXPECT_THROW(session.read(FilmPass::Combined, wrong), std::invalid_argument);
}

TEST(RenderSession, EmptySceneShowsTheWorld) {
    SceneBuilder builder;
    builder.world(background_program(Rgb(0.25f, 0.5f, 1.0f), 2.0f));
    builder.camera(Vec3(0, -4, 0), Vec3(0), 0.8f, 9, 7);
    SceneDescription description = builder.build();
    description.settings.samples = 2;
    const Rendered lit = render(description);
    EXPECT_FLOAT_EQ(lit.combined[0], 0.5f);
    EXPECT_FLOAT_EQ(lit.combined[2], 2.0f);
    EXPECT_FLOAT_EQ(lit.combined[3], 1.0f);
    description.film.transparent = true;
    const Rendered transparent = render(description);
    EXPECT_FLOAT_EQ(transparent.combined[0], 0.0f);
    EXPECT_FLOAT_EQ(transparent.combined[3], 0.0f);
    description.world = {};
    EXPECT_EQ(render(description).progress.state, SessionState::Finished);
}

}  // namespace
}  // namespace pharos
