// The world as a light: a luminance map over directions sampled in proportion, and its density.
//
// u = 0.5 - atan2(d.y, d.x) / 2 pi, v = 1 - acos(d.z) / pi (v up, z up). The map holds average
// |rgb| times the texel's solid angle; within a texel directions are uniform in solid angle, so the
// density is constant there and bounded at the poles. Radiance itself comes from the world's
// program.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/math.h"
#include "sampling/distribution_2d.h"

namespace pharos {

class EnvironmentLight {
  public:
    // importance: width * height radiance values of the texel centres, bottom row first. A map of
    // 1 x 1 is a constant world (uniform sphere sampling). Throws Cancelled when it is.
    EnvironmentLight(std::span<const Rgb> radiance,
                     std::uint32_t width,
                     std::uint32_t height,
                     const CancelFlag* cancel = nullptr);

    struct Sample {
        Vec3 wi;
        float pdf = 0.0f;  // solid angle
    };

    [[nodiscard]] Sample sample(const Vec2& u) const;
    [[nodiscard]] float pdf(const Vec3& wi) const;

    [[nodiscard]] bool is_constant() const { return constant_; }

    [[nodiscard]] Rgb mean_radiance() const { return mean_; }  // over the sphere, for light choice

  private:
    Distribution2D map_;
    std::vector<float> row_cosine_;   // z at the rows' edges, -1 ... 1
    std::vector<float> row_density_;  // 1 / solid angle of a row's texels
    Rgb mean_{0.0f};
    bool constant_ = true;
};

[[nodiscard]] Vec2 direction_to_equirectangular(const Vec3& d);
[[nodiscard]] Vec3 equirectangular_to_direction(const Vec2& uv);

}  // namespace pharos
