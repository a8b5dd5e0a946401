#include "film/film.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "support/stress.h"

namespace pharos {
namespace {

FilmDescription frame(std::uint32_t width, std::uint32_t height) {
    FilmDescription description;
    description.width = description.crop_width = width;
    description.height = description.crop_height = height;
    return description;
}

// A million samples a pixel add up without drift: the sums are double.
TEST(Film, AMillionSamplesAccumulateExactly) {
    Film film(frame(1, 1));
    std::mt19937 random(1);
    std::exponential_distribution<double> radiance(3.0);
    long double exact = 0.0L;
    constexpr int kSamples = 1000000;
    for (int i = 0; i < kSamples; ++i) {
        const auto value = static_cast<float>(radiance(random));
        exact += static_cast<long double>(value);
        film.add(0, {.radiance = Rgb(value)}, 1.0, i % 2 == 0);
    }
    std::vector<float> pixel(4);
    film.read(FilmPass::Combined, pixel);
    const auto mean = static_cast<double>(exact / kSamples);
    const double error = std::abs(static_cast<double>(pixel[0]) / mean - 1.0);
    EXPECT_LE(error, 1e-6);
    testing::say_stress("film: relative error of a million samples", kSamples, error, 1e-6);
    EXPECT_FLOAT_EQ(pixel[3], 1.0f);
}

TEST(Film, WeightsCombineAsStated) {
    Film film(frame(2, 1));
    film.add(0, {.radiance = Rgb(1.0f)}, 0.25, true);
    film.add(0, {.radiance = Rgb(3.0f)}, 0.75, false);
    std::vector<float> pixels(8);
    film.read(FilmPass::Combined, pixels);
    EXPECT_FLOAT_EQ(pixels[0], 2.5f);
    EXPECT_FLOAT_EQ(pixels[4], 0.0f);  // no sample yet
    std::vector<float> count(2);
    film.read(FilmPass::SampleCount, count);
    EXPECT_EQ(count, (std::vector<float>{2.0f, 0.0f}));
}

TEST(Film, ExposureScalesLightAndNothingElse) {
    FilmDescription description = frame(1, 1);
    description.exposure = 4.0f;
    Film film(description);
    film.add(0,
             {.radiance = Rgb(0.5f), .normal = Vec3(0, 0, 1), .albedo = Rgb(0.2f), .depth = 7.0f},
             1.0,
             true);
    std::vector<float> combined(4);
    std::vector<float> depth(1);
    std::vector<float> albedo(3);
    film.read(FilmPass::Combined, combined);
    film.read(FilmPass::Depth, depth);
    film.read(FilmPass::DenoisingAlbedo, albedo);
    EXPECT_FLOAT_EQ(combined[0], 2.0f);
    EXPECT_FLOAT_EQ(combined[3], 1.0f);
    EXPECT_FLOAT_EQ(depth[0], 7.0f);
    EXPECT_FLOAT_EQ(albedo[0], 0.2f);
}

// Light near what a float holds, exposed: the most that it holds, not infinity.
TEST(Film, ExposureDoesNotOverflow) {
    FilmDescription description = frame(1, 1);
    description.exposure = 1e10f;
    Film film(description);
    film.add(0, {.radiance = Rgb(3e38f, 1.0f, -3e38f)}, 1.0, true);
    std::vector<float> combined(4);
    film.read(FilmPass::Combined, combined);
    EXPECT_EQ(combined[0], std::numeric_limits<float>::max());
    EXPECT_EQ(combined[1], 1e10f);
    EXPECT_EQ(combined[2], std::numeric_limits<float>::lowest());
}

TEST(Film, PassesOnRequestTakePlaceOnlyWhenWanted) {
    EXPECT_EQ(PassLayout().size(), 0u);
    EXPECT_EQ(PassLayout(pass_bit(FilmPass::Combined) | pass_bit(FilmPass::Count)).size(), 0u);
    const PassLayout layout(pass_bit(FilmPass::Uv) | pass_bit(FilmPass::Position) |
                            pass_bit(FilmPass::GuideKappa));
    EXPECT_EQ(layout.sample_size(), 6u);
    EXPECT_EQ(layout.size(), 7u);
    EXPECT_TRUE(layout.wants(FilmPass::GuideKappa));
    EXPECT_FALSE(layout.wants(FilmPass::Mist));
    EXPECT_FALSE(Film(frame(1, 1), layout).has(FilmPass::Mist));
}

TEST(Film, PassesOnRequestAreMeansOrOfTheFirstSample) {
    FilmDescription description = frame(1, 1);
    description.exposure = 2.0f;
    const PassLayout layout(pass_bit(FilmPass::Emission) | pass_bit(FilmPass::ObjectIndex) |
                            pass_bit(FilmPass::Mist) | pass_bit(FilmPass::GuideShare));
    Film film(description, layout);
    std::vector<float> values(layout.sample_size());
    for (const float x : {1.0f, 3.0f}) {
        values[layout.offset(FilmPass::Emission)] = x;
        values[layout.offset(FilmPass::ObjectIndex)] = x;
        values[layout.offset(FilmPass::Mist)] = 0.1f * x;
        film.add_passes(0, values, static_cast<double>(x));
        film.add(0, {}, static_cast<double>(x), true);
    }
    film.set_pass(FilmPass::GuideShare, 0, std::vector<float>{0.5f});
    const auto value = [&](FilmPass pass) {
        std::vector<float> out(static_cast<std::size_t>(film_pass_channels(pass)));
        film.read(pass, out);
        return out[0];
    };
    EXPECT_FLOAT_EQ(value(FilmPass::Emission), 2.0f * (1.0f + 9.0f) / 4.0f);
    EXPECT_EQ(value(FilmPass::ObjectIndex), 1.0f);
    EXPECT_FLOAT_EQ(value(FilmPass::Mist), 1.0f - 0.25f);
    EXPECT_EQ(value(FilmPass::GuideShare), 0.5f);
    film.clear();
    EXPECT_EQ(value(FilmPass::Mist), 1.0f);
    EXPECT_EQ(value(FilmPass::GuideShare), 0.0f);
}

// The noise estimate follows the true error of the mean.
TEST(Film, NoiseEstimateIsTheStandardError) {
    constexpr int kPixels = 4000;
    constexpr int kSamples = 64;
    Film film(frame(kPixels, 1));
    EXPECT_EQ(film.noise(), 1.0);
    std::mt19937 random(2);
    std::normal_distribution<float> radiance(1.0f, 0.5f);
    for (int i = 0; i < kSamples; ++i) {
        for (std::uint32_t p = 0; p < kPixels; ++p) {
            film.add(p, {.radiance = Rgb(radiance(random))}, 1.0, i % 2 == 0);
        }
    }
    EXPECT_NEAR(film.noise(), 0.5 / std::sqrt(kSamples), 0.003);
    film.clear();
    EXPECT_EQ(film.noise(), 1.0);
}

}  // namespace
}  // namespace pharos
