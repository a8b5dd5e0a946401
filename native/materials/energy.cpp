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
constexpr int kFineSamples = 377;
constexpr int kCoarseSamples = 233;
constexpr float kMinMu = 1e-4f;
constexpr float kMinAlpha = 1e-4f;

// Points of the spherical cap that visible normals are mapped from, before the cap is cut to the
// view (Dupuy, Benyoub 2023): a Fibonacci lattice, the angle being its wrapping dimension.
template <int N>
struct CapLattice {
    std::array<float, N> cosine{};
    std::array<float, N> height{};

    CapLattice() {
        const int previous = N == kFineSamples ? 233 : 144;
        for (int i = 0; i < N; ++i) {
            const float turns =
                (static_cast<float>((i * previous) % N) + 0.5f) / static_cast<float>(N);
            const std::size_t k = static_cast<std::size_t>(i);
            cosine[k] = sincos_turns(turns).cos;
            height[k] = (static_cast<float>(i) + 0.5f) / static_cast<float>(N);
        }
    }
};

// Heights and cosines to the view of the visible normals of one view direction (sin, 0, cos).
template <int N>
struct VisibleNormals {
    std::array<float, N> z{};
    std::array<float, N> cosine{};

    VisibleNormals(const CapLattice<N>& lattice, const Vec3& wo, float alpha) {
        const Vec3 view = glm::normalize(Vec3(alpha * wo.x, 0.0f, wo.z));
        for (std::size_t i = 0; i < static_cast<std::size_t>(N); ++i) {
            // As sample_visible_normal, written out so that the loop vectorises; only x and z of
            // the normal and the length of its y are needed.
            const float cap_z = lattice.height[i] * (1.0f + view.z) - view.z;
            const float radius_squared = std::max(1.0f - cap_z * cap_z, 0.0f);
            const float x = std::sqrt(radius_squared) * lattice.cosine[i];
            const float y_squared = std::max(radius_squared - x * x, 0.0f);
            const float nx = alpha * (x + view.x);
            const float nz = std::max(cap_z + view.z, 0.0f);
            const float scale =
                1.0f / std::sqrt(nx * nx + alpha * alpha * y_squared + nz * nz + 1e-30f);
            z[i] = nz * scale;
            cosine[i] = std::max((nx * wo.x + nz * wo.z) * scale, 0.0f);
        }
    }
};

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

// Cosine-weighted mean of an albedo tabled over the square root t of mu: the integral of 2 mu E dmu
// is that of 4 t^3 E dt, by the midpoint rule on the interpolant.
template <class Albedo>
[[nodiscard]] float average_over_directions(const Albedo& albedo, std::size_t count) {
    constexpr int kSteps = 256;
    float sum = 0.0f;
    for (int i = 0; i < kSteps; ++i) {
        const float t = (static_cast<float>(i) + 0.5f) / static_cast<float>(kSteps);
        const AxisPosition p = axis_position(t, count);
        sum += 4.0f * t * t * t * lerp(albedo(p.lower), albedo(p.lower + 1), p.fraction);
    }
    return sum / static_cast<float>(kSteps);
}

struct ReflectionTables {
    std::array<std::array<float, kFine>, kFine> albedo{};  // [rough][sqrt mu]
    std::array<float, kFine> average{};

    ReflectionTables() {
        const CapLattice<kFineSamples> lattice;
        for (std::size_t r = 0; r < kFine; ++r) {
            const float alpha = std::max(sqr(node(r, kFine)), kMinAlpha);
            for (std::size_t m = 0; m < kFine; ++m) {
                albedo[r][m] = integrate(lattice, view_direction(m, kFine), alpha);
            }
            average[r] =
                average_over_directions([this, r](std::size_t m) { return albedo[r][m]; }, kFine);
        }
    }

    [[nodiscard]] static float integrate(const CapLattice<kFineSamples>& lattice,
                                         const Vec3& wo,
                                         float alpha) {
        const VisibleNormals<kFineSamples> h(lattice, wo, alpha);
        const float so = smith_s_isotropic(wo.z, alpha);
        std::array<float, kFineSamples> weight;
        for (std::size_t i = 0; i < weight.size(); ++i) {
            weight[i] = masking_weight(wo.z, so, 2.0f * h.cosine[i] * h.z[i] - wo.z, alpha);
        }
        float sum = 0.0f;
        for (const float w : weight) {
            sum += w;
        }
        return sum / static_cast<float>(kFineSamples);
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
    std::array<std::array<CoarseRow, kCoarse>, 2> glass_average{};  // [inverse][rough][z]

    DielectricTables() {
        const CapLattice<kCoarseSamples> lattice;
        for (std::size_t inverse = 0; inverse < 2; ++inverse) {
            CoarseRow eta;
            for (std::size_t k = 0; k < kCoarse; ++k) {
                eta[k] = node_eta(k, inverse != 0);
            }
            for (std::size_t r = 0; r < kCoarse; ++r) {
                for (std::size_t m = 0; m < kCoarse; ++m) {
                    const float alpha = std::max(sqr(node(r, kCoarse)), kMinAlpha);
                    const Vec3 wo = view_direction(m, kCoarse);
                    const VisibleNormals<kCoarseSamples> h(lattice, wo, alpha);
                    integrate(h, {eta, wo.z, alpha}, glass[inverse][r][m], shape[inverse][r][m]);
                }
                for (std::size_t k = 0; k < kCoarse; ++k) {
                    const auto& table = glass[inverse][r];
                    glass_average[inverse][r][k] = average_over_directions(
                        [&table, k](std::size_t m) { return table[m][k]; }, kCoarse);
                }
            }
        }
    }

    struct Setting {
        CoarseRow eta;
        float mu;
        float alpha;
    };

    // One row over all indices: every visible normal serves all of them.
    static void integrate(const VisibleNormals<kCoarseSamples>& h,
                          const Setting& setting,
                          CoarseRow& glass_row,
                          CoarseRow& shape_row) {
        const float so = smith_s_isotropic(setting.mu, setting.alpha);
        CoarseRow inverse;
        CoarseRow f0;
        for (std::size_t k = 0; k < kCoarse; ++k) {
            inverse[k] = 1.0f / setting.eta[k];
            f0[k] = f0_from_eta(setting.eta[k]);
        }
        CoarseRow glass{};
        CoarseRow shape{};
        float reflected = 0.0f;
        for (std::size_t i = 0; i < h.z.size(); ++i) {
            const float oh = std::max(h.cosine[i], 1e-6f);
            const float weight =
                masking_weight(setting.mu, so, 2.0f * oh * h.z[i] - setting.mu, setting.alpha);
            reflected += weight;
            for (std::size_t k = 0; k < kCoarse; ++k) {
                // Walter's g is eta times the refracted cosine; zero at total reflection gives F
                // = 1.
                const float eta = setting.eta[k];
                const float g = std::sqrt(std::max((eta - 1.0f) * (eta + 1.0f) + oh * oh, 0.0f));
                const float a = (g - oh) / (g + oh);
                const float b = (oh * (g + oh) - 1.0f) / (oh * (g - oh) + 1.0f);
                const float f = std::min(0.5f * a * a * (1.0f + b * b), 1.0f);
                // Cosine of the refracted direction below the surface.
                const float below = (setting.mu - (oh - g) * h.z[i]) * inverse[k];
                glass[k] +=
                    f * weight + (1.0f - f) * masking_weight(setting.mu, so, below, setting.alpha);
                shape[k] += std::max(f - f0[k], 0.0f) * weight;
            }
        }
        for (std::size_t k = 0; k < kCoarse; ++k) {
            glass_row[k] = glass[k] / static_cast<float>(kCoarseSamples);
            shape_row[k] =
                reflected > 0.0f ? saturate(shape[k] / (reflected * (1.0f - f0[k]))) : 1.0f;
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

[[nodiscard]] AxisPosition index_position(float eta) {
    return axis_position(std::sqrt(std::abs(eta - 1.0f) / (eta + 1.0f)), kCoarse);
}

[[nodiscard]] float interpolate(const Coarse3& table, float mu, float rough, float eta) {
    const AxisPosition r = axis_position(rough, kCoarse);
    const AxisPosition m = axis_position(std::sqrt(saturate(mu)), kCoarse);
    const AxisPosition z = index_position(eta);
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

float ggx_glass_average_albedo(float rough, float eta) {
    const auto& table = dielectric_tables().glass_average[eta < 1.0f ? 1 : 0];
    const AxisPosition r = axis_position(rough, kCoarse);
    const AxisPosition z = index_position(eta);
    const CoarseRow& low = table[r.lower];
    const CoarseRow& high = table[r.lower + 1];
    return lerp(lerp(low[z.lower], low[z.lower + 1], z.fraction),
                lerp(high[z.lower], high[z.lower + 1], z.fraction),
                r.fraction);
}

float ggx_dielectric_shape(float mu, float rough, float eta) {
    return interpolate(dielectric_tables().shape[eta < 1.0f ? 1 : 0], mu, rough, eta);
}

}  // namespace pharos
