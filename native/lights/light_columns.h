// Bounds of emitters as one branch-free formula, in columns for SIMD: an estimate of the irradiance
// that each of them brings to a receiver, never zero where light can arrive.
//
// strength x cosine there x cosine here / distance^2, with the cosines' upper bounds over a sphere
// around the emitter (the importance of Conty Estevez and Kulla 2018, "Importance sampling of many
// lights with adaptive tree splitting", eq. 3, with a receiver).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/math.h"
#include "lights/light.h"
#include "lights/light_bound.h"

namespace pharos {

namespace detail {

// The receiver's cosine never counts as less: bump-mapped lobes may see below the horizon of n.
inline constexpr float kMinReceiverCosine = 0.02f;
inline constexpr float kMinConeFactor = 0.05f;

// Irradiance does not exceed pi times the radiance, strength / area.
inline float least_distance2(const LightBound& bound) {
    return std::max(bound.area * kInvPi, 1e-20f);
}

// Largest cosine between an axis and any direction within a cone of half angle asin(sin_bound)
// around a direction at `cosine` to the axis.
inline float widest_cosine(float cosine, float sin_bound) {
    const float cos_bound = std::sqrt(std::max(1.0f - sin_bound * sin_bound, 0.0f));
    const float sine = std::sqrt(std::max(1.0f - cosine * cosine, 0.0f));
    const float turned = cosine * cos_bound + sine * sin_bound;
    const float outside = cosine >= cos_bound ? 1.0f : turned;
    return sin_bound >= 1.0f ? 1.0f : outside;
}

}  // namespace detail

// kWidth is a multiple of eight; unused entries have strength 0.
template <std::size_t kWidth>
class LightColumns {
  public:
    using Column = std::array<float, kWidth>;

    LightColumns() {
        for (std::size_t i = 0; i < kWidth; ++i) {
            set(i, LightBound{});
        }
    }

    void set(std::size_t i, const LightBound& bound) {
        using namespace detail;
        center_x_[i] = bound.center.x;
        center_y_[i] = bound.center.y;
        center_z_[i] = bound.center.z;
        axis_x_[i] = bound.axis.x;
        axis_y_[i] = bound.axis.y;
        axis_z_[i] = bound.axis.z;
        local_[i] = bound.distance == EmitterDistance::Local ? 1.0f : 0.0f;
        strength_[i] = bound.strength;
        radius_[i] = bound.radius;
        min_distance2_[i] = least_distance2(bound);
        min_received_[i] = bound.distance == EmitterDistance::Ambient ? 1.0f : kMinReceiverCosine;
        mirror_[i] = bound.orientation == EmitterOrientation::TwoSided ? -1.0f : 1.0f;
        cutoff_[i] = bound.orientation == EmitterOrientation::Front ? 0.0f : -2.0f;
        const bool cone = bound.orientation == EmitterOrientation::Cone;
        const bool any = bound.orientation == EmitterOrientation::Any;
        cone_limit_[i] = cone ? bound.cos_limit : (any ? -3.0f : 0.0f);
        cone_scale_[i] = cone ? 1.0f / bound.cos_width : 1.0f;
        cone_floor_[i] = cone ? kMinConeFactor : 0.0f;
        const bool spread = bound.reach < kInfinity;
        spread_scale_[i] = bound.spread_scale;
        spread_slope_[i] = spread ? 1.0f / bound.reach : 0.0f;
        // The lit part of the emitter is a disc of radius reach times height.
        lit_bias_[i] = spread ? 0.0f : 1.0f;
        lit_scale_[i] = spread ? kPi * bound.reach * bound.reach / bound.area : 0.0f;
    }

    // Estimates of the first `count`, rounded up to whole registers; returns their sum.
    float estimate(const LightSampleContext& context, std::size_t count, Column& weights) const {
        using namespace detail;
        const float min_received = context.transmits ? 1.0f : 0.0f;
        const Vec3 p = context.p;
        const Vec3 n = context.n;
        const std::size_t used = (count + kLanes - 1) / kLanes * kLanes;
        for (std::size_t i = 0; i < used; ++i) {
            const float x = center_x_[i] - local_[i] * p.x;
            const float y = center_y_[i] - local_[i] * p.y;
            const float z = center_z_[i] - local_[i] * p.z;
            const float distance2 = std::max(x * x + y * y + z * z, 1e-20f);
            const float distance = std::sqrt(distance2);
            const float inverse = 1.0f / distance;
            const float sin_bound = std::min(radius_[i] * inverse, 1.0f);

            const float here = (x * n.x + y * n.y + z * n.z) * inverse;
            const float floor = std::max(min_received_[i], min_received);
            const float received = std::max(widest_cosine(here, sin_bound), floor);

            const float front = -(x * axis_x_[i] + y * axis_y_[i] + z * axis_z_[i]) * inverse;
            const float there = std::max(front, front * mirror_[i]);
            const float inside = widest_cosine(there, sin_bound) - cone_limit_[i];
            const float cone = std::min(std::max(inside * cone_scale_[i], cone_floor_[i]), 1.0f);

            // Spread: the emitter's nearest point to the foot of the perpendicular.
            const float height = std::max(there * distance, 1e-20f);
            const float sine = std::sqrt(std::max(1.0f - there * there, 0.0f));
            const float lateral = std::max(distance * sine - radius_[i], 0.0f);
            const float slope = lateral * spread_slope_[i] / height;
            const float lit = std::min(lit_bias_[i] + lit_scale_[i] * height * height, 1.0f);
            const float spread = spread_scale_[i] * std::max(1.0f - slope, kMinConeFactor) * lit;

            const float value =
                strength_[i] * received * cone * spread / std::max(distance2, min_distance2_[i]);
            const float in_cone = inside > 0.0f ? value : 0.0f;
            const float in_front = front > cutoff_[i] ? in_cone : 0.0f;
            weights[i] = slope <= 1.001f ? in_front : 0.0f;
        }
        std::array<float, kLanes> sums{};
        for (std::size_t i = 0; i < used; i += kLanes) {
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                sums[lane] += weights[i + lane];
            }
        }
        return ((sums[0] + sums[4]) + (sums[2] + sums[6])) +
               ((sums[1] + sums[5]) + (sums[3] + sums[7]));
    }

  private:
    static constexpr std::size_t kLanes = 8;
    static_assert(kWidth % kLanes == 0);

    Column center_x_{}, center_y_{}, center_z_{};
    Column axis_x_{}, axis_y_{}, axis_z_{};
    Column local_{};  // 1: seen from the receiver; 0: center is the direction
    Column strength_{};
    Column radius_{};
    Column min_distance2_{};
    Column min_received_{};  // floor of the receiver's cosine
    Column mirror_{};        // -1: both sides emit
    Column cutoff_{};        // no light below this cosine
    Column cone_limit_{}, cone_scale_{}, cone_floor_{};
    Column spread_scale_{}, spread_slope_{};
    Column lit_bias_{}, lit_scale_{};
};

}  // namespace pharos
