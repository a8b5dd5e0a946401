// Ray origins that neither hit their own surface again nor leap over a neighbour.
//
// Error-bound offset (Pharr, Jakob, Humphreys, PBR 4ed, section 6.8.6): along the geometric normal
// by the bound of the hit point's rounding error, then one ulp outward in every component.
#pragma once

#include <bit>

#include "core/math.h"

namespace pharos {

[[nodiscard]] inline float next_float_towards(float x, float direction) {
    if (x == 0.0f) {
        return std::copysign(std::numeric_limits<float>::denorm_min(), direction);
    }
    const auto bits = std::bit_cast<std::uint32_t>(x);
    return std::bit_cast<float>((x > 0) == (direction > 0) ? bits + 1 : bits - 1);
}

// `side` is any vector on the side of the surface the new ray leaves to.
[[nodiscard]] inline Vec3 offset_ray_origin(const Vec3& p,
                                            const Vec3& ng,
                                            float p_error,
                                            const Vec3& side) {
    const Vec3 n = glm::dot(ng, side) < 0.0f ? -ng : ng;
    Vec3 origin = p + n * p_error;
    for (int axis = 0; axis < 3; ++axis) {
        if (n[axis] != 0.0f) {
            origin[axis] = next_float_towards(origin[axis], n[axis]);
        }
    }
    return origin;
}

}  // namespace pharos
