// The triangles that stopped the last shadow rays, tried before the whole scene: behind a wall the
// next ray is most likely stopped by it too (Pearce 1991, "A recursive shadow voxel cache for ray
// tracing"). Eight triangles at once in SIMD lanes, by Moeller and Trumbore's test (1997).
//
// Only a safe hit counts: well inside of the triangle, away from both ends of the ray, and within
// what float resolves. All others are left to the robust traversal, so that no ray is stopped that
// it would let pass.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/math.h"

namespace pharos {

class OccluderCache {
  public:
    // Takes the place of the triangle that came first.
    void insert(const Vec3& a, const Vec3& b, const Vec3& c) {
        const Vec3 ab = b - a;
        const Vec3 ac = c - a;
        const Vec3 n = glm::normalize(glm::cross(ab, ac));
        const std::size_t k = next_++ % kLanes;
        for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::size_t>(axis);
            corner_[i][k] = a[axis];
            ab_[i][k] = ab[axis];
            ac_[i][k] = ac[axis];
            normal_[i][k] = n[axis];
        }
        const float edge = std::min({glm::length(ab), glm::length(ac), glm::length(ac - ab)});
        reach_[k] = edge * kMaxReach;
    }

    // True: a triangle of the cache lies on the ray between its ends. False: nothing is known.
    [[nodiscard]] bool stops(const Ray& ray) const {
        const Vec3& o = ray.origin;
        const Vec3& d = ray.direction;
        int any = 0;
        for (std::size_t k = 0; k < kLanes; ++k) {
            const float sx = o.x - corner_[0][k];
            const float sy = o.y - corner_[1][k];
            const float sz = o.z - corner_[2][k];
            const float px = d.y * ac_[2][k] - d.z * ac_[1][k];
            const float py = d.z * ac_[0][k] - d.x * ac_[2][k];
            const float pz = d.x * ac_[1][k] - d.y * ac_[0][k];
            const float inverse = 1.0f / (ab_[0][k] * px + ab_[1][k] * py + ab_[2][k] * pz);
            const float u = (sx * px + sy * py + sz * pz) * inverse;
            const float qx = sy * ab_[2][k] - sz * ab_[1][k];
            const float qy = sz * ab_[0][k] - sx * ab_[2][k];
            const float qz = sx * ab_[1][k] - sy * ab_[0][k];
            const float v = (d.x * qx + d.y * qy + d.z * qz) * inverse;
            const float t = (ac_[0][k] * qx + ac_[1][k] * qy + ac_[2][k] * qz) * inverse;
            const float away =
                std::abs(sx * normal_[0][k] + sy * normal_[1][k] + sz * normal_[2][k]);
            const float size = std::abs(sx) + std::abs(sy) + std::abs(sz);
            // Empty lanes have a determinant of 0 and a reach of 0: no comparison holds.
            const int safe = (u > kMargin) & (v > kMargin) & (u + v < 1.0f - kMargin) &
                             (t > ray.t_min) & (t < ray.t_max * (1.0f - kMargin)) &
                             (away > kMargin * size) & (size < reach_[k]);
            any |= safe;
        }
        return any != 0;
    }

  private:
    static constexpr std::size_t kLanes = 8;
    static constexpr float kMargin = 1e-3f;
    static constexpr float kMaxReach = 500.0f;  // shortest edges: beyond, u and v lose digits

    using Lanes = std::array<float, kLanes>;

    alignas(32) std::array<Lanes, 3> corner_{};
    alignas(32) std::array<Lanes, 3> ab_{};
    alignas(32) std::array<Lanes, 3> ac_{};
    alignas(32) std::array<Lanes, 3> normal_{};
    alignas(32) Lanes reach_{};
    std::size_t next_ = 0;
};

}  // namespace pharos
