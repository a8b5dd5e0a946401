// Vectors, frames, rays and bounds of the whole project: GLM types under the field's names.
//
// Contract: float32, right-handed, metres. Every GLM value is zero-initialised
// (GLM_FORCE_CTOR_INIT). Points, vectors and normals share Vec3; how one is transformed is said by
// the function's name.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <glm/glm.hpp>

namespace pharos {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using UVec3 = glm::uvec3;
using Mat3 = glm::mat3;
using Mat4 = glm::mat4;  // column-major, affine; last row (0, 0, 0, 1)
using Rgb = glm::vec3;   // scene-linear radiance or reflectance

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;  // largest float below 1

[[nodiscard]] inline float sqr(float x) {
    return x * x;
}

[[nodiscard]] inline float safe_sqrt(float x) {
    return std::sqrt(std::max(x, 0.0f));
}

[[nodiscard]] inline float saturate(float x) {
    return std::clamp(x, 0.0f, 1.0f);
}

[[nodiscard]] inline float lerp(float a, float b, float t) {
    return a + (b - a) * t;
}

[[nodiscard]] inline Vec3 lerp(const Vec3& a, const Vec3& b, float t) {
    return a + (b - a) * t;
}

[[nodiscard]] inline float length_squared(const Vec3& v) {
    return glm::dot(v, v);
}

[[nodiscard]] inline float max_component(const Vec3& v) {
    return std::max(v.x, std::max(v.y, v.z));
}

[[nodiscard]] inline bool is_zero(const Vec3& v) {
    return v.x == 0 && v.y == 0 && v.z == 0;
}

[[nodiscard]] inline bool is_finite(const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Unit vector along v, or `fallback` where v has no direction (zero, underflow, non-finite).
[[nodiscard]] inline Vec3 normalize_or(const Vec3& v, const Vec3& fallback) {
    const float squared = length_squared(v);
    return squared > 1e-30f && squared < 1e30f ? v * (1.0f / std::sqrt(squared)) : fallback;
}

[[nodiscard]] inline Vec3 transform_point(const Mat4& m, const Vec3& p) {
    return Vec3(m * Vec4(p, 1.0f));
}

[[nodiscard]] inline Vec3 transform_vector(const Mat4& m, const Vec3& v) {
    return Vec3(m * Vec4(v, 0.0f));
}

// `inverse` is the inverse of the matrix that transforms points. Not normalised.
[[nodiscard]] inline Vec3 transform_normal(const Mat4& inverse, const Vec3& n) {
    return Vec3(glm::dot(Vec3(inverse[0]), n),
                glm::dot(Vec3(inverse[1]), n),
                glm::dot(Vec3(inverse[2]), n));
}

// Orthonormal basis around z (Duff et al. 2017, branch-free).
struct Frame {
    Vec3 x, y, z;

    [[nodiscard]] static Frame from_z(const Vec3& n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        return {Vec3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x),
                Vec3(b, sign + n.y * n.y * a, -n.y),
                n};
    }

    [[nodiscard]] Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }

    [[nodiscard]] Vec3 to_local(const Vec3& v) const {
        return Vec3(glm::dot(v, x), glm::dot(v, y), glm::dot(v, z));
    }
};

struct Ray {
    Vec3 origin;
    Vec3 direction;  // unit length
    float t_min = 0.0f;
    float t_max = kInfinity;
};

struct Bounds3 {
    Vec3 lower{kInfinity};
    Vec3 upper{-kInfinity};

    void extend(const Vec3& p) {
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
    }

    void extend(const Bounds3& b) {
        lower = glm::min(lower, b.lower);
        upper = glm::max(upper, b.upper);
    }

    [[nodiscard]] bool empty() const { return !(lower.x <= upper.x); }

    [[nodiscard]] Vec3 center() const { return 0.5f * (lower + upper); }

    [[nodiscard]] Vec3 extent() const { return upper - lower; }
};

}  // namespace pharos
