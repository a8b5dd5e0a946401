// Eight bounds of emitters as a node of the light tree keeps them: the estimate of light_columns.h,
// for local emitters without spread and without narrow cones, at a third of its cost. The widest
// cosine over an emitter is bounded by cosine + sine of its half angle here, which is positive
// where the exact one is.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/math.h"
#include "lights/light.h"
#include "lights/light_bound.h"
#include "lights/light_columns.h"

namespace pharos {

class alignas(64) LeanColumns {
  public:
    static constexpr std::size_t kWidth = 8;
    using Column = std::array<float, kWidth>;

    // Unused entries have strength 0.
    LeanColumns() {
        for (std::size_t i = 0; i < kWidth; ++i) {
            set(i, LightBound{});
        }
    }

    [[nodiscard]] static bool holds(const LightBound& bound) {
        const bool cone = bound.orientation == EmitterOrientation::Cone;
        return bound.distance == EmitterDistance::Local && !(bound.reach < kInfinity) &&
               (!cone || bound.cos_limit <= 0.0f);
    }

    // The bound is one that holds() holds for.
    void set(std::size_t i, const LightBound& bound) {
        using namespace detail;
        center_x_[i] = bound.center.x;
        center_y_[i] = bound.center.y;
        center_z_[i] = bound.center.z;
        axis_x_[i] = bound.axis.x;
        axis_y_[i] = bound.axis.y;
        axis_z_[i] = bound.axis.z;
        strength_[i] = bound.strength * bound.spread_scale;
        radius_[i] = bound.radius;
        min_distance2_[i] = least_distance2(bound);
        mirror_[i] = bound.orientation == EmitterOrientation::TwoSided ? -1.0f : 1.0f;
        cutoff_[i] = bound.orientation == EmitterOrientation::Front ? 0.0f : -2.0f;
        const bool cone = bound.orientation == EmitterOrientation::Cone;
        const bool any = bound.orientation == EmitterOrientation::Any;
        cone_limit_[i] = cone ? bound.cos_limit : (any ? -3.0f : 0.0f);
        cone_scale_[i] = cone ? 1.0f / bound.cos_width : 1.0f;
        cone_floor_[i] = cone ? kMinConeFactor : 0.0f;
    }

    void estimate(const LightSampleContext& context, Column& weights) const {
        using namespace detail;
        const float floor = context.transmits ? 1.0f : kMinReceiverCosine;
        const Vec3 p = context.p;
        const Vec3 n = context.n;
        for (std::size_t i = 0; i < kWidth; ++i) {
            const float x = center_x_[i] - p.x;
            const float y = center_y_[i] - p.y;
            const float z = center_z_[i] - p.z;
            const float distance2 = std::max(x * x + y * y + z * z, 1e-20f);
            const float inverse = 1.0f / std::sqrt(distance2);
            const float sin_bound = radius_[i] * inverse;
            // Within the bound every direction is one to an emitter.
            const float reach = sin_bound >= 1.0f ? 2.0f : sin_bound;

            const float here = (x * n.x + y * n.y + z * n.z) * inverse;
            const float received = std::max(std::min(here + reach, 1.0f), floor);

            const float front = -(x * axis_x_[i] + y * axis_y_[i] + z * axis_z_[i]) * inverse;
            const float there = std::max(front, front * mirror_[i]);
            const float inside = std::min(there + reach, 1.0f) - cone_limit_[i];
            const float cone = std::min(std::max(inside * cone_scale_[i], cone_floor_[i]), 1.0f);

            const float value =
                strength_[i] * received * cone / std::max(distance2, min_distance2_[i]);
            const float in_cone = inside > 0.0f ? value : 0.0f;
            weights[i] = front > cutoff_[i] ? in_cone : 0.0f;
        }
    }

  private:
    Column center_x_{}, center_y_{}, center_z_{};
    Column axis_x_{}, axis_y_{}, axis_z_{};
    Column strength_{};
    Column radius_{};
    Column min_distance2_{};
    Column mirror_{};  // -1: both sides emit
    Column cutoff_{};  // no light below this cosine
    Column cone_limit_{}, cone_scale_{}, cone_floor_{};
};

}  // namespace pharos
