// von Mises-Fisher lobes in float32: p(w) = kappa / (2 pi (1 - exp(-2 kappa))) exp(-kappa |w -
// mu|^2 / 2).
//
// The chord |w - mu|^2 replaces 1 - dot(w, mu), which cancels (Tokuyoshi 2025, "A Numerically
// Stable Implementation of the von Mises-Fisher Distribution on S^2"); expm1 and log1p replace
// Jakob's form of sampling. Relative error of the pdf <= 4e-7 (2 + kappa |w - mu|^2 / 2) for kappa
// in [0, 1e7]. kappa outside is clamped: negative and NaN to 0 (uniform), above 1e7 and infinite to
// 1e7. mu and w are unit vectors; the pdf is per solid angle. The vector forms over F (vmf-inl.h)
// are the same source: namespace pharos::vmf.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/math.h"

namespace pharos {
inline constexpr float kMaxKappa = 1e7f;
}

// Always inlined, in a namespace per instruction set: a file built for AVX2 and one built for the
// baseline must not be given each other's copy by the linker.
#define PHAROS_SIMD_INLINE [[gnu::always_inline, nodiscard]] inline
#if defined(__AVX512F__)
#define PHAROS_ISA_NAMESPACE isa_avx512
#elif defined(__AVX2__)
#define PHAROS_ISA_NAMESPACE isa_avx2
#else
#define PHAROS_ISA_NAMESPACE isa_baseline
#endif
namespace pharos {
inline namespace PHAROS_ISA_NAMESPACE {}
}  // namespace pharos

// Vectors pass by value only between functions that are always inlined: there is no call whose ABI
// could change. GCC warns at the end of the file, so the setting has to last until there.
#pragma GCC diagnostic ignored "-Wpsabi"
#define PHAROS_SIMD_NAMESPACE PHAROS_ISA_NAMESPACE
// clang-format off
#include "guiding/simd_math-inl.h"
#include "guiding/vmf-inl.h"
// clang-format on
#undef PHAROS_SIMD_NAMESPACE

namespace pharos {
inline namespace PHAROS_ISA_NAMESPACE {

struct VmfLobe {
    Vec3 mu{0.0f, 0.0f, 1.0f};
    float kappa = 0.0f;
};

PHAROS_SIMD_INLINE float vmf_pdf(const VmfLobe& lobe, const Vec3& w) {
    return vmf::pdf<float>(vmf::clamp_kappa(lobe.kappa), length_squared(w - lobe.mu));
}

PHAROS_SIMD_INLINE float vmf_log_pdf(const VmfLobe& lobe, const Vec3& w) {
    return vmf::log_pdf<float>(vmf::clamp_kappa(lobe.kappa), length_squared(w - lobe.mu));
}

// Direction with density vmf_pdf; u in [0, 1)^2.
PHAROS_SIMD_INLINE Vec3 sample_vmf(const VmfLobe& lobe, const Vec2& u) {
    return vmf::sample(lobe.mu, lobe.kappa, u);
}

struct VmfGradient {
    Vec3 mu{0.0f};           // tangential: d log p / d mu on the sphere
    float log_kappa = 0.0f;  // d log p / d log kappa
};

PHAROS_SIMD_INLINE VmfGradient vmf_log_pdf_gradient(const VmfLobe& lobe, const Vec3& w) {
    const float kappa = vmf::clamp_kappa(lobe.kappa);
    const Vec3 e = w - lobe.mu;  // the component along mu drops out exactly, so w - mu serves for w
    const float ratio = vmf::two_kappa_over_one_minus_exp<float>(kappa);
    return {kappa * (e - lobe.mu * glm::dot(lobe.mu, e)),
            vmf::dlogpdf_dlogkappa<float>(kappa, ratio, length_squared(e))};
}

// exp(-ka |w - a|^2 / 2) exp(-kb |w - b|^2 / 2) = exp(log_scale) exp(-k |w - mu|^2 / 2).
struct VmfProduct {
    VmfLobe lobe;
    float log_scale = 0.0f;  // = k - ka - kb <= 0, without its cancellation
};

PHAROS_SIMD_INLINE VmfProduct vmf_product(const VmfLobe& a, const VmfLobe& b) {
    const float ka = vmf::clamp_kappa(a.kappa);
    const float kb = vmf::clamp_kappa(b.kappa);
    const Vec3 v = ka * a.mu + kb * b.mu;
    const float k = __builtin_sqrtf(length_squared(v));
    const float sum = k + ka + kb;
    const float exponent = sum > 0.0f ? -ka * kb * length_squared(a.mu - b.mu) / sum : 0.0f;
    return {{k > 1e-20f ? v * (1.0f / k) : a.mu, k}, exponent};
}

// Mean of cos(w, mu): coth(kappa) - 1 / kappa, by its series below 1.
PHAROS_SIMD_INLINE float vmf_mean_cosine(float kappa) {
    const float k = vmf::clamp_kappa(kappa);
    if (k < 1.0f) {
        const float k2 = k * k;
        float series = -2.16440428e-6f * k2 + 2.13779916e-5f;
        series = series * k2 - 2.11640212e-4f;
        series = series * k2 + 2.11640212e-3f;
        series = series * k2 - 2.22222222e-2f;
        return (series * k2 + 0.333333333f) * k;
    }
    const float ratio = vmf::two_kappa_over_one_minus_exp<float>(k) * simd::exp<float>(-2.0f * k);
    return 1.0f - (1.0f - ratio) / k;
}

// Inverse of vmf_mean_cosine for mean cosines in [0, 1): start of Banerjee et al. 2005 (eq. 4.4),
// then Newton steps with A' = 1 - A^2 - 2 A / kappa.
[[nodiscard]] inline float vmf_kappa_from_mean_cosine(float mean_cosine) {
    const double r =
        mean_cosine > 0.0f ? std::min(static_cast<double>(mean_cosine), 1.0 - 1e-7) : 0.0;
    if (r < 1e-3) {
        return static_cast<float>(3.0 * r);
    }
    double k = (3.0 * r - r * r * r) / (1.0 - r * r);
    for (int step = 0; step < 4; ++step) {
        const double mean = 1.0 / std::tanh(k) - 1.0 / k;
        const double slope = 1.0 - mean * mean - 2.0 * mean / k;
        k = std::max(k - (mean - r) / std::max(slope, 1e-300), 1e-6);
    }
    return static_cast<float>(std::min(k, static_cast<double>(kMaxKappa)));
}

}  // namespace PHAROS_ISA_NAMESPACE
}  // namespace pharos
