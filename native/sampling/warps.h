// Warps from the unit square to the distributions a path tracer draws from, as triples
//     sample_x(u) -> point,   x_pdf(point) -> density,   invert_x(point) -> u.
//
// Contract: u in [0, 1)^2. Directions are unit and around +z; densities are per solid angle (or per
// unit area), zero outside of the domain. invert_x(sample_x(u)) is u up to rounding.
#pragma once

#include <bit>
#include <cstdint>

#include "core/math.h"

namespace pharos {

struct SinCos {
    float sin;
    float cos;
};

namespace detail {

// condition ? a : b without a branch.
[[nodiscard]] inline float select(bool condition, float a, float b) {
    const std::uint32_t mask = 0u - static_cast<std::uint32_t>(condition);
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(a) & mask) |
                                (std::bit_cast<std::uint32_t>(b) & ~mask));
}

// sin and cos on [-pi/4, pi/4], minimax fits (relative error of sin 4e-9, of cos 1e-10 before
// rounding). Branch-free, so that loops over lanes vectorise.
[[nodiscard]] inline SinCos sincos_eighth(float x) {
    const float z = x * x;
    const float s = x + x * z * (-0.166666549f + z * (0.00833217815f + z * -0.000195172989f));
    const float c =
        1.0f - 0.5f * z + z * z * (0.0416666469f + z * (-0.00138873675f + z * 2.44384514e-05f));
    return {s, c};
}

}  // namespace detail

// Sine and cosine of 2 pi turns, |turns| < 2^20. The reduction is exact because it is done in
// turns.
[[nodiscard]] inline SinCos sincos_turns(float turns) {
    const float scaled = 4.0f * turns;
    const int quadrant = static_cast<int>(scaled + std::copysign(0.5f, scaled));
    const SinCos a = detail::sincos_eighth((scaled - static_cast<float>(quadrant)) * (0.5f * kPi));
    const std::uint32_t q = static_cast<std::uint32_t>(quadrant);
    // Signs by their bits: a random quadrant would be mispredicted every other time.
    const std::uint32_t s =
        std::bit_cast<std::uint32_t>(detail::select((q & 1u) != 0, a.cos, a.sin));
    const std::uint32_t c =
        std::bit_cast<std::uint32_t>(detail::select((q & 1u) != 0, a.sin, a.cos));
    return {std::bit_cast<float>(s ^ ((q & 2u) << 30)),
            std::bit_cast<float>(c ^ (((q + 1u) & 2u) << 30))};
}

// Angle of (x, y) in turns, in [0, 1).
[[nodiscard]] inline float direction_turns(float x, float y) {
    const float turns = std::atan2(y, x) * (0.5f * kInvPi);
    return std::min(turns < 0.0f ? turns + 1.0f : turns, kOneMinusEpsilon);
}

// asin on [-1, 1]: a fit of asin(x) / x on the inner half (relative error 1e-9 before rounding),
// half angles on the outer one. Branch-free; what rounding has put beyond 1 counts as 1.
[[nodiscard]] inline float arcsine(float q) {
    const float size = std::abs(q);
    const bool outer = size > 0.5f;
    const float half = std::max(0.5f - 0.5f * size, 0.0f);
    const float z = detail::select(outer, half, size * size);
    const float x = detail::select(outer, std::sqrt(half), size);
    const float inner =
        x + x * z *
                (0.166666657f +
                 z * (0.0750009418f +
                      z * (0.0445994027f +
                           z * (0.0311006624f + z * (0.0171492379f + z * 0.0336908475f)))));
    return std::copysign(detail::select(outer, 0.5f * kPi - 2.0f * inner, inner), q);
}

// --- unit disk, concentric (Shirley and Chiu 1997) ---

[[nodiscard]] inline Vec2 sample_uniform_disk(const Vec2& u) {
    const float a = 2.0f * u.x - 1.0f;
    const float b = 2.0f * u.y - 1.0f;
    const bool wide = std::abs(a) > std::abs(b);
    const float radius = detail::select(wide, a, b);
    const float ratio = detail::select(wide, b, a) / detail::select(radius == 0.0f, 1.0f, radius);
    const SinCos angle = detail::sincos_eighth(0.25f * kPi * ratio);
    return Vec2(radius * detail::select(wide, angle.cos, angle.sin),
                radius * detail::select(wide, angle.sin, angle.cos));
}

[[nodiscard]] inline float uniform_disk_pdf(const Vec2& p) {
    return p.x * p.x + p.y * p.y <= 1.0f + 1e-6f ? kInvPi : 0.0f;
}

[[nodiscard]] inline Vec2 invert_uniform_disk(const Vec2& p) {
    const bool wide = std::abs(p.x) > std::abs(p.y);
    const float major = wide ? p.x : p.y;
    const float minor = wide ? p.y : p.x;
    if (major == 0.0f) {
        return Vec2(0.5f);
    }
    const float radius = std::copysign(std::sqrt(p.x * p.x + p.y * p.y), major);
    const float across = radius * std::atan(minor / major) * (4.0f * kInvPi);
    const Vec2 square = wide ? Vec2(radius, across) : Vec2(across, radius);
    return glm::clamp(0.5f * square + 0.5f, 0.0f, kOneMinusEpsilon);
}

// --- cosine-weighted hemisphere ---

[[nodiscard]] inline Vec3 sample_cosine_hemisphere(const Vec2& u) {
    const Vec2 d = sample_uniform_disk(u);
    return Vec3(d.x, d.y, safe_sqrt(1.0f - (d.x * d.x + d.y * d.y)));
}

[[nodiscard]] inline float cosine_hemisphere_pdf(float cosine) {
    return std::max(cosine, 0.0f) * kInvPi;
}

[[nodiscard]] inline Vec2 invert_cosine_hemisphere(const Vec3& w) {
    return invert_uniform_disk(Vec2(w.x, w.y));
}

// --- uniform cone around +z, given 1 - cos of its half angle, which stays exact for tiny cones ---

// 1 - cos(a) from sin^2(a) of an angle below 90 degrees, without cancellation.
[[nodiscard]] inline float one_minus_cos_from_sin2(float sin_squared) {
    return sin_squared / (1.0f + safe_sqrt(1.0f - sin_squared));
}

[[nodiscard]] inline Vec3 sample_uniform_cone(const Vec2& u, float one_minus_cos_max) {
    const float drop = u.x * one_minus_cos_max;
    const float radius = safe_sqrt(drop * (2.0f - drop));
    const SinCos phi = sincos_turns(u.y);
    return Vec3(radius * phi.cos, radius * phi.sin, 1.0f - drop);
}

// Density inside of the cone; the caller knows whether a direction is inside.
[[nodiscard]] inline float uniform_cone_pdf(float one_minus_cos_max) {
    return 0.5f * kInvPi / one_minus_cos_max;
}

[[nodiscard]] inline Vec2 invert_uniform_cone(const Vec3& w, float one_minus_cos_max) {
    const float sin_squared = w.x * w.x + w.y * w.y;
    const float drop = w.z > 0.5f ? one_minus_cos_from_sin2(sin_squared) : 1.0f - w.z;
    return Vec2(std::min(drop / one_minus_cos_max, kOneMinusEpsilon), direction_turns(w.x, w.y));
}

// --- uniform sphere ---

[[nodiscard]] inline Vec3 sample_uniform_sphere(const Vec2& u) {
    return sample_uniform_cone(u, 2.0f);
}

[[nodiscard]] inline constexpr float uniform_sphere_pdf() {
    return 0.25f * kInvPi;
}

[[nodiscard]] inline Vec2 invert_uniform_sphere(const Vec3& w) {
    return invert_uniform_cone(w, 2.0f);
}

// --- uniform triangle: barycentrics (b1, b2) of p = (1 - b1 - b2) p0 + b1 p1 + b2 p2 ---

// Low-distortion map without a square root (Heitz 2019, "A Low-Distortion Map Between Triangle and
// Square"): the half square beyond the diagonal is squeezed, not mirrored.
[[nodiscard]] inline Vec2 sample_uniform_triangle(const Vec2& u) {
    if (u.y > u.x) {
        const float b1 = 0.5f * u.x;
        return Vec2(b1, u.y - b1);
    }
    const float b2 = 0.5f * u.y;
    return Vec2(u.x - b2, b2);
}

[[nodiscard]] inline float uniform_triangle_pdf(float area) {
    return 1.0f / area;
}

[[nodiscard]] inline Vec2 invert_uniform_triangle(const Vec2& b) {
    const float sum = std::min(b.x + b.y, kOneMinusEpsilon);
    return b.y > b.x ? Vec2(2.0f * b.x, sum) : Vec2(sum, 2.0f * b.y);
}

}  // namespace pharos
