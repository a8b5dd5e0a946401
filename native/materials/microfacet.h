// GGX microfacets: normal distribution, Smith masking, sampling of visible normals.
//
// Contract: local directions have the closure's normal as z; alpha > 0. Formulas are written with
// s(w) = sqrt(z^2 + (alpha_x x)^2 + (alpha_y y)^2) = z sqrt(1 + alpha^2 tan^2), finite at grazing:
//   G1 = 2 z / (z + s)                                        (Smith, one direction)
//   G2 = 2 zo zi / (zi so + zo si) height-correlated, or G1 G1 separable   (Heitz 2014)
//   visible normals by spherical caps (Dupuy, Benyoub 2023), for reflection bounded so that fewer
//   mirrored directions fall below the surface (Eto, Tokuyoshi 2023).
#pragma once

#include "core/math.h"
#include "sampling/warps.h"

namespace pharos {

inline constexpr float kSingularAlphaProduct = 2e-10f;

// D of a half vector. sin^2 is split into x and y, which keeps lobes of alpha 1e-5 exact.
[[nodiscard]] inline float ggx_d(const Vec3& h, float alpha_x, float alpha_y) {
    const float k = sqr(h.x / alpha_x) + sqr(h.y / alpha_y) + h.z * h.z;
    return kInvPi / (alpha_x * alpha_y * k * k);
}

// Isotropic D from cos and the squared length of h's tangential part.
[[nodiscard]] inline float ggx_d_isotropic(float cosine, float sin_squared, float alpha) {
    const float alpha_squared = alpha * alpha;
    const float k = sin_squared + alpha_squared * cosine * cosine;
    return kInvPi * alpha_squared / (k * k);
}

[[nodiscard]] inline float smith_s(const Vec3& w, float alpha_x, float alpha_y) {
    return std::sqrt(w.z * w.z + sqr(alpha_x * w.x) + sqr(alpha_y * w.y));
}

[[nodiscard]] inline float smith_s_isotropic(float cosine, float alpha) {
    const float a2 = alpha * alpha;
    return std::sqrt(std::min(cosine * cosine * (1.0f - a2) + a2, 1.0f));
}

// G2 / (4 zo zi), the masking as it enters a reflection. One of the cosines may be near zero.
[[nodiscard]] inline float smith_visibility(
    float zo, float so, float zi, float si, bool separable) {
    return separable ? 1.0f / ((zo + so) * (zi + si)) : 0.5f / (zi * so + zo * si);
}

// The share of the spherical cap kept by bounded sampling; 1 is the full cap.
[[nodiscard]] inline float vndf_bound(float zo, float alpha_min) {
    const float a2 = sqr(std::min(alpha_min, 1.0f));
    const float s2 = sqr(1.0f + safe_sqrt(1.0f - zo * zo));
    return (1.0f - a2) * s2 / (s2 + a2 * zo * zo);
}

// Visible normal for wo (z > 0). `bound` from vndf_bound, or 1 for the whole distribution.
//   density of h: D max(wo.h, 0) 2 / (bound zo + so)
[[nodiscard]] inline Vec3 sample_visible_normal(
    const Vec3& wo, float alpha_x, float alpha_y, float bound, const Vec2& u) {
    const Vec3 stretched = glm::normalize(Vec3(alpha_x * wo.x, alpha_y * wo.y, wo.z));
    // A point of the cap above -bound * z; adding the view direction gives the half vector.
    const float b = bound * stretched.z;
    const float z = (1.0f - u.y) * (1.0f + b) - b;
    const float radius = safe_sqrt(1.0f - z * z);
    const SinCos phi = sincos_turns(u.x);
    const Vec3 h = Vec3(radius * phi.cos, radius * phi.sin, z) + stretched;
    return normalize_or(Vec3(alpha_x * h.x, alpha_y * h.y, std::max(h.z, 0.0f)), Vec3(0, 0, 1));
}

}  // namespace pharos
