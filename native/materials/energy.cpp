#include "materials/energy.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/math.h"
#include "materials/fresnel.h"
#include "materials/microfacet.h"

namespace pharos {

namespace {

// Axes: roughness, and the square root of mu (albedos bend most at grazing view).
constexpr std::size_t kFine = 32;
constexpr std::size_t kCoarse = 16;
constexpr int kFineSamples = 610;
constexpr int kCoarseSamples = 377;
constexpr float kMinMu = 1e-4f;
constexpr float kMinAlpha = 1e-4f;

// Point i of the Fibonacci lattice of `count` points; the angle is the wrapping dimension.
[[nodiscard]] Vec2 lattice_point(int i, int count) {
    const int previous = count == kFineSamples ? 377 : 233;
    const int wrapped = (i * previous) % count;
    return Vec2((static_cast<float>(wrapped) + 0.5f) / static_cast<float>(count),
                (static_cast<float>(i) + 0.5f) / static_cast<float>(count));
}

[[nodiscard]] float node(std::size_t i, std::size_t count) {
    return static_cast<float>(i) / static_cast<float>(count - 1);
}

[[nodiscard]] Vec3 view_direction(std::size_t i, std::size_t count) {
    const float mu = std::max(sqr(node(i, count)), kMinMu);
    return Vec3(safe_sqrt(1.0f - mu * mu), 0.0f, mu);
}

// G2 / G1 of leaving with cosine zi > 0: the weight of a visible-normal sample.
[[nodiscard]] inline float masking_weight(float zo, float so, float zi, float alpha) {
    const float z = std::max(zi, 0.0f);
    const float si = std::sqrt(z * z * (1.0f - alpha * alpha) + alpha * alpha);
    return z * (zo + so) / (z * so + zo * si);
}

// A position on an axis of `count` nodes: lower node and fraction.
struct AxisPosition {
    std::size_t lower;
    float fraction;
};

[[nodiscard]] inline AxisPosition axis_position(float t, std::size_t count) {
    const float scaled = saturate(t) * static_cast<float>(count - 1);
    const std::size_t lower = std::min(static_cast<std::size_t>(scaled), count - 2);
    return {lower, scaled - static_cast<float>(lower)};
}

struct ReflectionTables {
    std::array<std::array<float, kFine>, kFine> albedo{};  // [rough][sqrt mu]
    std::array<float, kFine> average{};

    ReflectionTables() {
        for (std::size_t r = 0; r < kFine; ++r) {
            const float alpha = std::max(sqr(node(r, kFine)), kMinAlpha);
            for (std::size_t m = 0; m < kFine; ++m) {
                albedo[r][m] = integrate(view_direction(m, kFine), alpha);
            }
            average[r] = average_over_directions(r);
        }
    }

    [[nodiscard]] static float integrate(const Vec3& wo, float alpha) {
        const float so = smith_s_isotropic(wo.z, alpha);
        float sum = 0.0f;
        for (int i = 0; i < kFineSamples; ++i) {
            const Vec3 h =
                sample_visible_normal(wo, alpha, alpha, 1.0f, lattice_point(i, kFineSamples));
            const float zi = 2.0f * glm::dot(wo, h) * h.z - wo.z;
            sum += masking_weight(wo.z, so, zi, alpha);
        }
        return sum / static_cast<float>(kFineSamples);
    }

    // Integral of 2 mu E dmu with mu = t^2: 4 t^3 E dt, by the midpoint rule on the interpolant.
    [[nodiscard]] float average_over_directions(std::size_t r) const {
        constexpr int kSteps = 512;
        double sum = 0.0;
        for (int i = 0; i < kSteps; ++i) {
            const float t = (static_cast<float>(i) + 0.5f) / static_cast<float>(kSteps);
            const AxisPosition p = axis_position(t, kFine);
            const float e = lerp(albedo[r][p.lower], albedo[r][p.lower + 1], p.fraction);
            sum += static_cast<double>(4.0f * t * t * t * e) / kSteps;
        }
        return static_cast<float>(sum);
    }
};

// Index axis: z with z^2 = |eta - 1| / (eta + 1), once for eta >= 1 and once for its inverse.
using Coarse3 = std::array<std::array<std::array<float, kCoarse>, kCoarse>, kCoarse>;
using CoarseRow = std::array<float, kCoarse>;

[[nodiscard]] float node_eta(std::size_t k, bool inverse) {
    const float q = std::min(sqr(node(k, kCoarse)), 0.99f);
    const float eta = (1.0f + q) / (1.0f - q);
    return inverse ? 1.0f / eta : eta;
}

struct DielectricTables {
    std::array<Coarse3, 2> glass{};  // [inverse][rough][sqrt mu][z]
    std::array<Coarse3, 2> shape{};

    DielectricTables() {
        for (std::size_t inverse = 0; inverse < 2; ++inverse) {
            CoarseRow eta;
            for (std::size_t k = 0; k < kCoarse; ++k) {
                eta[k] = node_eta(k, inverse != 0);
            }
            for (std::size_t r = 0; r < kCoarse; ++r) {
                for (std::size_t m = 0; m < kCoarse; ++m) {
                    integrate(eta, r, m, glass[inverse][r][m], shape[inverse][r][m]);
                }
            }
        }
    }

    // One row over all indices: every visible normal serves all of them.
    static void integrate(const CoarseRow& eta,
                          std::size_t rough,
                          std::size_t mu,
                          CoarseRow& glass_row,
                          CoarseRow& shape_row) {
        const float alpha = std::max(sqr(node(rough, kCoarse)), kMinAlpha);
        const Vec3 wo = view_direction(mu, kCoarse);
        const float so = smith_s_isotropic(wo.z, alpha);
        float reflected = 0.0f;
        glass_row.fill(0.0f);
        shape_row.fill(0.0f);
        for (int i = 0; i < kCoarseSamples; ++i) {
            const Vec3 h =
                sample_visible_normal(wo, alpha, alpha, 1.0f, lattice_point(i, kCoarseSamples));
            const float oh = std::max(glm::dot(wo, h), 0.0f);
            const float weight = masking_weight(wo.z, so, 2.0f * oh * h.z - wo.z, alpha);
            reflected += weight;
            for (std::size_t k = 0; k < kCoarse; ++k) {
                const float f = fresnel_dielectric(oh, eta[k]);
                const float cosine = std::max(refracted_cosine(oh, eta[k]), 0.0f);
                // Cosine of the refracted direction below the surface.
                const float below = wo.z / eta[k] - (oh / eta[k] - cosine) * h.z;
                glass_row[k] += f * weight + (1.0f - f) * masking_weight(wo.z, so, below, alpha);
                shape_row[k] += dielectric_shape(f, eta[k]) * weight;
            }
        }
        for (std::size_t k = 0; k < kCoarse; ++k) {
            glass_row[k] /= static_cast<float>(kCoarseSamples);
            shape_row[k] = reflected > 0.0f ? shape_row[k] / reflected : 1.0f;
        }
    }
};

[[nodiscard]] const ReflectionTables& reflection_tables() {
    static const ReflectionTables tables;
    return tables;
}

[[nodiscard]] const DielectricTables& dielectric_tables() {
    static const DielectricTables tables;
    return tables;
}

[[nodiscard]] float interpolate(const Coarse3& table, float mu, float rough, float eta) {
    const AxisPosition r = axis_position(rough, kCoarse);
    const AxisPosition m = axis_position(std::sqrt(saturate(mu)), kCoarse);
    const float q = std::abs(eta - 1.0f) / (eta + 1.0f);
    const AxisPosition z = axis_position(std::sqrt(q), kCoarse);
    std::array<float, 4> corner{};
    for (std::size_t i = 0; i < 4; ++i) {
        const CoarseRow& row = table[r.lower + (i >> 1)][m.lower + (i & 1)];
        corner[i] = lerp(row[z.lower], row[z.lower + 1], z.fraction);
    }
    return lerp(
        lerp(corner[0], corner[1], m.fraction), lerp(corner[2], corner[3], m.fraction), r.fraction);
}

}  // namespace

float ggx_albedo(float mu, float rough) {
    const ReflectionTables& tables = reflection_tables();
    const AxisPosition r = axis_position(rough, kFine);
    const AxisPosition m = axis_position(std::sqrt(saturate(mu)), kFine);
    const auto& low = tables.albedo[r.lower];
    const auto& high = tables.albedo[r.lower + 1];
    return lerp(lerp(low[m.lower], low[m.lower + 1], m.fraction),
                lerp(high[m.lower], high[m.lower + 1], m.fraction),
                r.fraction);
}

float ggx_average_albedo(float rough) {
    const ReflectionTables& tables = reflection_tables();
    const AxisPosition r = axis_position(rough, kFine);
    return lerp(tables.average[r.lower], tables.average[r.lower + 1], r.fraction);
}

float ggx_glass_albedo(float mu, float rough, float eta) {
    return interpolate(dielectric_tables().glass[eta < 1.0f ? 1 : 0], mu, rough, eta);
}

float ggx_dielectric_shape(float mu, float rough, float eta) {
    return interpolate(dielectric_tables().shape[eta < 1.0f ? 1 : 0], mu, rough, eta);
}

}  // namespace pharos
