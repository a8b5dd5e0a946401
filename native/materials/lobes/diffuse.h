// Diffuse lobes, all sampled by the cosine: Lambert, Fujii's Oren-Nayar, Disney 2015, translucent.
//
//   Oren-Nayar  Y. Fujii's qualitative form with the denominator max(nl, nv); the multiple
//   scattering
//               of Portsmouth, Kutz, Hill 2024 (EON) is folded into Closure::f0 for wo:
//               f cos = weight nl (a + b t + f0 (1 - E(nl)))
//   Disney      Burley 2015, base diffuse times Fresnel plus retro-reflection (cycles-parity 2.8)
//   Bump        where the closure's normal is not the interpolated one, a factor softens the
//               terminator (cycles-parity 2.5). Set-up then stores the interpolated normal in
//               Closure::tangent, the kind in Closure::smith and its alpha^2 in Closure::alpha_x.
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"

namespace pharos {

inline constexpr std::uint8_t kBumpPolynomial = 1;  // Blender up to 4.4
inline constexpr std::uint8_t kBumpMasking = 2;     // 4.5

// Factor on f of a closure with a bumped normal; 1 for others (Closure::smith = 0).
[[nodiscard]] inline float bump_terminator(const Closure& c, const Vec3& wi) {
    const float smooth = glm::dot(c.tangent, wi);
    const float bumped = glm::dot(c.n, wi);
    if (!(smooth * bumped > 0.0f)) {
        return 0.0f;
    }
    if (c.smith == kBumpMasking) {
        // Smith masking by a surface as rough as the two normals differ.
        const float z = std::abs(smooth);
        return 2.0f * z / (z + std::sqrt(z * z + c.alpha_x * std::max(1.0f - z * z, 0.0f)));
    }
    const float g = smooth / (bumped * std::max(glm::dot(c.n, c.tangent), 1e-6f));
    return g >= 1.0f ? 1.0f : g + g * g - g * g * g;
}

[[nodiscard]] inline float bump_factor(const Closure& c, const Vec3& wi) {
    return c.smith == 0 ? 1.0f : bump_terminator(c, wi);
}

[[nodiscard]] inline BsdfEval eval_lambert(const Closure& c, const Vec3& wi) {
    const float pdf = std::max(glm::dot(c.n, wi), 0.0f) * kInvPi;
    return {c.weight * (pdf * bump_factor(c, wi)), pdf};
}

[[nodiscard]] inline BsdfEval eval_translucent(const Closure& c, const Vec3& wi) {
    const float pdf = std::max(-glm::dot(c.n, wi), 0.0f) * kInvPi;
    return {c.weight * (pdf * bump_factor(c, wi)), pdf};
}

// a and b of f = a + b t.
struct OrenNayarTerms {
    float a;
    float b;
};

[[nodiscard]] inline OrenNayarTerms oren_nayar_terms(float sigma) {
    const float a = 1.0f / (kPi + sigma * (0.5f * kPi - 2.0f / 3.0f));
    return {a, sigma * a};
}

// Integral of t over the hemisphere (EON, appendix): a pi + b G is the directional albedo.
[[nodiscard]] inline float oren_nayar_g(float cosine) {
    constexpr float kGrazing = 0.5f * kPi - 2.0f / 3.0f;
    const float c = std::min(cosine, 1.0f);
    if (c < 1e-4f) {
        return kGrazing - c;
    }
    const float s = safe_sqrt(1.0f - c * c);
    return s * (std::acos(c) - 2.0f / 3.0f - s * c) + 2.0f / 3.0f * (s / c) * (1.0f - s * s * s);
}

[[nodiscard]] inline float oren_nayar_albedo(const OrenNayarTerms& terms, float cosine) {
    return terms.a * kPi + terms.b * oren_nayar_g(cosine);
}

[[nodiscard]] inline BsdfEval eval_oren_nayar(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const float nl = glm::dot(c.n, wi);
    if (!(nl > 0.0f)) {
        return {};
    }
    const OrenNayarTerms terms = oren_nayar_terms(c.parameter);
    const float nv = std::max(glm::dot(c.n, wo), 0.0f);
    float t = glm::dot(wi, wo) - nl * nv;
    if (t > 0.0f) {
        t /= std::max(std::max(nl, nv), 1e-20f);
    }
    Rgb f(std::max(terms.a + terms.b * t, 0.0f));
    if (!is_zero(c.f0)) {
        f += c.f0 * std::max(1.0f - oren_nayar_albedo(terms, nl), 0.0f);
    }
    return {c.weight * f * (nl * bump_factor(c, wi)), nl * kInvPi};
}

[[nodiscard]] inline float schlick_weight(float cosine) {
    const float m = saturate(1.0f - cosine);
    return sqr(sqr(m)) * m;
}

[[nodiscard]] inline BsdfEval eval_disney_diffuse(const Closure& c,
                                                  const Vec3& wo,
                                                  const Vec3& wi) {
    const float nl = glm::dot(c.n, wi);
    if (!(nl > 0.0f)) {
        return {};
    }
    const float fl = schlick_weight(nl);
    const float fv = schlick_weight(std::max(glm::dot(c.n, wo), 0.0f));
    // 2 rough cos^2 of the half angle, from the angle between the directions.
    const float rr = c.parameter * (glm::dot(wi, wo) + 1.0f);
    const float base = (1.0f - 0.5f * fl) * (1.0f - 0.5f * fv);
    const float retro = rr * (fl + fv + fl * fv * (rr - 1.0f));
    const float pdf = nl * kInvPi;
    return {c.weight * (std::max(base + retro, 0.0f) * pdf * bump_factor(c, wi)), pdf};
}

}  // namespace pharos
