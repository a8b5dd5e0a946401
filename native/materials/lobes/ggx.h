// GGX reflection, refraction and glass (Walter et al. 2007; masking as in microfacet.h).
//
//   reflection  f cos = F D G2 / (4 zo),   pdf = D / (2 (k zo + so))  (bounded visible normals)
//   refraction  h ~ -(wo + eta wi), dh/dwi = eta^2 |wi.h| / (wo.h + eta wi.h)^2,
//               f cos = T D G2 (wo.h / zo) dh/dwi,   pdf = p_T D G1 (wo.h / zo) dh/dwi
//   glass       both with one half vector; reflects with probability avg(R) / avg(R + T)
// Radiance is not scaled by eta^2. Singular closures are not for these functions.
#pragma once

#include <optional>

#include "core/color.h"
#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/fresnel.h"
#include "materials/microfacet.h"

namespace pharos {

namespace detail {

// What both directions and the half vector give; local coordinates only for anisotropic lobes.
struct GgxTerms {
    float d = 0.0f;
    float so = 0.0f;
    float si = 0.0f;
};

[[nodiscard]] inline Vec3 closure_local(const Closure& c, const Vec3& w) {
    return Vec3(glm::dot(c.tangent, w), glm::dot(glm::cross(c.n, c.tangent), w), glm::dot(c.n, w));
}

[[nodiscard]] inline GgxTerms ggx_terms(const Closure& c,
                                        const Vec3& wo,
                                        const Vec3& wi,
                                        const Vec3& h) {
    if (c.alpha_x == c.alpha_y) {
        const float zh = glm::dot(c.n, h);
        const float sin_squared = length_squared(h - c.n * zh);
        return {ggx_d_isotropic(zh, sin_squared, c.alpha_x),
                smith_s_isotropic(glm::dot(c.n, wo), c.alpha_x),
                smith_s_isotropic(glm::dot(c.n, wi), c.alpha_x)};
    }
    return {ggx_d(closure_local(c, h), c.alpha_x, c.alpha_y),
            smith_s(closure_local(c, wo), c.alpha_x, c.alpha_y),
            smith_s(closure_local(c, wi), c.alpha_x, c.alpha_y)};
}

[[nodiscard]] inline Frame closure_frame(const Closure& c) {
    if (c.alpha_x == c.alpha_y) {
        return Frame::from_z(c.n);
    }
    return {c.tangent, glm::cross(c.n, c.tangent), c.n};
}

}  // namespace detail

[[nodiscard]] inline BsdfEval eval_ggx_reflection(const Closure& c,
                                                  const Vec3& wo,
                                                  const Vec3& wi) {
    const float zo = glm::dot(c.n, wo);
    const float zi = glm::dot(c.n, wi);
    if (!(zo > 0.0f) || !(zi > 0.0f)) {
        return {};
    }
    const Vec3 h = glm::normalize(wo + wi);
    const detail::GgxTerms g = detail::ggx_terms(c, wo, wi, h);
    const float bound = vndf_bound(zo, std::min(c.alpha_x, c.alpha_y));
    const float visibility = smith_visibility(zo, g.so, zi, g.si, c.smith != 0);
    const Rgb f = closure_reflectance(c, glm::dot(wo, h));
    return {c.weight * f * (c.energy_scale * g.d * visibility * zi),
            0.5f * g.d / (bound * zo + g.so)};
}

[[nodiscard]] inline std::optional<Vec3> sample_ggx_reflection(const Closure& c,
                                                               const Vec3& wo,
                                                               const Vec2& u) {
    const Frame frame = detail::closure_frame(c);
    const Vec3 local = frame.to_local(wo);
    if (!(local.z > 0.0f)) {
        return std::nullopt;
    }
    const float bound = vndf_bound(local.z, std::min(c.alpha_x, c.alpha_y));
    const Vec3 h = frame.to_world(sample_visible_normal(local, c.alpha_x, c.alpha_y, bound, u));
    return h * (2.0f * glm::dot(wo, h)) - wo;
}

namespace detail {

// Probability that glass reflects at a microfacet.
[[nodiscard]] inline float reflect_probability(const FresnelSplit& split) {
    const float r = average(split.reflected);
    const float t = average(split.transmitted);
    return r + t > 0.0f ? r / (r + t) : 0.0f;
}

}  // namespace detail

[[nodiscard]] inline BsdfEval eval_ggx_glass(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const float zo = glm::dot(c.n, wo);
    const float zi = glm::dot(c.n, wi);
    if (!(zo > 0.0f) || zi == 0.0f) {
        return {};
    }
    const bool reflects = zi > 0.0f;
    Vec3 h = reflects ? wo + wi : wo + wi * c.eta;
    h = normalize_or(h, c.n);
    h = glm::dot(h, c.n) < 0.0f ? -h : h;
    const float oh = glm::dot(wo, h);
    const float ih = glm::dot(wi, h);
    if (!(oh > 0.0f) || (ih > 0.0f) != reflects) {
        return {};
    }
    const detail::GgxTerms g = detail::ggx_terms(c, wo, wi, h);
    const FresnelSplit split = closure_fresnel_split(c, oh);
    const float reflect = detail::reflect_probability(split);
    const float visible_pdf =
        2.0f * g.d / (zo + g.so);  // D G1 / zo: density of h is this times wo.h
    if (reflects) {
        const float visibility = smith_visibility(zo, g.so, zi, g.si, c.smith != 0);
        return {c.weight * split.reflected * (c.energy_scale * g.d * visibility * zi),
                0.25f * visible_pdf * reflect};
    }
    // G2 / zo = 4 |zi| visibility.
    const float visibility = smith_visibility(zo, g.so, -zi, g.si, c.smith != 0);
    const float denominator = sqr(oh + c.eta * ih);
    if (!(denominator > 0.0f)) {
        return {};
    }
    const float jacobian = c.eta * c.eta * -ih * oh / denominator;
    return {
        c.weight * split.transmitted * (c.energy_scale * g.d * 4.0f * -zi * visibility * jacobian),
        visible_pdf * jacobian * (1.0f - reflect)};
}

// u_branch decides between reflection and refraction; a direction that ends up on the other side of
// the surface than its branch says is lost.
[[nodiscard]] inline std::optional<Vec3> sample_ggx_glass(const Closure& c,
                                                          const Vec3& wo,
                                                          float u_branch,
                                                          const Vec2& u) {
    const Frame frame = detail::closure_frame(c);
    const Vec3 local = frame.to_local(wo);
    if (!(local.z > 0.0f)) {
        return std::nullopt;
    }
    const Vec3 h = frame.to_world(sample_visible_normal(local, c.alpha_x, c.alpha_y, 1.0f, u));
    const float oh = glm::dot(wo, h);
    if (!(oh > 0.0f)) {
        return std::nullopt;
    }
    if (u_branch < detail::reflect_probability(closure_fresnel_split(c, oh))) {
        const Vec3 mirrored = h * (2.0f * oh) - wo;
        return glm::dot(c.n, mirrored) > 0.0f ? std::optional(mirrored) : std::nullopt;
    }
    const float cosine = refracted_cosine(oh, c.eta);
    if (cosine < 0.0f) {
        return std::nullopt;
    }
    const Vec3 refracted = glm::normalize(h * (oh / c.eta - cosine) - wo * (1.0f / c.eta));
    return glm::dot(c.n, refracted) < 0.0f ? std::optional(refracted) : std::nullopt;
}

}  // namespace pharos
