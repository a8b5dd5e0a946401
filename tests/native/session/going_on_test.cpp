// A guide that goes on from an earlier picture: the same light with other noise, nothing where it
// does not fit.
#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include "session/animation.h"
#include "session/field_file.h"
#include "support/render.h"
#include "support/test_scenes.h"
#include "support/welch.h"

namespace pharos::testing {
namespace {

struct Picture {
    std::vector<float> combined;
    std::vector<std::byte> field;
    std::vector<ReportEntry> report;
    GuideStatus guiding;

    [[nodiscard]] double sum() const {
        double sum = 0.0;
        for (std::size_t i = 0; i < combined.size(); i += 4) {
            sum += static_cast<double>(combined[i]);
        }
        return sum;
    }
};

Picture take(SceneDescription description, std::vector<std::byte> field, unsigned threads = 0) {
    SessionOptions options;
    options.threads = threads;
    options.field = std::move(field);
    options.field_learns = true;
    const RenderSession session(std::move(description), std::move(options));
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    EXPECT_EQ(session.progress().state, SessionState::Finished) << session.progress().error;
    Picture picture;
    picture.combined.resize(std::size_t{4} * session.width() * session.height());
    session.read(FilmPass::Combined, picture.combined);
    picture.field = session.field();
    picture.report = session.report();
    picture.guiding = session.progress().guiding;
    return picture;
}

SceneDescription rooms(std::uint32_t samples, GuidingMode mode = GuidingMode::Neural) {
    SceneDescription d = two_rooms(32, 24, samples);
    d.settings.guiding = mode;
    return d;
}

TEST(GoingOn, FirstPictureIsThatOfAnyRender) {
    EXPECT_EQ(take(rooms(8), {}).combined, render(rooms(8)).combined);
}

// From the first sample on, with other samples than those it was made from, and the same for any
// number of threads.
TEST(GoingOn, NextPictureIsGuidedFromItsStart) {
    const Picture first = take(rooms(48), {});
    ASSERT_GT(first.guiding.guided_share, 0.0);
    const Picture next = take(rooms(4), first.field);
    EXPECT_GT(next.guiding.guided_share, 0.0);
    EXPECT_GT(next.guiding.records, first.guiding.records);
    EXPECT_TRUE(next.report.empty());
    EXPECT_NE(next.combined, take(rooms(4), {}).combined);
    EXPECT_EQ(next.combined, take(rooms(4), first.field, 1).combined);
}

TEST(GoingOn, LightStaysTheSame) {
    Moments off;
    Moments going_on;
    std::vector<std::byte> field = take(rooms(32), {}).field;
    for (std::uint32_t seed = 0; seed < 24; ++seed) {
        SceneDescription d = rooms(8);
        d.settings.seed = seed;
        Picture picture = take(d, std::move(field));
        going_on.add(picture.sum());
        field = std::move(picture.field);
        d.settings.seed = 1000 + seed;
        d.settings.guiding = GuidingMode::Off;
        off.add(take(std::move(d), {}).sum());
    }
    EXPECT_LT(std::abs(welch_test(going_on, off).t), 4.0);
}

TEST(GoingOn, WhatDoesNotFitIsSaidAndLearnedAnew) {
    const std::vector<std::byte> field = take(rooms(8), {}).field;
    std::vector<std::byte> damaged = field;
    damaged[damaged.size() / 2] ^= std::byte{1};
    SceneDescription larger = rooms(4);
    for (InstanceDescription& instance : larger.instances) {
        instance.to_world = glm::scale(Mat4(1.0f), Vec3(10.0f)) * instance.to_world;
    }
    const auto expect_said = [](const Picture& picture) {
        ASSERT_EQ(picture.report.size(), 1u);
        EXPECT_NE(picture.report[0].message.find("Learned anew"), std::string::npos);
    };
    expect_said(take(rooms(4), damaged));
    expect_said(take(std::move(larger), field));
    expect_said(take(rooms(4, GuidingMode::Slides), field));
    EXPECT_TRUE(take(rooms(4, GuidingMode::Off), field).report.empty());
}

TEST(GoingOn, AnimationIsMeasured) {
    SceneDescription d = rooms(4);
    AnimationSettings settings;
    settings.offset = Vec3(0.2f, 0.0f, 0.0f);
    settings.frames = 3;
    settings.reference = 64;
    ASSERT_FALSE(d.lights.empty());
    const std::vector<AnimatedFrame> frames = measure_animation(d, settings);
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[0].going_on.error, frames[0].anew.error);
    EXPECT_NE(frames[2].going_on.error, frames[2].anew.error);
    for (const AnimatedFrame& frame : frames) {
        EXPECT_GT(frame.unguided.work(), 0.0);
    }
    settings.lamp = "nowhere";
    EXPECT_THROW(static_cast<void>(measure_animation(d, settings)), std::invalid_argument);
}

}  // namespace
}  // namespace pharos::testing
