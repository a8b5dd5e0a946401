// A mixture of up to eight vMF lobes: what the guiding field says about one vertex, and how it is
// sampled. Plain data, lobes in SIMD lanes; no allocation, no dispatch, everything inlines.
//
// Contract: weights sum to 1 over the lobes; unused lobes are all zero but mu = (0, 0, 1).
// mixture_pdf is per solid angle over the full sphere and is the density of sample_mixture: always
// use these two together, at one snapshot. The inline forms cost about 10 ns; the span forms do the
// same in a loop.
#pragma once

#include <span>

#include "core/math.h"
#include "guiding/vmf.h"

namespace pharos {

inline constexpr int kMaxLobes = 8;

struct alignas(32) VmfMixture {
    float weight[kMaxLobes] = {1.0f};
    float mu_x[kMaxLobes] = {};
    float mu_y[kMaxLobes] = {};
    float mu_z[kMaxLobes] = {1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f};
    float kappa[kMaxLobes] = {};
    // weight * kappa / (2 pi (1 - exp(-2 kappa))): the lobe's density at its centre
    float coefficient[kMaxLobes] = {0.0795774715f};
    // Integral of the learned quantity over the sphere: of luminance * |cos| by default
    // (irradiance-like)
    float A = 0.0f;
    // pi times what comes in along the lobe of the material that the mixture was multiplied by, A
    // where there is none: times albedo / pi it is the radiance that leaves.
    float expected = 0.0f;
    std::int32_t lobe_count = 1;

    [[nodiscard]] VmfLobe lobe(int k) const { return {Vec3(mu_x[k], mu_y[k], mu_z[k]), kappa[k]}; }
};

// Sets a lobe from its parameters, with its coefficient. The caller keeps the weights' sum at 1.
inline void set_lobe(VmfMixture& mixture, int k, float weight, const VmfLobe& lobe) {
    mixture.weight[k] = weight;
    mixture.mu_x[k] = lobe.mu.x;
    mixture.mu_y[k] = lobe.mu.y;
    mixture.mu_z[k] = lobe.mu.z;
    mixture.kappa[k] = vmf::clamp_kappa(lobe.kappa);
    mixture.coefficient[k] = weight * vmf::normalization<float>(mixture.kappa[k]);
}

}  // namespace pharos

#define PHAROS_SIMD_NAMESPACE PHAROS_ISA_NAMESPACE
#include "guiding/mixture-inl.h"  // mixture_pdf, sample_mixture, choose_lobe
#undef PHAROS_SIMD_NAMESPACE

namespace pharos {
inline namespace PHAROS_ISA_NAMESPACE {

// The mixture times exp(kappa_b (dot(w, axis) - 1)), renormalised: closed form, since the product
// of two vMF lobes is one. For a reflecting lobe of the material: axis = reflect(wo, n) and kappa_b
// = product_kappa(). Where everything underflows, the mixture before the product. A is kept,
// `expected` is that of the product.
[[nodiscard]] inline VmfMixture multiply_lobe(const VmfMixture& mixture,
                                              const Vec3& axis,
                                              float kappa_b) {
    const float kb = vmf::clamp_kappa(kappa_b);
    const Lobes8 mx = load_lobes(mixture.mu_x);
    const Lobes8 my = load_lobes(mixture.mu_y);
    const Lobes8 mz = load_lobes(mixture.mu_z);
    const Lobes8 kappa = load_lobes(mixture.kappa);
    const Lobes8 coefficient = load_lobes(mixture.coefficient);
    const Lobes8 dx = mx - axis.x;
    const Lobes8 dy = my - axis.y;
    const Lobes8 dz = mz - axis.z;
    const Lobes8 vx = kappa * mx + kb * axis.x;
    const Lobes8 vy = kappa * my + kb * axis.y;
    const Lobes8 vz = kappa * mz + kb * axis.z;
    const Lobes8 product_kappa =
        simd::min(simd::sqrt<Lobes8>(vx * vx + vy * vy + vz * vz), Lobes8{} + kMaxKappa);
    // e_k = kappa' - kappa - kappa_b = -kappa kappa_b |mu - axis|^2 / (kappa' + kappa + kappa_b),
    // so that large kappas do not cancel; the largest is taken out before exp.
    const Lobes8 sum = simd::max(product_kappa + kappa + kb, Lobes8{} + 1e-20f);
    const Lobes8 exponent = -kappa * kb * (dx * dx + dy * dy + dz * dz) / sum;
    const float largest =
        largest_lobe(simd::select(coefficient > 0.0f, exponent, Lobes8{} - 1e30f));
    const Lobes8 scaled = coefficient * simd::exp<Lobes8>(simd::min(exponent - largest, Lobes8{}));
    const Lobes8 normalization = vmf::normalization<Lobes8>(product_kappa);
    const Lobes8 mass = scaled / normalization;
    const float total = sum_of_lobes(mass);
    if (!(total > 1e-30f && total < 1e30f)) {
        return mixture;
    }
    VmfMixture result;
    const Lobes8 weight = mass * (1.0f / total);
    const Lobes8 inverse = 1.0f / simd::max(product_kappa, Lobes8{} + 1e-12f);
    const auto degenerate = product_kappa < 1e-6f;
    *reinterpret_cast<Lobes8*>(result.weight) = weight;
    *reinterpret_cast<Lobes8*>(result.mu_x) = simd::select(degenerate, mx, vx * inverse);
    *reinterpret_cast<Lobes8*>(result.mu_y) = simd::select(degenerate, my, vy * inverse);
    *reinterpret_cast<Lobes8*>(result.mu_z) = simd::select(degenerate, mz, vz * inverse);
    *reinterpret_cast<Lobes8*>(result.kappa) = product_kappa;
    *reinterpret_cast<Lobes8*>(result.coefficient) = weight * normalization;
    result.A = mixture.A;
    // Of A, the part that the normalised lobe lets through: the integral of the product of both.
    result.expected = mixture.A * kPi * std::exp(largest) * total * vmf::normalization<float>(kb);
    result.lobe_count = mixture.lobe_count;
    return result;
}

// kappa_b for a GGX reflection lobe of alpha = roughness^2; half of its peak's own, which measured
// better on learned mixtures. Use it for roughness under about 0.25 only.
[[nodiscard]] inline float product_kappa(float alpha, float cos_o) {
    return std::min(2000.0f, 0.25f / (alpha * alpha * std::max(cos_o, 0.3f) + 1e-12f));
}

}  // namespace PHAROS_ISA_NAMESPACE

// The forms over many vertices, dispatched once a call; spans of equal length.
void sample_mixtures(std::span<const VmfMixture> mixtures,
                     std::span<const float> u_lobe,
                     std::span<const Vec2> u,
                     std::span<Vec3> wi);
void mixture_pdfs(std::span<const VmfMixture> mixtures,
                  std::span<const Vec3> wi,
                  std::span<float> pdf);

}  // namespace pharos
