// Toon lobes: the same brightness within an angle of an axis, fading to nothing over another. The
// axis is the normal (diffuse) or the mirror direction (glossy).
//
//   f cos = weight I(angle) / (2 pi (1 - cos(reach))), I = 1 within `size`, then linearly to 0.
//   Directions are chosen evenly in the cone of `reach` = size + smooth, at most a right angle.
//   Closure: parameter = size, alpha_x = smooth (both radians).
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"
#include "sampling/warps.h"

namespace pharos {

[[nodiscard]] inline Vec3 toon_axis(const Closure& c, const Vec3& wo) {
    return c.type == ClosureType::ToonGlossy ? glm::normalize(c.n * (2.0f * glm::dot(c.n, wo)) - wo)
                                             : c.n;
}

[[nodiscard]] inline float toon_reach(const Closure& c) {
    return std::min(c.parameter + c.alpha_x, 0.5f * kPi);
}

// 1 - cos without cancellation.
[[nodiscard]] inline float toon_cap(float angle) {
    return 2.0f * sqr(std::sin(0.5f * angle));
}

[[nodiscard]] inline BsdfEval eval_toon(const Closure& c, const Vec3& wo, const Vec3& wi) {
    if (!(glm::dot(c.n, wi) > 0.0f) ||
        (c.type == ClosureType::ToonGlossy && !(glm::dot(c.n, wo) > 0.0f))) {
        return {};
    }
    const Vec3 axis = toon_axis(c, wo);
    // The angle by its half's tangent: exact for small ones too.
    const float angle = 2.0f * std::atan2(glm::length(wi - axis), glm::length(wi + axis));
    const float reach = toon_reach(c);
    if (angle > reach) {
        return {};
    }
    const float intensity =
        angle < c.parameter ? 1.0f : saturate(1.0f - (angle - c.parameter) / c.alpha_x);
    const float pdf = 1.0f / (2.0f * kPi * toon_cap(reach));
    return {c.weight * (intensity * pdf), pdf};
}

[[nodiscard]] inline Vec3 sample_toon(const Closure& c, const Vec3& wo, const Vec2& u) {
    const float down = u.x * toon_cap(toon_reach(c));
    const float radius = safe_sqrt(down * (2.0f - down));
    const float phi = 2.0f * kPi * u.y;
    const Vec3 local(radius * std::cos(phi), radius * std::sin(phi), 1.0f - down);
    return glm::normalize(Frame::from_z(toon_axis(c, wo)).to_world(local));
}

}  // namespace pharos
