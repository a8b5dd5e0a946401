// Sheen lobes (Closure::smith chooses the version, as for microfacets).
//
//   3.x (smith = 1): Burley's sheen, f cos = weight (1 - wi.h)^5 nl, sampled by the cosine.
//   4.x (smith = 0): a linearly transformed cosine (Zeltner, Burley, Chiang 2022): with wi in the
//       frame whose x axis is wo's tangential direction, alpha_x = A, alpha_y = B:
//       f cos = weight energy_scale v,  v = max(z, 0) / pi (A / ((A x + B z)^2 + (A y)^2 + z^2))^2
//       v integrates to one, so energy_scale is the directional albedo and v the pdf.
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/lobes/diffuse.h"
#include "sampling/warps.h"

namespace pharos {

[[nodiscard]] inline BsdfEval eval_sheen_v1(const Closure& c, const Vec3& wo, const Vec3& wi) {
    const float nl = glm::dot(c.n, wi);
    if (!(nl > 0.0f) || !(glm::dot(c.n, wo) > 0.0f)) {
        return {};
    }
    // cos of the half angle: |wo + wi| / 2.
    const float lh = 0.5f * std::sqrt(length_squared(wo + wi));
    return {c.weight * (schlick_weight(lh) * nl), nl * kInvPi};
}

[[nodiscard]] inline BsdfEval eval_sheen_ltc(const Closure& c, const Vec3& wi) {
    const float z = glm::dot(c.n, wi);
    if (!(z > 0.0f)) {
        return {};
    }
    const float a = c.alpha_x;
    const float x = glm::dot(c.tangent, wi);
    const float y = glm::dot(glm::cross(c.n, c.tangent), wi);
    const float length = sqr(a * x + c.alpha_y * z) + sqr(a * y) + z * z;
    const float pdf = kInvPi * z * sqr(a / length);
    return {c.weight * (c.energy_scale * pdf), pdf};
}

// The inverse transform of a cosine-distributed direction.
[[nodiscard]] inline Vec3 sample_sheen_ltc(const Closure& c, const Vec2& u) {
    const Vec3 d = sample_cosine_hemisphere(u);
    const Vec3 w = glm::normalize(Vec3(d.x - d.z * c.alpha_y, d.y, d.z * c.alpha_x));
    return c.tangent * w.x + glm::cross(c.n, c.tangent) * w.y + c.n * w.z;
}

}  // namespace pharos
