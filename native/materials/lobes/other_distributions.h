// Microfacets that are not GGX, as bits of Closure::smith.
//
// Beckmann: D = exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4), Smith's masking by the rational fit of
// Walter et al. 2007 (equation 18; as shadowing 1 / (1 + Lambda)). Its half vectors are chosen as
// GGX chooses them, whose tails are longer: the ratio of the two distributions is at most 4 / e.
//
// Ashikhmin and Shirley 2000, without their Fresnel term and with the exponent 2 / alpha^2 - 2:
//   f cos = D' zi / ((wo.h) max(zo, zi)),  pdf = D' / (wo.h),
//   D' = sqrt((nx + 1) (ny + 1)) / (8 pi) zh^(nx cos^2 phi + ny sin^2 phi)
#pragma once

#include "materials/lobes/ggx.h"

namespace pharos {

namespace detail {

// Lambda + 1 of a direction, in the local frame.
[[nodiscard]] inline float beckmann_masking(const Closure& c, const Vec3& w) {
    const float squared = sqr(c.alpha_x * w.x) + sqr(c.alpha_y * w.y);
    const float slope = std::sqrt(squared) / std::abs(w.z);
    if (!(slope > 0.625f)) {
        return 1.0f;
    }
    const float a = 1.0f / slope;
    return 1.0f + (1.0f - 1.259f * a + 0.396f * a * a) / (3.535f * a + 2.181f * a * a);
}

[[nodiscard]] inline float beckmann_d(const Vec3& h, float alpha_x, float alpha_y) {
    const float z2 = h.z * h.z;
    const float slope2 = (sqr(h.x / alpha_x) + sqr(h.y / alpha_y)) / z2;
    return std::exp(-slope2) * kInvPi / (alpha_x * alpha_y * z2 * z2);
}

// Distribution times masking over that of GGX with the same roughness; z of the directions has any
// sign, as in a refraction.
[[nodiscard]] inline float beckmann_over_ggx(const Closure& c,
                                             const Vec3& wo,
                                             const Vec3& wi,
                                             const Vec3& h) {
    const Frame frame = closure_frame(c);
    const Vec3 local_o = frame.to_local(wo);
    const Vec3 local_i = frame.to_local(wi);
    const Vec3 local_h = frame.to_local(h);
    if (!(local_h.z > 0.0f)) {
        return 0.0f;
    }
    const bool separable = (c.smith & kSeparableMasking) != 0;
    const float mo = beckmann_masking(c, local_o);
    const float mi = beckmann_masking(c, local_i);
    const GgxTerms g = ggx_terms(c, wo, wi, h);
    const float zo = local_o.z;
    const float zi = std::abs(local_i.z);
    // What eval_ggx_* have put in takes any set bit for separable masking.
    const float ggx = g.d * smith_visibility(zo, g.so, zi, g.si, true);
    const float masking = 1.0f / (separable ? mo * mi : mo + mi - 1.0f);
    const float ours = beckmann_d(local_h, c.alpha_x, c.alpha_y) * masking / (4.0f * zo * zi);
    return ggx > 0.0f ? ours / ggx : 0.0f;
}

}  // namespace detail

[[nodiscard]] inline BsdfEval eval_beckmann(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const bool mirror_only = c.type == ClosureType::GgxReflection;
    BsdfEval e = mirror_only ? eval_ggx_reflection(c, wo, wi) : eval_ggx_glass(c, wo, wi);
    if (e.pdf > 0.0f) {
        const Vec3 sum = glm::dot(c.n, wi) > 0.0f ? wo + wi : wo + wi * c.eta;
        const Vec3 h = normalize_or(sum, c.n);
        e.f_cos *= detail::beckmann_over_ggx(c, wo, wi, glm::dot(h, c.n) < 0.0f ? -h : h);
    }
    return e;
}

namespace detail {

[[nodiscard]] inline float ashikhmin_exponent(float alpha) {
    return std::max(2.0f / sqr(std::max(alpha, 1e-4f)) - 2.0f, 0.0f);
}

}  // namespace detail

[[nodiscard]] inline BsdfEval eval_ashikhmin_shirley(const Closure& c,
                                                     const Vec3& wo,
                                                     const Vec3& wi) {
    const Frame frame = detail::closure_frame(c);
    const Vec3 local_o = frame.to_local(wo);
    const Vec3 local_i = frame.to_local(wi);
    if (!(local_o.z > 0.0f) || !(local_i.z > 0.0f)) {
        return {};
    }
    const Vec3 h = glm::normalize(local_o + local_i);
    const float oh = std::max(glm::dot(local_o, h), 1e-6f);
    const float nx = detail::ashikhmin_exponent(c.alpha_x);
    const float ny = detail::ashikhmin_exponent(c.alpha_y);
    const float sin2 = h.x * h.x + h.y * h.y;
    const float exponent = sin2 > 0.0f ? (nx * h.x * h.x + ny * h.y * h.y) / sin2 : nx;
    // zh^e by its logarithm, exact for narrow lobes: zh^2 = 1 - sin^2.
    const float lobe = std::exp(0.5f * exponent * std::log1p(-std::min(sin2, 0.9999999f)));
    const float pdf = std::sqrt((nx + 1.0f) * (ny + 1.0f)) * (0.125f * kInvPi) * lobe / oh;
    const float cosine = local_i.z / std::max(local_o.z, local_i.z);
    return {c.weight * closure_reflectance(c, oh) * (c.energy_scale * pdf * cosine), pdf};
}

[[nodiscard]] inline std::optional<Vec3> sample_ashikhmin_shirley(const Closure& c,
                                                                  const Vec3& wo,
                                                                  const Vec2& u) {
    const Frame frame = detail::closure_frame(c);
    const float nx = detail::ashikhmin_exponent(c.alpha_x);
    const float ny = detail::ashikhmin_exponent(c.alpha_y);
    // The angle within its quadrant, stretched: tan phi = sqrt((nx + 1) / (ny + 1)) tan(turn).
    const SinCos turn = sincos_turns(u.x);
    const float stretch = std::sqrt((nx + 1.0f) / (ny + 1.0f));
    const Vec2 phi = glm::normalize(Vec2(turn.cos, stretch * turn.sin));
    const float exponent = nx * phi.x * phi.x + ny * phi.y * phi.y;
    const float log_z = std::log1p(-std::min(u.y, kOneMinusEpsilon)) / (exponent + 1.0f);
    const float sine = std::sqrt(-std::expm1(2.0f * log_z));
    const Vec3 h = frame.to_world(Vec3(phi.x * sine, phi.y * sine, std::exp(log_z)));
    const float oh = glm::dot(wo, h);
    return oh > 0.0f ? std::optional(glm::normalize(h * (2.0f * oh) - wo)) : std::nullopt;
}

}  // namespace pharos
