// A rectangle as seen from the origin: uniform sampling of its solid angle
// (Urena, Fajardo, King 2013). It spans [x0, x1] x [y0, y1] at height z, |z| > 0.
#pragma once

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
        const float zz = z * z;
        const float n0 = -lower.y / std::sqrt(zz + lower.y * lower.y);
        const float n1 = upper.x / std::sqrt(zz + upper.x * upper.x);
        const float n2 = upper.y / std::sqrt(zz + upper.y * upper.y);
        const float n3 = -lower.x / std::sqrt(zz + lower.x * lower.x);
        const float a2 = std::asin(n2 * n3);
        const float a3 = std::asin(n3 * n0);
        const float excess = std::asin(n0 * n1) + std::asin(n1 * n2) + a2 + a3;
        return {lower.x, upper.x, lower.y, upper.y, z, n0, n2, excess, kPi - a2 - a3};
    }

    // The point (x, y) of the rectangle.
    [[nodiscard]] Vec2 sample(const Vec2& u) const {
        const float height = std::abs(z);
        const SinCos au = sincos_turns((u.x * solid_angle + k) * (0.5f * kInvPi));
        const float fu = (au.cos * b0 - b1) / (au.sin == 0.0f ? 1e-12f : au.sin);
        const float cu = std::copysign(1.0f, fu) / std::sqrt(fu * fu + b0 * b0);
        const float cu_limited = std::clamp(cu, -1.0f, 1.0f);
        const float across = safe_sqrt(1.0f - cu_limited * cu_limited);
        const float x = std::clamp(cu_limited * height / std::max(across, 1e-12f), x0, x1);
        const float d2 = x * x + height * height;
        const float h0 = y0 / std::sqrt(d2 + y0 * y0);
        const float h1 = y1 / std::sqrt(d2 + y1 * y1);
        const float h = h0 + u.y * (h1 - h0);
        const float y = h * std::sqrt(d2 / std::max(1.0f - h * h, 1e-12f));
        return Vec2(x, std::clamp(y, y0, y1));
    }
};

}  // namespace pharos
