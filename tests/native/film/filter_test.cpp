// Pixel filters: the distribution of offsets against the analytic windows.

#include "film/filter.h"

#include <gtest/gtest.h>

#include "support/chi_square.h"

namespace pharos {

namespace {

using test::Random;

// Windows over an offset of v pixels, not normalised.
double window(PixelFilter filter, double width, double v) {
    if (filter == PixelFilter::Box) {
        return std::abs(v) < 0.5 ? 1.0 : 0.0;
    }
    if (filter == PixelFilter::Gaussian) {
        const double x = 2.0 * v / width;
        return std::abs(v) < 1.5 * width ? std::exp(-2.0 * x * x) : 0.0;
    }
    const double a = 2.0 * std::numbers::pi * (v / (2.0 * width) + 0.5);
    const double value =
        0.35875 - 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) - 0.01168 * std::cos(3 * a);
    return std::abs(v) < width ? value : 0.0;
}

double integral(PixelFilter filter, double width, double radius) {
    constexpr int kSteps = 20000;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        sum += window(filter, width, ((i + 0.5) / kSteps * 2.0 - 1.0) * radius);
    }
    return sum * 2.0 * radius / kSteps;
}

TEST(Filter, ChiSquareAgainstTheWindow) {
    test::ChiSquareOptions options;
    options.rows = options.columns = 40;
    options.samples = 400000;
    options.tests = 6;
    for (const PixelFilter filter :
         {PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris}) {
        for (const float width : {1.5f, 0.7f}) {
            const FilterSampler sampler(filter, width);
            const double w = static_cast<double>(width);
            const double norm = integral(filter, w, static_cast<double>(sampler.radius()));
            const auto result = test::chi_square_rectangle(
                [&](Random& random) { return std::optional(sampler.sample(random.uniform2())); },
                [&](const Vec2& v) {
                    const double value = window(filter, w, static_cast<double>(v.x)) *
                                         window(filter, w, static_cast<double>(v.y));
                    return static_cast<float>(value / norm / norm);
                },
                Vec2(-sampler.radius()),
                Vec2(sampler.radius()),
                options);
            EXPECT_TRUE(result.passed)
                << static_cast<int>(filter) << " " << width << ": " << result.message;
            EXPECT_NEAR(result.total_mass, 1.0, 1e-3);
        }
    }
}

TEST(Filter, RadiiAndSymmetry) {
    EXPECT_EQ(FilterSampler(PixelFilter::Box, 3.0f).radius(), 0.5f);
    EXPECT_FLOAT_EQ(FilterSampler(PixelFilter::Gaussian, 2.0f).radius(), 3.0f);
    EXPECT_FLOAT_EQ(FilterSampler(PixelFilter::BlackmanHarris, 2.0f).radius(), 2.0f);
    EXPECT_EQ(FilterSampler(PixelFilter::Box, 1.0f).sample(Vec2(0.25f, 0.5f)), Vec2(-0.25f, 0.0f));
    for (const PixelFilter filter : {PixelFilter::Gaussian, PixelFilter::BlackmanHarris}) {
        const FilterSampler sampler(filter, 1.5f);
        EXPECT_NEAR(sampler.sample(Vec2(0.5f)).x, 0.0f, 1e-5f);
        EXPECT_NEAR(
            sampler.sample(Vec2(0.2f, 0.8f)).x + sampler.sample(Vec2(0.2f, 0.8f)).y, 0.0f, 1e-4f);
    }
}

TEST(Filter, BadWidthsStayFinite) {
    for (const float width :
         {0.0f, -1.0f, 1e30f, kInfinity, std::numeric_limits<float>::quiet_NaN()}) {
        for (const PixelFilter filter :
             {PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris}) {
            const FilterSampler sampler(filter, width);
            for (const float u : {0.0f, 0.5f, kOneMinusEpsilon}) {
                const Vec2 v = sampler.sample(Vec2(u));
                EXPECT_LE(std::abs(v.x), sampler.radius());
            }
        }
    }
}

}  // namespace

}  // namespace pharos
