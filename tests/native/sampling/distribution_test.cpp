// Piecewise-constant distributions, the alias table and MIS weights.

#include <limits>

#include <gtest/gtest.h>

#include "sampling/alias_table.h"
#include "sampling/distribution_1d.h"
#include "sampling/distribution_2d.h"
#include "sampling/mis.h"
#include "support/chi_square.h"

namespace pharos {

namespace {

using test::Random;

const float kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<std::vector<float>> weight_cases() {
    std::vector<std::vector<float>> cases = {{1.0f},
                                             {0.0f, 3.0f, 0.0f, 1.0f, 0.0f},
                                             {0.0f, 0.0f, 0.0f},
                                             {kNan, -1.0f, kInfinity, 2.0f, 2.0f},
                                             {1e30f, 1e38f, 3e38f},
                                             {1e-42f, 2e-42f},
                                             {}};
    Random random(1);
    std::vector<float> peaky(1000);
    for (float& w : peaky) {
        w = random.log_uniform(1e-3f, 1e3f);
    }
    cases.push_back(peaky);
    peaky[500] = 1e9f;
    cases.push_back(peaky);
    return cases;
}

// Sampling and density agree exactly, cell by cell, over the grid of random numbers.
TEST(Distribution1D, DensityIsTheShareOfTheUnitInterval) {
    for (const std::vector<float>& weights : weight_cases()) {
        const Distribution1D d(weights);
        double mass = 0.0;
        for (std::uint32_t i = 0; i < d.size(); ++i) {
            mass += static_cast<double>(d.pmf(i));
            ASSERT_GE(d.pmf(i), 0.0f);
        }
        EXPECT_NEAR(mass, 1.0, 1e-6);
        Random random(2);
        for (int i = 0; i < 20000; ++i) {
            const float u = i == 0 ? 0.0f : (i == 1 ? kOneMinusEpsilon : random.uniform());
            const Distribution1D::Sample s = d.sample(u);
            ASSERT_GT(s.pdf, 0.0f);
            ASSERT_TRUE(s.x >= 0.0f && s.x < 1.0f && s.offset >= 0.0f && s.offset < 1.0f);
            ASSERT_FLOAT_EQ(s.pdf, d.pmf(s.cell) * static_cast<float>(d.size()));
        }
    }
}

TEST(Distribution1D, ProportionalToWeights) {
    const Distribution1D d(std::vector<float>{1.0f, 2.0f, 0.0f, 5.0f});
    EXPECT_EQ(d.pdf(0.1f), 0.5f);
    EXPECT_EQ(d.pdf(0.3f), 1.0f);
    EXPECT_EQ(d.pdf(0.6f), 0.0f);
    EXPECT_EQ(d.pdf(0.9f), 2.5f);
    EXPECT_EQ(d.sum(), 8.0);
    const Distribution1D bad(std::vector<float>{kNan, -1.0f, kInfinity, 3.0f});
    EXPECT_EQ(bad.pmf(3), 1.0f);
    const Distribution1D zero(std::vector<float>{0.0f, 0.0f});
    EXPECT_EQ(zero.pmf(0), 0.5f);
}

TEST(Distribution1D, InvertUndoesSample) {
    for (const std::vector<float>& weights : weight_cases()) {
        const Distribution1D d(weights);
        Random random(3);
        for (int i = 0; i < 2000; ++i) {
            const float u = random.uniform();
            const auto s = d.sample(u);
            // A rounding of x costs as much u as the density there.
            ASSERT_NEAR(d.invert(s.x), u, 1e-6f + 2e-7f * s.pdf);
        }
    }
}

TEST(Distribution2D, ChiSquare) {
    std::vector<float> weights(13 * 9, 0.1f);
    Random random(4);
    for (float& w : weights) {
        w = random.index(4) == 0 ? 0.0f : random.log_uniform(0.1f, 30.0f);
    }
    std::fill(weights.begin() + 26, weights.begin() + 39, 0.0f);  // a dark row
    const Distribution2D d(weights, 13, 9);
    test::ChiSquareOptions options;
    options.rows = 18;
    options.columns = 26;
    const auto result = test::chi_square_rectangle(
        [&d](Random& r) { return std::optional(d.sample(r.uniform2()).uv); },
        [&d](const Vec2& uv) { return d.pdf(uv); },
        Vec2(0.0f),
        Vec2(1.0f),
        options);
    EXPECT_TRUE(result.passed) << result.message;
    EXPECT_NEAR(result.total_mass, 1.0, 1e-4);
    for (int i = 0; i < 10000; ++i) {
        const Vec2 u = random.uniform2();
        const auto s = d.sample(u);
        ASSERT_GT(s.pdf, 0.0f);
        ASSERT_NEAR(d.pmf(s.x, s.y) * 13.0f * 9.0f / s.pdf, 1.0f, 1e-5f);
        const Vec2 back = d.invert(s.uv);
        ASSERT_NEAR(back.x, u.x, 1e-5f);
        ASSERT_NEAR(back.y, u.y, 1e-5f);
    }
}

TEST(Distribution2D, DarkAndSingleCells) {
    const Distribution2D dark(std::vector<float>(6, 0.0f), 3, 2);
    EXPECT_NEAR(dark.pdf(Vec2(0.5f)), 1.0f, 1e-6f);
    const Distribution2D one;
    EXPECT_EQ(one.sample(Vec2(0.25f, 0.75f)).uv, Vec2(0.25f, 0.75f));
    std::vector<float> peak(64 * 32, 1e-30f);
    peak[100] = 1e30f;
    const Distribution2D peaky(peak, 64, 32);
    const auto s = peaky.sample(Vec2(0.9f, 0.1f));
    EXPECT_EQ(s.x + 64 * s.y, 100u);
    EXPECT_NEAR(s.pdf, 64.0f * 32.0f, 0.1f);
    EXPECT_THROW(Distribution2D(peak, 3, 3), std::invalid_argument);
    EXPECT_THROW(Distribution2D(peak, 0, 0), std::invalid_argument);
}

TEST(AliasTable, FrequenciesFollowWeights) {
    for (const std::vector<float>& weights : weight_cases()) {
        if (weights.empty()) {
            EXPECT_TRUE(AliasTable(weights).empty());
            continue;
        }
        const AliasTable table(weights);
        std::vector<double> observed(weights.size());
        std::vector<double> expected(weights.size());
        constexpr int kSamples = 200000;
        for (int i = 0; i < kSamples; ++i) {
            const auto s = table.sample((i + 0.5) / kSamples);
            ++observed[s.index];
            ASSERT_TRUE(s.u >= 0.0 && s.u < 1.0);
            ASSERT_EQ(s.pmf, table.pmf(s.index));
        }
        double mass = 0.0;
        for (std::uint32_t i = 0; i < weights.size(); ++i) {
            expected[i] = static_cast<double>(table.pmf(i)) * kSamples;
            mass += static_cast<double>(table.pmf(i));
            // Evenly spaced numbers: a few counts of each slot's boundaries.
            EXPECT_NEAR(observed[i], expected[i], 2.0 + 0.02 * expected[i]) << i;
        }
        EXPECT_NEAR(mass, 1.0, 1e-5);
    }
}

TEST(AliasTable, WidenedNumbersFillTheGaps) {
    Random random(5);
    double below = 0.0;
    constexpr int kSamples = 100000;
    for (int i = 0; i < kSamples; ++i) {
        const float u = random.uniform();
        const double wide = widen_random(u, random.uniform2());
        ASSERT_TRUE(wide >= static_cast<double>(u) && wide < static_cast<double>(u) + 0x1p-24);
        below += (wide - static_cast<double>(u)) * 0x1p24;
    }
    EXPECT_NEAR(below / kSamples, 0.5, 0.01);
    EXPECT_LT(widen_random(kOneMinusEpsilon, Vec2(0.3f)), 1.0);
}

TEST(Mis, WeightsOfAPairSumToOne) {
    const std::vector<float> densities = {
        0.0f, 1e-45f, 1e-38f, 1e-20f, 0.5f, 1.0f, 3.0f, 1e20f, 3e38f, kInfinity};
    for (const float a : densities) {
        for (const float b : densities) {
            const float power = power_heuristic(a, b) + power_heuristic(b, a);
            const float balance = balance_heuristic(a, b) + balance_heuristic(b, a);
            const float expected = a > 0.0f || b > 0.0f ? 1.0f : 0.0f;
            EXPECT_NEAR(power, expected, 1e-6f) << a << " " << b;
            EXPECT_NEAR(balance, expected, 1e-6f) << a << " " << b;
        }
    }
    EXPECT_FLOAT_EQ(power_heuristic(2.0f, 1.0f), 0.8f);
    EXPECT_FLOAT_EQ(balance_heuristic(2.0f, 1.0f), 2.0f / 3.0f);
}

}  // namespace

}  // namespace pharos
