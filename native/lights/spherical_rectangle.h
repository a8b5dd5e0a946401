// A rectangle as seen from the origin: uniform sampling of its solid angle
// (Urena, Fajardo, King 2013). It spans [x0, x1] x [y0, y1] at height z, |z| > 0.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/math.h"
#include "sampling/warps.h"

namespace pharos {

struct SphericalRectangle {
    float x0, x1, y0, y1, z;
    float b0, b1;  // z components of the normals of the sides y = y0 and y = y1
    float solid_angle;
    float k;  // 2 pi - the two inner angles at x0

    // Corner angles are acos(-n_i . n_j), and the sides' normals are such that the products reduce
    // to their z components; acos(-q) = pi/2 + asin(q) leaves no large terms to cancel.
    [[nodiscard]] static SphericalRectangle make(const Vec2& lower, const Vec2& upper, float z) {
        // All four sides at once.
        const std::array<float, 4> side{-lower.y, upper.x, upper.y, -lower.x};
        std::array<float, 4> n;
        std::array<float, 4> angle;
        for (std::size_t i = 0; i < 4; ++i) {
            n[i] = side[i] / std::sqrt(z * z + side[i] * side[i]);
        }
        const std::array<float, 4> next{n[1], n[2], n[3], n[0]};
        for (std::size_t i = 0; i < 4; ++i) {
            angle[i] = arcsine(n[i] * next[i]);
        }
        const float excess = (angle[0] + angle[1]) + (angle[2] + angle[3]);
        return {
            lower.x, upper.x, lower.y, upper.y, z, n[0], n[2], excess, kPi - angle[2] - angle[3]};
    }

    // The point (x, y) of the rectangle.
    [[nodiscard]] Vec2 sample(const Vec2& u) const {
        const float height = std::abs(z);
        const SinCos au = sincos_turns((u.x * solid_angle + k) * (0.5f * kInvPi));
        const float fu = (au.cos * b0 - b1) / (au.sin == 0.0f ? 1e-12f : au.sin);
        // cos u = +-1 / sqrt(fu^2 + b0^2), and x = height cot u
        const float across2 = std::max(fu * fu + b0 * b0 - 1.0f, 1e-24f);
        const float x = std::clamp(std::copysign(height / std::sqrt(across2), fu), x0, x1);
        const float d2 = x * x + height * height;
        const float h0 = y0 / std::sqrt(d2 + y0 * y0);
        const float h1 = y1 / std::sqrt(d2 + y1 * y1);
        const float h = h0 + u.y * (h1 - h0);
        const float y = h * std::sqrt(d2 / std::max(1.0f - h * h, 1e-12f));
        return Vec2(x, std::clamp(y, y0, y1));
    }
};

}  // namespace pharos
