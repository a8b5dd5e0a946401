// Velvet (Ashikhmin, Premoze, Shirley 2000, "A Microfacet-Based BRDF Generator"): facets that stand
// up like fibres, D = exp(-cot^2 / sigma^2) / (pi sigma^2 sin^4), with the V-groove shadowing of
// Torrance and Sparrow. Directions are chosen evenly over the hemisphere. Closure: parameter =
// sigma.
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"

namespace pharos {

[[nodiscard]] inline BsdfEval eval_velvet(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const float nl = glm::dot(c.n, wi);
    const float nv = glm::dot(c.n, wo);
    if (!(nl > 0.0f) || !(nv > 0.0f)) {
        return {};
    }
    constexpr float kPdf = 0.5f * kInvPi;
    const Vec3 h = normalize_or(wo + wi, c.n);
    const float nh = glm::dot(c.n, h);
    const float vh = std::abs(glm::dot(wo, h));
    // Facets that face the normal or the eye exactly give nothing.
    if (!(vh > 1e-5f) || !(std::abs(nh) < 1.0f - 1e-5f)) {
        return {Rgb(0.0f), kPdf};
    }
    const float sine2 = 1.0f - nh * nh;
    const float inverse = 1.0f / sqr(c.parameter);
    const float d = std::exp(-(nh * nh / sine2) * inverse) * inverse * kInvPi / sqr(sine2);
    const float groove = 2.0f * std::max(nh / vh, 1e-5f) * std::min(nl, nv);
    const float value = 0.25f * d * std::min(groove, 1.0f) / nv;
    return {c.weight * value, kPdf};
}

}  // namespace pharos
