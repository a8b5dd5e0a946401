#include "sampling/sampler.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace pharos {
namespace {

// Owen-scrambled Sobol points of 2^k samples hit every elementary interval of each pair exactly
// once.
TEST(Sampler, FirstTwoDimensionsAreANet) {
    for (std::uint32_t hash : {1u, 77u, 123456u}) {
        for (int log_x = 0; log_x <= 8; ++log_x) {
            std::vector<int> cells(256, 0);
            for (std::uint32_t i = 0; i < 256; ++i) {
                const Vec4 p = sobol_4d(hash, i, 3);
                const int x = static_cast<int>(p.x * static_cast<float>(1 << log_x));
                const int y = static_cast<int>(p.y * static_cast<float>(1 << (8 - log_x)));
                ++cells[static_cast<std::size_t>((x << (8 - log_x)) + y)];
            }
            for (int count : cells) {
                EXPECT_EQ(count, 1);
            }
        }
    }
}

TEST(Sampler, EveryDimensionIsStratified) {
    for (int d = 0; d < 4; ++d) {
        std::vector<int> cells(1024, 0);
        for (std::uint32_t i = 0; i < 1024; ++i) {
            const float u = sobol_4d(42, i, 7)[d];
            ASSERT_GE(u, 0.0f);
            ASSERT_LT(u, 1.0f);
            ++cells[static_cast<std::size_t>(u * 1024.0f)];
        }
        for (int count : cells) {
            EXPECT_EQ(count, 1) << "dimension " << d;
        }
    }
}

// Pairs of dimensions of the same and of different sets integrate a product without correlation.
TEST(Sampler, DimensionsAreUncorrelated) {
    constexpr int kPoints = 4096;
    for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
            double same = 0.0;
            double other = 0.0;
            for (std::uint32_t i = 0; i < kPoints; ++i) {
                const Vec4 p = sobol_4d(9, i, 0);
                const Vec4 q = sobol_4d(9, i, 1);
                same += (static_cast<double>(p[a]) - 0.5) * (static_cast<double>(p[b]) - 0.5);
                other += (static_cast<double>(p[a]) - 0.5) * (static_cast<double>(q[b]) - 0.5);
            }
            if (a != b) {
                EXPECT_NEAR(same / kPoints, 0.0, 0.004) << a << ' ' << b;
            }
            EXPECT_NEAR(other / kPoints, 0.0, 0.006) << a << ' ' << b;
        }
    }
}

// The means over pixels of one sample index are uniform too: neighbours do not share a pattern.
TEST(Sampler, PixelsAreIndependent) {
    double mean = 0.0;
    double product = 0.0;
    for (std::uint32_t x = 0; x < 20000; ++x) {
        const double u = static_cast<double>(sobol_4d(pixel_hash(0, x, 5), 0, 0).x);
        const double v = static_cast<double>(sobol_4d(pixel_hash(0, x + 1, 5), 0, 0).x);
        mean += u;
        product += (u - 0.5) * (v - 0.5);
    }
    EXPECT_NEAR(mean / 20000, 0.5, 0.01);
    EXPECT_NEAR(product / 20000, 0.0, 0.0025);
}

}  // namespace
}  // namespace pharos
