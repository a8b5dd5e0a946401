// Mixtures of vMF lobes: sampling against density, the closed-form product, extreme lobes.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "guiding/directional_mixture.h"
#include "guiding/roulette.h"
#include "support/chi_square.h"
#include "support/random.h"
#include "support/stress.h"

namespace pharos {
namespace {

using test::Random;

VmfMixture random_mixture(Random& random, int lobes, float kappa_max) {
    VmfMixture mixture;
    std::vector<float> weights(static_cast<std::size_t>(lobes));
    float sum = 0.0f;
    for (float& w : weights) {
        w = random.uniform();
        sum += w;
    }
    for (int k = 0; k < lobes; ++k) {
        set_lobe(mixture,
                 k,
                 weights[static_cast<std::size_t>(k)] / sum,
                 {random.direction(), random.log_uniform(0.1f, kappa_max)});
    }
    mixture.lobe_count = lobes;
    mixture.A = 1.0f;
    return mixture;
}

double pdf_by_lobes(const VmfMixture& mixture, const Vec3& wi) {
    double sum = 0.0;
    for (int k = 0; k < mixture.lobe_count; ++k) {
        sum += static_cast<double>(mixture.weight[k]) *
               static_cast<double>(vmf_pdf(mixture.lobe(k), wi));
    }
    return sum;
}

test::ChiSquareResult test_mixture(const VmfMixture& mixture, int tests) {
    test::ChiSquareOptions options;
    options.tests = tests;
    return test::chi_square_sphere(
        [&](Random& r) {
            const float u = r.uniform();
            return std::optional<Vec3>(sample_mixture(mixture, u, r.uniform2()));
        },
        [&](const Vec3& w) { return mixture_pdf(mixture, w); },
        options);
}

TEST(Mixture, DefaultIsUniform) {
    const VmfMixture mixture;
    EXPECT_FLOAT_EQ(mixture_pdf(mixture, Vec3(0.6f, 0.0f, 0.8f)), 0.25f * kInvPi);
    EXPECT_EQ(choose_lobe(mixture, kOneMinusEpsilon), 0);
}

TEST(Mixture, PdfIsTheWeightedSumOfItsLobes) {
    Random random(1);
    for (int i = 0; i < 20000; ++i) {
        const VmfMixture mixture = random_mixture(random, 1 + i % 8, 1e4f);
        const Vec3 w = i % 2 == 0 ? random.direction()
                                  : sample_mixture(mixture, random.uniform(), random.uniform2());
        const double expected = pdf_by_lobes(mixture, w);
        ASSERT_NEAR(
            static_cast<double>(mixture_pdf(mixture, w)), expected, 2e-5 * expected + 1e-30);
    }
}

TEST(Mixture, SamplesFollowTheDensity) {
    Random random(2);
    constexpr int kTests = 6;
    for (int i = 0; i < kTests; ++i) {
        const auto result = test_mixture(random_mixture(random, 1 + i % 8, 200.0f), kTests);
        EXPECT_TRUE(result.passed) << result.message;
        EXPECT_NEAR(result.total_mass, 1.0, 1e-4);
    }
}

TEST(Mixture, LobesOfWeightZeroAreNeverChosen) {
    VmfMixture mixture;
    set_lobe(mixture, 0, 0.0f, {});
    set_lobe(mixture, 3, 0.7f, {Vec3(1, 0, 0), 10.0f});
    set_lobe(mixture, 5, 0.29999998f, {Vec3(0, 1, 0), 10.0f});
    mixture.lobe_count = 8;
    Random random(3);
    for (int i = 0; i < 100000; ++i) {
        const int k = choose_lobe(mixture, random.uniform());
        ASSERT_TRUE(k == 3 || k == 5);
    }
    EXPECT_EQ(choose_lobe(mixture, 0.0f), 3);
    EXPECT_EQ(choose_lobe(mixture, kOneMinusEpsilon), 5);
}

TEST(Mixture, ProductIsNormalisedAndSampled) {
    Random random(4);
    constexpr int kTests = 6;
    for (int i = 0; i < kTests; ++i) {
        const VmfMixture product = multiply_lobe(
            random_mixture(random, 8, 50.0f), random.direction(), random.log_uniform(0.5f, 100.0f));
        const auto result = test_mixture(product, kTests);
        EXPECT_TRUE(result.passed) << result.message;
        EXPECT_NEAR(result.total_mass, 1.0, 1e-4);
    }
}

// The product's density is proportional to the mixture's times the lobe: their ratio is one
// constant.
TEST(Mixture, ProductIsProportionalToBothFactors) {
    Random random(5);
    for (int i = 0; i < 500; ++i) {
        VmfMixture mixture = random_mixture(random, 8, 300.0f);
        mixture.A = random.log_uniform(1e-3f, 1e3f);
        const VmfLobe lobe{random.direction(), random.log_uniform(0.1f, 500.0f)};
        const VmfMixture product = multiply_lobe(mixture, lobe.mu, lobe.kappa);
        EXPECT_EQ(product.A, mixture.A);
        double first = 0.0;
        for (int j = 0; j < 10; ++j) {
            const Vec3 w = sample_mixture(product, random.uniform(), random.uniform2());
            const double factors = static_cast<double>(mixture_pdf(mixture, w)) *
                                   static_cast<double>(vmf_pdf(lobe, w));
            if (factors < 1e-25) {
                continue;  // float32 has no digits left there
            }
            const double ratio = static_cast<double>(mixture_pdf(product, w)) / factors;
            first = first == 0.0 ? ratio : first;
            ASSERT_NEAR(ratio / first, 1.0, 1e-4) << lobe.kappa;
        }
        // The ratio is one over the integral of both: what of A comes in along the lobe.
        if (first > 0.0) {
            const double along = static_cast<double>(mixture.A) / first;
            ASSERT_NEAR(
                static_cast<double>(product.expected) / (std::numbers::pi * along), 1.0, 1e-3)
                << lobe.kappa;
        }
    }
}

TEST(Mixture, ProductThatUnderflowsIsTheMixtureBefore) {
    VmfMixture mixture;
    set_lobe(mixture, 0, 1.0f, {Vec3(0, 0, 1), 1e6f});
    // The exponents are relative to the best lobe, so even an opposite lobe keeps a valid product.
    const VmfMixture opposite = multiply_lobe(mixture, Vec3(0, 0, -1), 1e6f);
    EXPECT_TRUE(std::isfinite(mixture_pdf(opposite, Vec3(0, 0, 1))));
    // Nothing to multiply at all: as it was.
    VmfMixture empty = mixture;
    set_lobe(empty, 0, 0.0f, {Vec3(0, 0, 1), 10.0f});
    const VmfMixture same = multiply_lobe(empty, Vec3(0, 1, 0), 100.0f);
    EXPECT_EQ(same.weight[0], 0.0f);
    EXPECT_EQ(same.kappa[0], 10.0f);
    // NaN and infinite kappa follow the clamp.
    const VmfMixture nan = multiply_lobe(mixture, Vec3(0, 1, 0), std::nanf(""));
    EXPECT_NEAR(mixture_pdf(nan, Vec3(0, 0, 1)) / mixture_pdf(mixture, Vec3(0, 0, 1)), 1.0f, 1e-5f);
}

TEST(Mixture, ProductWeightsSumToOneForExtremeLobes) {
    Random random(6);
    for (int i = 0; i < 100000; ++i) {
        const VmfMixture mixture = random_mixture(random, 8, 3e4f);
        const VmfMixture product =
            multiply_lobe(mixture, random.direction(), random.log_uniform(1e-3f, 1e5f));
        float sum = 0.0f;
        for (int k = 0; k < kMaxLobes; ++k) {
            sum += product.weight[k];
            ASSERT_NEAR(length_squared(product.lobe(k).mu), 1.0f, 1e-5f);
            ASSERT_TRUE(product.kappa[k] >= 0.0f && product.kappa[k] <= kMaxKappa);
        }
        ASSERT_NEAR(sum, 1.0f, 1e-5f);
    }
}

TEST(Mixture, SpansDoTheSameAsSingleCalls) {
    Random random(7);
    std::vector<VmfMixture> mixtures;
    std::vector<float> u_lobe;
    std::vector<Vec2> u;
    for (int i = 0; i < 100; ++i) {
        mixtures.push_back(random_mixture(random, 8, 1e3f));
        u_lobe.push_back(random.uniform());
        u.push_back(random.uniform2());
    }
    std::vector<Vec3> wi(100);
    std::vector<float> pdf(100);
    sample_mixtures(mixtures, u_lobe, u, wi);
    mixture_pdfs(mixtures, wi, pdf);
    for (std::size_t i = 0; i < 100; ++i) {
        const Vec3 expected = sample_mixture(mixtures[i], u_lobe[i], u[i]);
        EXPECT_NEAR(glm::length(wi[i] - expected), 0.0f, 1e-6f);
        EXPECT_NEAR(pdf[i] / mixture_pdf(mixtures[i], wi[i]), 1.0f, 1e-5f);
    }
}

TEST(Roulette, WeightsAreOneInTheMean) {
    const WeightWindow window;
    Random random(8);
    for (const float r : {0.0f, 1e-6f, 0.05f, 0.2f, 0.5f, 1.0f, 1.7f, 3.0f, 5.3f, 100.0f}) {
        for (const bool may_split : {false, true}) {
            double sum = 0.0;
            constexpr int kSamples = 100000;
            for (int i = 0; i < kSamples; ++i) {
                const RouletteDecision d = weight_window(window, r, may_split, random.uniform());
                ASSERT_LE(d.copies, window.max_copies);
                ASSERT_TRUE(may_split || d.copies <= 1);
                ASSERT_LE(d.weight, 1.0f / window.min_survival);
                sum += static_cast<double>(d.weight) * d.copies;
            }
            EXPECT_NEAR(sum / kSamples, 1.0, 0.03) << r;
        }
    }
    for (const float r : {std::nanf(""), kInfinity, -1.0f}) {
        const RouletteDecision d = weight_window(window, r, true, 0.5f);
        EXPECT_EQ(d.copies, 1);
        EXPECT_EQ(d.weight, 1.0f);
    }
}

// Lobes of any sharpness and weight, multiplied, sampled and asked.
TEST(Mixture, AnyLobesGiveDensities) {
    const std::uint64_t tries = testing::case_count(300000, 10000000);
    std::uint64_t bad = 0;
    Random random(77);
    for (std::uint64_t i = 0; i < tries; i += 10) {
        VmfMixture mixture;
        mixture.lobe_count = 1 + static_cast<int>(random.index(8));
        float sum = 0.0f;
        std::array<float, 8> weight{};
        for (int k = 0; k < mixture.lobe_count; ++k) {
            weight[static_cast<std::size_t>(k)] =
                random.index(3) == 0 ? 0.0f : random.log_uniform(1e-30f, 1.0f);
            sum += weight[static_cast<std::size_t>(k)];
        }
        weight[0] = sum > 0.0f ? weight[0] : 1.0f;
        sum = sum > 0.0f ? sum : 1.0f;
        for (int k = 0; k < mixture.lobe_count; ++k) {
            const float kappa = random.index(8) == 0 ? 0.0f : random.log_uniform(1e-6f, 3e4f);
            set_lobe(
                mixture, k, weight[static_cast<std::size_t>(k)] / sum, {random.direction(), kappa});
        }
        if (random.index(2) == 0) {
            mixture = multiply_lobe(mixture, random.direction(), random.log_uniform(1e-3f, 3e4f));
        }
        for (int k = 0; k < 10; ++k) {
            const Vec3 w = sample_mixture(mixture, random.uniform(), random.uniform2());
            const float pdf = mixture_pdf(mixture, w);
            const float other = mixture_pdf(mixture, random.direction());
            const bool good = std::abs(length_squared(w) - 1.0f) < 1e-4f && pdf > 0.0f &&
                              std::isfinite(pdf) && other >= 0.0f && std::isfinite(other);
            bad += good ? 0 : 1;
            EXPECT_TRUE(good) << "case " << i + static_cast<std::uint64_t>(k) << " pdf " << pdf;
        }
        ASSERT_LT(bad, 5u);
    }
    testing::say_stress(
        "vMF mixtures and products: densities that are none", tries, static_cast<double>(bad), 0.0);
}

}  // namespace
}  // namespace pharos
