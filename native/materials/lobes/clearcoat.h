// Clearcoat of Principled v1: GTR1 distribution with Smith masking of a fixed alpha of 0.25 and the
// remapped dielectric (Burley 2012, appendix B; cycles-parity 2.8). The factor 0.25 is in the
// weight.
//
//   D = (a^2 - 1) / (pi ln(a^2) (1 + (a^2 - 1) cos^2));  density of h: D cos
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/fresnel.h"
#include "materials/microfacet.h"

namespace pharos {

inline constexpr float kClearcoatMaskingAlpha = 0.25f;
inline constexpr float kClearcoatMinAlpha = 1e-3f;  // GTR1 has no singular limit worth having

// D by sin^2 = 1 - cos^2 of h, which keeps the peak exact: 1 + (a^2 - 1) cos^2 = a^2 + (1 - a^2)
// sin^2.
[[nodiscard]] inline float gtr1_d(float sin_squared, float alpha) {
    const float a2 = alpha * alpha;
    if (a2 >= 0.9999f) {
        return kInvPi;
    }
    return (a2 - 1.0f) * kInvPi / (std::log(a2) * (a2 + (1.0f - a2) * sin_squared));
}

[[nodiscard]] inline BsdfEval eval_clearcoat(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const float zo = glm::dot(c.n, wo);
    const float zi = glm::dot(c.n, wi);
    if (!(zo > 0.0f) || !(zi > 0.0f)) {
        return {};
    }
    const Vec3 h = glm::normalize(wo + wi);
    const float zh = glm::dot(c.n, h);
    const float d = gtr1_d(std::min(length_squared(h - c.n * zh), 1.0f), c.alpha_x);
    const float so = smith_s_isotropic(zo, kClearcoatMaskingAlpha);
    const float si = smith_s_isotropic(zi, kClearcoatMaskingAlpha);
    const float oh = glm::dot(wo, h);
    if (!(oh > 0.0f)) {
        return {};  // opposite grazing directions, whose half vector is rounding alone
    }
    const float pdf = 0.25f * d * zh / oh;
    const float visibility = smith_visibility(zo, so, zi, si, c.smith != 0);
    return {c.weight * closure_reflectance(c, oh) * (d * visibility * zi), pdf};
}

// Half vector around +z.
[[nodiscard]] inline Vec3 sample_gtr1(float alpha, const Vec2& u) {
    const float a2 = alpha * alpha;
    // cos^2 = (1 - a2^(1-u)) / (1 - a2); sin^2 by expm1 so that the peak is not quantised.
    const float log_a2 = std::log(a2);
    const float sin_squared =
        a2 >= 0.9999f ? u.y : saturate(a2 * std::expm1(-u.y * log_a2) / (1.0f - a2));
    const SinCos phi = sincos_turns(u.x);
    const float s = std::sqrt(sin_squared);
    return Vec3(s * phi.cos, s * phi.sin, safe_sqrt(1.0f - sin_squared));
}

}  // namespace pharos
