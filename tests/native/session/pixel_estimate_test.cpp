// The yardstick of guided roulette keeps edges: dark pixels beside bright ones stay dark.
#include "session/pixel_estimate.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace pharos {
namespace {

constexpr std::uint32_t kSide = 24;

template <class Value>
std::vector<float> estimate_of(std::uint32_t side, float exposure, const Value& value) {
    FilmDescription description;
    description.width = description.crop_width = side;
    description.height = description.crop_height = side;
    description.exposure = exposure;
    Film film(description);
    for (std::uint32_t i = 0; i < side * side; ++i) {
        film.add(i, {.radiance = Rgb(value(i % side, i / side))}, 1.0, true);
    }
    return estimate_pixels(film);
}

TEST(PixelEstimate, BrightEdgeLeavesItsDarkSideAlone) {
    const auto edge = [](std::uint32_t x, std::uint32_t) { return x < kSide / 2 ? 1.0f : 100.0f; };
    const std::vector<float> estimate = estimate_of(kSide, 1.0f, edge);
    for (std::uint32_t y = 0; y < kSide; ++y) {
        // The floor, a tenth of the mean, is 5.05.
        EXPECT_NEAR(estimate[y * kSide + kSide / 2 - 1], 5.05f, 1e-4f) << y;
        // On the bright side it may be too low, by the dark pixel in four that a quadrant sees.
        EXPECT_NEAR(estimate[y * kSide + kSide / 2], 25.75f, 1e-3f) << y;
        EXPECT_NEAR(estimate[y * kSide + kSide / 2 + 3], 100.0f, 1e-3f) << y;
    }
}

TEST(PixelEstimate, NoiseIsAveragedAndOneFireflyStaysLocal) {
    const auto checker = [](std::uint32_t x, std::uint32_t y) {
        return (x + y) % 2 == 0 ? 2.0f : 0.0f;
    };
    for (const float value : estimate_of(kSide, 1.0f, checker)) {
        EXPECT_NEAR(value, 1.0f, 1e-5f);
    }
    const auto firefly = [](std::uint32_t x, std::uint32_t y) {
        return x == 10 && y == 10 ? 100.0f : 1.0f;
    };
    const std::vector<float> estimate = estimate_of(kSide, 1.0f, firefly);
    EXPECT_EQ(std::ranges::count_if(estimate, [](float v) { return v > 1.001f; }), 1);
}

// The window compares with radiance as the paths carry it.
TEST(PixelEstimate, ExposureDoesNotCount) {
    const auto constant = [](std::uint32_t, std::uint32_t) { return 0.5f; };
    for (const float value : estimate_of(kSide, 8.0f, constant)) {
        EXPECT_NEAR(value, 0.5f, 1e-6f);
    }
}

TEST(PixelEstimate, SmallAndBlackPicturesHaveOneToo) {
    const auto constant = [](std::uint32_t, std::uint32_t) { return 3.0f; };
    for (const std::uint32_t side : {1u, 2u, 5u}) {
        for (const float value : estimate_of(side, 1.0f, constant)) {
            EXPECT_NEAR(value, 3.0f, 1e-5f) << side;
        }
    }
    EXPECT_TRUE(
        estimate_of(kSide, 1.0f, [](std::uint32_t, std::uint32_t) { return 0.0f; }).empty());
}

}  // namespace
}  // namespace pharos
