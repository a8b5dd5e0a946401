// A picture too small to learn from is that of no guide at all; where what would be learned is
// wanted, it learns.
#include <gtest/gtest.h>

#include "support/render.h"
#include "support/scratch.h"
#include "support/test_scenes.h"

namespace pharos::testing {
namespace {

constexpr std::uint32_t kWidth = 32;
constexpr std::uint32_t kHeight = 24;
constexpr std::uint32_t kSamples = 16;
constexpr std::uint64_t kAll = std::uint64_t{kWidth} * kHeight * kSamples;

SceneDescription rooms(GuidingMode mode = GuidingMode::Neural, std::uint32_t samples = kSamples) {
    SceneDescription d = two_rooms(kWidth, kHeight, samples);
    d.settings.guiding = mode;
    return d;
}

SessionOptions guided_from(std::uint64_t samples) {
    SessionOptions options;
    options.least_guided_samples = samples;
    return options;
}

TEST(Brief, SmallPictureIsThatOfNoGuide) {
    const Rendered brief = render(rooms(), guided_from(kAll + 1));
    EXPECT_EQ(brief.combined, render(rooms(GuidingMode::Off)).combined);
    EXPECT_EQ(guide_state(brief.progress.guiding), GuideState::Brief);
    EXPECT_EQ(why_unguided(GuideState::Brief), "off: too few samples to learn from");
    EXPECT_EQ(brief.items("train"), 0u);
    EXPECT_EQ(brief.items("record_radiance"), 0u);
}

TEST(Brief, OneSampleMoreAndItLearns) {
    const Rendered learning = render(rooms(), guided_from(kAll));
    EXPECT_EQ(learning.combined, render(rooms()).combined);
    EXPECT_GT(learning.progress.guiding.snapshots, 0u);
}

// Light that is easy to find takes more samples until learning pays: that of a box that glows does.
TEST(Brief, QuietPictureIsLeftAloneForLonger) {
    const auto glowing = [](GuidingMode mode) {
        SceneDescription d = emitting_box(kWidth, kHeight);
        d.settings.samples = kSamples;
        d.settings.guiding = mode;
        return d;
    };
    const Rendered brief = render(glowing(GuidingMode::Neural), guided_from(kAll));
    EXPECT_EQ(guide_state(brief.progress.guiding), GuideState::Brief);
    EXPECT_EQ(brief.items("train"), 0u);
    EXPECT_EQ(brief.combined, render(glowing(GuidingMode::Off)).combined);
    const Rendered learning =
        render(glowing(GuidingMode::Neural), guided_from(kAll / kQuietSamplesFactor));
    EXPECT_GT(learning.items("train"), 0u);
}

// What its first sample showed is in its checkpoint.
TEST(Brief, QuietPictureStaysQuietWhenItGoesOn) {
    const ScratchFolder folder;
    SceneDescription d = emitting_box(kWidth, kHeight);
    d.settings.guiding = GuidingMode::Neural;
    d.settings.samples = 4;
    SessionOptions options = guided_from(kAll);
    options.checkpoint.path = folder.file("checkpoint");
    const Rendered begun = render(SceneDescription(d), options);
    EXPECT_EQ(guide_state(begun.progress.guiding), GuideState::Brief);
    d.settings.samples = kSamples;
    options.checkpoint.resume = Resume::Must;
    const Rendered resumed = render(SceneDescription(d), options);
    EXPECT_EQ(resumed.progress.samples, kSamples) << resumed.progress.error;
    EXPECT_EQ(resumed.items("train"), 0u);
    d.settings.guiding = GuidingMode::Off;
    EXPECT_EQ(resumed.combined, render(std::move(d)).combined);
}

TEST(Brief, GuidePassesAreLearnedFor) {
    SceneDescription d = rooms();
    d.passes.wanted |= pass_bit(FilmPass::GuideDirection);
    EXPECT_GT(render(std::move(d), guided_from(kAll + 1)).progress.guiding.snapshots, 0u);
}

// SLIDES guides whether it pays or not.
TEST(Brief, SlidesAreAsTheyAre) {
    const Rendered slides = render(rooms(GuidingMode::Slides), guided_from(kAll + 1));
    EXPECT_EQ(slides.combined, render(rooms(GuidingMode::Slides)).combined);
    EXPECT_GT(slides.progress.guiding.snapshots, 0u);
}

TEST(Brief, GoesOnToAPictureThatIsNone) {
    const ScratchFolder folder;
    SessionOptions options = guided_from(kAll + 1);
    options.checkpoint.path = folder.file("checkpoint");
    ASSERT_EQ(render(rooms(), options).progress.guiding.snapshots, 0u);
    options.checkpoint.resume = Resume::Must;
    const Rendered longer = render(rooms(GuidingMode::Neural, 4 * kSamples), options);
    EXPECT_EQ(longer.progress.samples, 4 * kSamples) << longer.progress.error;
    EXPECT_GT(longer.progress.guiding.snapshots, 0u);
}

}  // namespace
}  // namespace pharos::testing
