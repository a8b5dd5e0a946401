// Guides that follow a moving lamp: what is measured, and that a kept guide does no harm.
#include "session/adaptation.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "support/test_scenes.h"

namespace pharos {
namespace {

using namespace pharos::testing;

double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(AdaptationStatistics, AKeptGuideDoesNoHarm) {
    AdaptationSettings settings;
    settings.offset = Vec3(0.8f, 0.3f, -0.4f);
    settings.frames = 10;
    settings.learned = 16;
    settings.reference = 64;
    settings.seeds = 1;
    settings.threads = 2;
    const Adaptation result = measure_adaptation(two_rooms(64, 48, 1), settings);
    ASSERT_EQ(result.kept.size(), settings.frames);
    ASSERT_EQ(result.fresh.size(), settings.frames);
    ASSERT_EQ(result.unguided.size(), settings.frames);
    EXPECT_GT(result.settled, 0.0);
    for (const double error : result.kept) {
        EXPECT_TRUE(std::isfinite(error));
    }
    EXPECT_LT(mean(result.kept), 1.1 * mean(result.unguided));
}

TEST(Adaptation, FramesAreCountedToTheFirstTwoInARow) {
    Adaptation result;
    result.settled = 1.0;
    EXPECT_EQ(result.frames_until({3.0, 1.1, 2.0, 1.1, 1.0, 5.0}, 1.2), 3u);
    EXPECT_EQ(result.frames_until({3.0, 1.1, 2.0}, 1.2), 3u);
}

TEST(Adaptation, AnUnknownLampIsNamed) {
    AdaptationSettings settings;
    settings.lamp = "nowhere";
    EXPECT_THROW(static_cast<void>(measure_adaptation(two_rooms(8, 8, 1), settings)),
                 std::invalid_argument);
}

}  // namespace
}  // namespace pharos
