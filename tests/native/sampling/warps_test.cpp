#include "sampling/warps.h"

#include <optional>

#include <gtest/gtest.h>

#include "support/chi_square.h"
#include "support/random.h"

namespace pharos {
namespace {

using test::ChiSquareOptions;
using test::Random;

constexpr int kTests = 8;

ChiSquareOptions options_with_seed(std::uint64_t seed) {
    ChiSquareOptions options;
    options.seed = seed;
    options.tests = kTests;
    options.frame = Frame::from_z(glm::normalize(Vec3(0.4f, -0.7f, 0.5f)));
    return options;
}

void expect_inverse(const Vec2& u, const Vec2& back, float tolerance) {
    EXPECT_NEAR(u.x, back.x, tolerance);
    EXPECT_NEAR(u.y, back.y, tolerance);
}

TEST(Warps, SincosTurnsMatchesDouble) {
    for (int i = -4000; i <= 4000; ++i) {
        const float turns = static_cast<float>(i) * (1.0f / 1333.0f);
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(turns);
        const SinCos sc = sincos_turns(turns);
        EXPECT_NEAR(static_cast<double>(sc.sin), std::sin(angle), 1.5e-7);
        EXPECT_NEAR(static_cast<double>(sc.cos), std::cos(angle), 1.5e-7);
    }
}

TEST(Warps, ArcsineMatchesDouble) {
    for (int i = -(1 << 16); i <= 1 << 16; ++i) {
        const float q = static_cast<float>(i) * 0x1p-16f;
        const double exact = std::asin(static_cast<double>(q));
        EXPECT_NEAR(static_cast<double>(arcsine(q)), exact, 3e-7 * std::abs(exact)) << q;
    }
    EXPECT_EQ(arcsine(1.0f + 0x1p-20f), 0.5f * kPi);
}

TEST(Warps, CosineHemisphere) {
    const auto sample = [](Random& r) {
        return std::optional(sample_cosine_hemisphere(r.uniform2()));
    };
    const auto pdf = [](const Vec3& w) { return cosine_hemisphere_pdf(w.z); };
    const auto result = test::chi_square_sphere(sample, pdf, options_with_seed(1));
    EXPECT_TRUE(result.passed) << result.message;
    EXPECT_NEAR(result.total_mass, 1.0, 1e-4);
}

TEST(Warps, UniformSphere) {
    const auto sample = [](Random& r) {
        return std::optional(sample_uniform_sphere(r.uniform2()));
    };
    const auto pdf = [](const Vec3&) { return uniform_sphere_pdf(); };
    const auto result = test::chi_square_sphere(sample, pdf, options_with_seed(2));
    EXPECT_TRUE(result.passed) << result.message;
}

TEST(Warps, UniformConeWideAndBeyondTheHemisphere) {
    for (const float drop : {0.3f, 1.0f, 1.7f}) {
        const auto sample = [drop](Random& r) {
            return std::optional(sample_uniform_cone(r.uniform2(), drop));
        };
        const auto pdf = [drop](const Vec3& w) {
            return 1.0f - w.z <= drop ? uniform_cone_pdf(drop) : 0.0f;
        };
        ChiSquareOptions options = options_with_seed(3);
        options.frame = Frame::from_z(Vec3(0, 0, 1));
        options.rows = 40;
        const auto result = test::chi_square_sphere(sample, pdf, options);
        EXPECT_TRUE(result.passed) << result.message;
    }
}

TEST(Warps, TinyConeKeepsItsRadius) {
    // A cone of 1e-5 rad: 1 - cos is 5e-11, far below the spacing of floats at one.
    const float sin_squared = 1e-10f;
    const float drop = one_minus_cos_from_sin2(sin_squared);
    EXPECT_NEAR(drop / 5e-11f, 1.0f, 1e-6f);
    Random random(7);
    double mean = 0.0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 w = sample_uniform_cone(random.uniform2(), drop);
        const float radius_squared = w.x * w.x + w.y * w.y;
        ASSERT_LE(radius_squared, sin_squared * 1.00001f);
        mean += static_cast<double>(radius_squared / sin_squared) / 20000.0;
    }
    EXPECT_NEAR(mean, 0.5, 0.01);
}

TEST(Warps, UniformDiskAndTriangle) {
    // The disk in (radius squared, angle): the unit square, evenly.
    const auto disk = [](Random& r) {
        const Vec2 p = sample_uniform_disk(r.uniform2());
        EXPECT_GT(uniform_disk_pdf(p), 0.0f);
        return std::optional(Vec2(glm::dot(p, p), direction_turns(p.x, p.y)));
    };
    const auto even = [](const Vec2&) { return 1.0f; };
    auto result = test::chi_square_rectangle(disk, even, Vec2(0), Vec2(1), options_with_seed(4));
    EXPECT_TRUE(result.passed) << result.message;
    const auto triangle = [](Random& r) {
        return std::optional(sample_uniform_triangle(r.uniform2()));
    };
    const auto inside = [](const Vec2& b) {
        return b.x + b.y <= 1.0f ? uniform_triangle_pdf(0.5f) : 0.0f;
    };
    result = test::chi_square_rectangle(triangle, inside, Vec2(0), Vec2(1), options_with_seed(5));
    EXPECT_TRUE(result.passed) << result.message;
}

TEST(Warps, InversesReturnTheRandomNumbers) {
    Random random(11);
    for (int i = 0; i < 20000; ++i) {
        const Vec2 u = random.uniform2();
        expect_inverse(u, invert_uniform_disk(sample_uniform_disk(u)), 1e-6f);
        expect_inverse(u, invert_cosine_hemisphere(sample_cosine_hemisphere(u)), 1e-6f);
        expect_inverse(u, invert_uniform_triangle(sample_uniform_triangle(u)), 1e-6f);
        // The angle is lost at the poles.
        if (u.x > 1e-3f && u.x < 0.999f) {
            expect_inverse(u, invert_uniform_sphere(sample_uniform_sphere(u)), 3e-5f);
            expect_inverse(u, invert_uniform_cone(sample_uniform_cone(u, 1e-6f), 1e-6f), 1e-5f);
        }
    }
}

TEST(Warps, CornersStayInTheDomain) {
    for (const float x : {0.0f, 0.5f, kOneMinusEpsilon}) {
        for (const float y : {0.0f, 0.5f, kOneMinusEpsilon}) {
            const Vec2 u(x, y);
            EXPECT_TRUE(is_finite(sample_cosine_hemisphere(u)));
            EXPECT_NEAR(glm::length(sample_cosine_hemisphere(u)), 1.0f, 1e-6f);
            EXPECT_NEAR(glm::length(sample_uniform_sphere(u)), 1.0f, 1e-6f);
            const Vec2 b = sample_uniform_triangle(u);
            EXPECT_GE(1.0f - b.x - b.y, 0.0f);
            EXPECT_LE(glm::length(sample_uniform_disk(u)), 1.0f + 1e-6f);
        }
    }
}

}  // namespace
}  // namespace pharos
