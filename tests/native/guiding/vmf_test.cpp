// vMF lobes in float32 against double and against their definitions.
#include "guiding/vmf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support/chi_square.h"
#include "support/random.h"
#include "support/stress.h"

namespace pharos {
namespace {

using test::Random;

struct Double3 {
    double x, y, z;
};

Double3 normalized(const Vec3& v) {
    const auto x = static_cast<double>(v.x);
    const auto y = static_cast<double>(v.y);
    const auto z = static_cast<double>(v.z);
    const double inverse = 1.0 / std::sqrt(x * x + y * y + z * z);
    return {x * inverse, y * inverse, z * inverse};
}

double chord2(const Vec3& a, const Vec3& b) {
    const Double3 p = normalized(a);
    const Double3 q = normalized(b);
    const double x = p.x - q.x;
    const double y = p.y - q.y;
    const double z = p.z - q.z;
    return x * x + y * y + z * z;
}

double log_pdf_reference(double kappa, double chord_squared) {
    const double two_k = 2.0 * kappa;
    const double log_norm = kappa < 1e-12 ? std::log(0.25 * M_1_PI)
                                          : std::log(two_k / -std::expm1(-two_k) * 0.25 * M_1_PI);
    return log_norm - 0.5 * kappa * chord_squared;
}

float random_kappa(Random& random) {
    return random.uniform() < 0.02f ? 0.0f : random.log_uniform(1e-6f, 1e7f);
}

// The bound of DESIGN "Numbers" on random lobes and directions, half of them sampled from the lobe.
TEST(Vmf, PdfErrorStaysUnderTheBound) {
    Random random(1);
    std::vector<double> relative_errors;
    const std::uint64_t cases = testing::case_count(1000000, 100000000);
    double worst = 0.0;  // in units of the bound
    relative_errors.reserve(static_cast<std::size_t>(cases / 2));
    for (std::uint64_t i = 0; i < cases; ++i) {
        const VmfLobe lobe{random.direction(), random_kappa(random)};
        const Vec3 w = (i & 1) != 0 ? random.direction() : sample_vmf(lobe, random.uniform2());
        const double c2 = chord2(w, lobe.mu);
        const double t = 0.5 * static_cast<double>(lobe.kappa) * c2;
        const double expected = log_pdf_reference(static_cast<double>(lobe.kappa), c2);
        const float pdf = vmf_pdf(lobe, w);
        ASSERT_TRUE(std::isfinite(pdf));
        if (t > 80.0) {
            ASSERT_LT(static_cast<double>(pdf), 1e-25);
            continue;
        }
        const double error = std::abs(std::expm1(std::log(static_cast<double>(pdf)) - expected));
        worst = std::max(worst, error / (4e-7 * (2.0 + t)));
        ASSERT_LE(error, 4e-7 * (2.0 + t)) << "kappa " << lobe.kappa << " t " << t;
        if ((i & 1) == 0) {
            relative_errors.push_back(error);
        }
        const double log_error = std::abs(static_cast<double>(vmf_log_pdf(lobe, w)) - expected);
        ASSERT_LE(log_error, 4e-7 * (2.0 + t) + 2e-7 * std::abs(expected));
    }
    const auto p99 =
        relative_errors.begin() + static_cast<std::ptrdiff_t>(relative_errors.size() * 99 / 100);
    std::nth_element(relative_errors.begin(), p99, relative_errors.end());
    EXPECT_LE(*p99, 5e-7);
    testing::say_stress("vMF densities: error, of its bound", cases, worst, 1.0);
}

TEST(Vmf, KappaIsClampedAsDocumented) {
    EXPECT_EQ(vmf::clamp_kappa(std::numeric_limits<float>::quiet_NaN()), 0.0f);
    EXPECT_EQ(vmf::clamp_kappa(-3.0f), 0.0f);
    EXPECT_EQ(vmf::clamp_kappa(kInfinity), kMaxKappa);
    EXPECT_EQ(vmf::clamp_kappa(2e7f), kMaxKappa);
    EXPECT_EQ(vmf::clamp_kappa(7.0f), 7.0f);
    const float denormal = std::numeric_limits<float>::denorm_min();
    Random random(2);
    for (const float kappa : {0.0f,
                              denormal,
                              1e-30f,
                              -1.0f,
                              kInfinity,
                              -kInfinity,
                              std::numeric_limits<float>::quiet_NaN(),
                              kMaxKappa}) {
        const VmfLobe lobe{random.direction(), kappa};
        for (const Vec2& u : {Vec2(0.0f), Vec2(kOneMinusEpsilon), random.uniform2()}) {
            const Vec3 w = sample_vmf(lobe, u);
            ASSERT_TRUE(is_finite(w)) << kappa;
            EXPECT_NEAR(glm::length(w), 1.0f, 1e-6f);
            const float pdf = vmf_pdf(lobe, w);
            EXPECT_TRUE(std::isfinite(pdf) && pdf >= 0.0f) << kappa;
            const VmfGradient gradient = vmf_log_pdf_gradient(lobe, w);
            EXPECT_TRUE(is_finite(gradient.mu) && std::isfinite(gradient.log_kappa)) << kappa;
        }
    }
    EXPECT_FLOAT_EQ(vmf_pdf({Vec3(0, 0, 1), 0.0f}, Vec3(0, 1, 0)), 0.25f * kInvPi);
    EXPECT_FLOAT_EQ(vmf_pdf({Vec3(0, 0, 1), denormal}, Vec3(0, 1, 0)), 0.25f * kInvPi);
}

TEST(Vmf, SamplesFollowTheDensity) {
    const std::array<float, 7> kappas = {0.0f, 1e-4f, 0.3f, 1.0f, 5.0f, 30.0f, 300.0f};
    Random random(3);
    for (const float kappa : kappas) {
        const VmfLobe lobe{random.direction(), kappa};
        test::ChiSquareOptions options;
        options.tests = static_cast<int>(kappas.size());
        // The lobe on the equator of the grid, away from the poles' small cells.
        options.frame = Frame::from_z(Frame::from_z(lobe.mu).x);
        const auto result = test::chi_square_sphere(
            [&](Random& r) { return std::optional<Vec3>(sample_vmf(lobe, r.uniform2())); },
            [&](const Vec3& w) { return vmf_pdf(lobe, w); },
            options);
        EXPECT_TRUE(result.passed) << "kappa " << kappa << ": " << result.message;
    }
}

// Narrow lobes by the distribution of 1 - cos, whose CDF is (1 - exp(-kappa r)) / (1 - exp(-2
// kappa)).
TEST(Vmf, NarrowSamplesHaveTheRightSpread) {
    Random random(4);
    for (const float kappa : {1e3f, 3e4f, 1e6f, 1e7f}) {
        constexpr int kBins = 50;
        constexpr int kSamples = 100000;
        std::array<int, kBins> histogram{};
        for (int i = 0; i < kSamples; ++i) {
            const float r = vmf::sample_one_minus_cos<float>(kappa, random.uniform());
            const double cdf = std::expm1(-static_cast<double>(kappa) * static_cast<double>(r)) /
                               std::expm1(-2.0 * static_cast<double>(kappa));
            ++histogram[static_cast<std::size_t>(
                std::clamp(static_cast<int>(cdf * kBins), 0, kBins - 1))];
        }
        double statistic = 0.0;
        for (const int n : histogram) {
            const double expected = static_cast<double>(kSamples) / kBins;
            statistic += (n - expected) * (n - expected) / expected;
        }
        EXPECT_GT(test::upper_gamma(0.5 * (kBins - 1), 0.5 * statistic), 1e-3) << kappa;
    }
}

double log_pdf_double(const std::array<double, 3>& mu, double log_kappa, const Vec3& w) {
    // mu is normalised here, so that its derivative is the tangential one.
    const double length = std::sqrt(mu[0] * mu[0] + mu[1] * mu[1] + mu[2] * mu[2]);
    const Double3 d = normalized(w);
    const double x = d.x - mu[0] / length;
    const double y = d.y - mu[1] / length;
    const double z = d.z - mu[2] / length;
    return log_pdf_reference(std::exp(log_kappa), x * x + y * y + z * z);
}

TEST(Vmf, GradientsMatchFiniteDifferences) {
    Random random(5);
    for (int i = 0; i < 20000; ++i) {
        const VmfLobe lobe{random.direction(), random.log_uniform(1e-3f, 1e5f)};
        const Vec3 w = (i & 1) != 0 ? random.direction() : sample_vmf(lobe, random.uniform2());
        const VmfGradient gradient = vmf_log_pdf_gradient(lobe, w);
        const auto kappa = static_cast<double>(lobe.kappa);
        std::array<double, 3> mu = {static_cast<double>(lobe.mu.x),
                                    static_cast<double>(lobe.mu.y),
                                    static_cast<double>(lobe.mu.z)};
        const double h = 1e-5;
        const double dk = (log_pdf_double(mu, std::log(kappa) + h, w) -
                           log_pdf_double(mu, std::log(kappa) - h, w)) /
                          (2.0 * h);
        // The chord's own rounding shows where kappa is large: allow it.
        ASSERT_NEAR(
            static_cast<double>(gradient.log_kappa), dk, 2e-6 * (1.0 + std::abs(dk)) + 1e-9 * kappa)
            << "kappa " << kappa;
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double step = 1e-5 / std::sqrt(1.0 + kappa);
            std::array<double, 3> plus = mu;
            std::array<double, 3> minus = mu;
            plus[a] += step;
            minus[a] -= step;
            const double slope = (log_pdf_double(plus, std::log(kappa), w) -
                                  log_pdf_double(minus, std::log(kappa), w)) /
                                 (2.0 * step);
            ASSERT_NEAR(static_cast<double>(gradient.mu[axis]), slope, 3e-6 * (1.0 + kappa))
                << kappa;
        }
    }
}

TEST(Vmf, ProductIsTheProductOfTheExponentials) {
    Random random(6);
    for (int i = 0; i < 20000; ++i) {
        const VmfLobe a{random.direction(), random.log_uniform(1e-2f, 1e3f)};
        const VmfLobe b{random.direction(), random.log_uniform(1e-2f, 1e3f)};
        const VmfProduct product = vmf_product(a, b);
        ASSERT_LE(product.log_scale, 0.0f);
        const Vec3 w = random.direction();
        const double left = 0.5 * static_cast<double>(a.kappa) * chord2(w, a.mu) +
                            0.5 * static_cast<double>(b.kappa) * chord2(w, b.mu);
        const double right =
            -static_cast<double>(product.log_scale) +
            0.5 * static_cast<double>(product.lobe.kappa) * chord2(w, product.lobe.mu);
        ASSERT_NEAR(left, right, 2e-6 * (1.0 + static_cast<double>(a.kappa + b.kappa)));
    }
}

TEST(Vmf, MeanCosineAndItsInverse) {
    for (float kappa = 1e-3f; kappa < 1e6f; kappa *= 1.1f) {
        const auto k = static_cast<double>(kappa);
        const double expected =
            k < 1e-2 ? k / 3.0 - k * k * k / 45.0 : 1.0 / std::tanh(k) - 1.0 / k;
        const float mean = vmf_mean_cosine(kappa);
        ASSERT_NEAR(static_cast<double>(mean), expected, 3e-7 * expected + 1e-9) << kappa;
        if (kappa < 1e4f) {
            // Near 1 the mean cosine itself holds few digits of kappa.
            const double sensitivity = 2e-6 + 1.2e-7 * k;
            ASSERT_NEAR(
                static_cast<double>(vmf_kappa_from_mean_cosine(mean)), k, 4.0 * sensitivity * k);
        }
    }
    EXPECT_EQ(vmf_kappa_from_mean_cosine(0.0f), 0.0f);
    EXPECT_EQ(vmf_kappa_from_mean_cosine(-1.0f), 0.0f);
    EXPECT_LE(vmf_kappa_from_mean_cosine(1.0f), kMaxKappa);
}

// One source: vectors of eight give what floats give.
TEST(Vmf, VectorsAgreeWithScalars) {
    using F8 [[gnu::vector_size(32)]] = float;
    Random random(7);
    for (int i = 0; i < 20000; ++i) {
        F8 kappa;
        F8 c2;
        F8 u;
        for (int lane = 0; lane < 8; ++lane) {
            kappa[lane] = random_kappa(random);
            c2[lane] = 4.0f * random.uniform() / std::max(kappa[lane], 1.0f);
            u[lane] = random.uniform();
        }
        const F8 pdf = vmf::pdf<F8>(kappa, c2);
        const F8 r = vmf::sample_one_minus_cos<F8>(kappa, u);
        for (int lane = 0; lane < 8; ++lane) {
            ASSERT_FLOAT_EQ(pdf[lane], vmf::pdf<float>(kappa[lane], c2[lane]));
            ASSERT_FLOAT_EQ(r[lane], vmf::sample_one_minus_cos<float>(kappa[lane], u[lane]));
        }
    }
}

}  // namespace
}  // namespace pharos
