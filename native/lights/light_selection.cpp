#include "lights/light_selection.h"

#include <vector>

#include "core/color.h"

namespace pharos {

namespace {

// The receiver's cosine never counts as less: bump-mapped lobes may see below the horizon of n.
constexpr float kMinReceiverCosine = 0.02f;
constexpr float kMinConeFactor = 0.05f;

// Largest cosine between an axis and any direction within a cone of half angle asin(sin_bound)
// around a direction at `cosine` to the axis.
inline float widest_cosine(float cosine, float sin_bound) {
    const float cos_bound = std::sqrt(std::max(1.0f - sin_bound * sin_bound, 0.0f));
    const float sine = std::sqrt(std::max(1.0f - cosine * cosine, 0.0f));
    const float turned = cosine * cos_bound + sine * sin_bound;
    const float outside = cosine >= cos_bound ? 1.0f : turned;
    return sin_bound >= 1.0f ? 1.0f : outside;
}

}  // namespace

LightBound bound_lamp(const Lamp& lamp) {
    LightBound bound;
    const float strength = average(glm::abs(lamp.radiance));
    bound.center = lamp.center;
    bound.axis = lamp.frame.z;
    bound.strength = strength;
    switch (lamp.shape) {
        case LampShape::Point:
            break;
        case LampShape::Disc:
        case LampShape::Sphere:
            bound.area = kPi * lamp.radius * lamp.radius;
            bound.strength = strength * bound.area;
            bound.radius = lamp.radius;
            break;
        case LampShape::Rectangle:
        case LampShape::Ellipse:
            bound.orientation = EmitterOrientation::Front;
            bound.area = lamp.area;
            bound.strength = strength * lamp.area;
            bound.radius = glm::length(lamp.frame.x) * lamp.half_u + lamp.half_v;
            if (lamp.shape == LampShape::Ellipse) {
                bound.radius = lamp.orthogonal ? std::max(lamp.half_u, lamp.half_v) : bound.radius;
            } else if (lamp.orthogonal) {
                bound.radius = std::sqrt(lamp.half_u * lamp.half_u + lamp.half_v * lamp.half_v);
            }
            if (lamp.spread.active) {
                bound.reach = lamp.spread.reach;
                bound.spread_scale = lamp.spread.scale;
            }
            break;
        case LampShape::Beam:
            bound.distance = EmitterDistance::Distant;
            bound.center = -lamp.frame.z;
            break;
        case LampShape::DistantPoint:
            bound.distance = EmitterDistance::Distant;
            break;
        case LampShape::DistantDisc:
        case LampShape::DistantCone: {
            bound.distance = EmitterDistance::Distant;
            const float drop = lamp.one_minus_cos;
            bound.radius = std::sqrt(drop * (2.0f - drop));
            bound.strength = strength * kPi * bound.radius * bound.radius;
            break;
        }
    }
    if (lamp.cone.active) {
        bound.orientation = EmitterOrientation::Cone;
        bound.axis = normalize_or(lamp.cone.axis, Vec3(0, 0, -1));
        // The widest cone over the azimuth, as the object's scale stretches it.
        const float along = glm::length(lamp.cone.axis);
        const float stretch =
            along / std::max(std::min(glm::length(lamp.cone.u), glm::length(lamp.cone.v)), 1e-20f);
        const float tangent = safe_sqrt(1.0f - sqr(lamp.cone.cos_half)) /
                              std::max(lamp.cone.cos_half, 1e-6f) * stretch;
        bound.cos_limit = 1.0f / std::sqrt(1.0f + tangent * tangent) - 1e-4f;
        bound.cos_width = std::max(lamp.cone.width, 1e-3f);
    }
    return bound;
}

LightSelection::LightSelection(std::span<const LightBound> bounds, float scene_radius)
    : count_(static_cast<std::uint32_t>(bounds.size())) {
    if (count_ <= kMaxEstimated) {
        for (std::size_t i = 0; i < kMaxEstimated; ++i) {
            set_column(i, i < count_ ? bounds[i] : LightBound{});
        }
        return;
    }
    const float radius = std::isfinite(scene_radius) ? std::max(scene_radius, 1e-3f) : 1.0f;
    std::vector<float> strengths;
    strengths.reserve(bounds.size());
    for (const LightBound& bound : bounds) {
        const bool local = bound.distance == EmitterDistance::Local;
        strengths.push_back(bound.strength / (local ? radius * radius : 1.0f));
    }
    by_strength_ = AliasTable(strengths);
}

void LightSelection::set_column(std::size_t i, const LightBound& bound) {
    Columns& c = columns_;
    c.center_x[i] = bound.center.x;
    c.center_y[i] = bound.center.y;
    c.center_z[i] = bound.center.z;
    c.axis_x[i] = bound.axis.x;
    c.axis_y[i] = bound.axis.y;
    c.axis_z[i] = bound.axis.z;
    c.local[i] = bound.distance == EmitterDistance::Local ? 1.0f : 0.0f;
    c.strength[i] = bound.strength;
    c.radius[i] = bound.radius;
    // Irradiance does not exceed pi times the radiance, strength / area.
    c.min_distance2[i] = std::max(bound.area * kInvPi, 1e-20f);
    c.min_received[i] = bound.distance == EmitterDistance::Ambient ? 1.0f : kMinReceiverCosine;
    c.mirror[i] = bound.orientation == EmitterOrientation::TwoSided ? -1.0f : 1.0f;
    c.cutoff[i] = bound.orientation == EmitterOrientation::Front ? 0.0f : -2.0f;
    const bool cone = bound.orientation == EmitterOrientation::Cone;
    const bool any = bound.orientation == EmitterOrientation::Any;
    c.cone_limit[i] = cone ? bound.cos_limit : (any ? -3.0f : 0.0f);
    c.cone_scale[i] = cone ? 1.0f / bound.cos_width : 1.0f;
    c.cone_floor[i] = cone ? kMinConeFactor : 0.0f;
    const bool spread = bound.reach < kInfinity;
    c.spread_scale[i] = bound.spread_scale;
    c.spread_slope[i] = spread ? 1.0f / bound.reach : 0.0f;
    // The lit part of the emitter is a disc of radius reach times height.
    c.lit_bias[i] = spread ? 0.0f : 1.0f;
    c.lit_scale[i] = spread ? kPi * bound.reach * bound.reach / bound.area : 0.0f;
}

// strength x cosine there x cosine here / distance^2, with the cosines' upper bounds over a sphere
// around the emitter. Selections instead of branches, so that the loop runs on SIMD lanes.
float LightSelection::estimate(const LightSampleContext& context, Column& weights) const {
    const Columns& c = columns_;
    const float min_received = context.transmits ? 1.0f : 0.0f;
    const Vec3 p = context.p;
    const Vec3 n = context.n;
    constexpr std::size_t kLanes = 8;
    const std::size_t used = (count_ + kLanes - 1) / kLanes * kLanes;
    for (std::size_t i = 0; i < used; ++i) {
        const float x = c.center_x[i] - c.local[i] * p.x;
        const float y = c.center_y[i] - c.local[i] * p.y;
        const float z = c.center_z[i] - c.local[i] * p.z;
        const float distance2 = std::max(x * x + y * y + z * z, 1e-20f);
        const float distance = std::sqrt(distance2);
        const float inverse = 1.0f / distance;
        const float sin_bound = std::min(c.radius[i] * inverse, 1.0f);

        const float here = (x * n.x + y * n.y + z * n.z) * inverse;
        const float floor = std::max(c.min_received[i], min_received);
        const float received = std::max(widest_cosine(here, sin_bound), floor);

        const float front = -(x * c.axis_x[i] + y * c.axis_y[i] + z * c.axis_z[i]) * inverse;
        const float there = std::max(front, front * c.mirror[i]);
        const float inside = widest_cosine(there, sin_bound) - c.cone_limit[i];
        const float cone = std::min(std::max(inside * c.cone_scale[i], c.cone_floor[i]), 1.0f);

        // Spread: the emitter's nearest point to the foot of the perpendicular.
        const float height = std::max(there * distance, 1e-20f);
        const float sine = std::sqrt(std::max(1.0f - there * there, 0.0f));
        const float lateral = std::max(distance * sine - c.radius[i], 0.0f);
        const float slope = lateral * c.spread_slope[i] / height;
        const float lit = std::min(c.lit_bias[i] + c.lit_scale[i] * height * height, 1.0f);
        const float spread = c.spread_scale[i] * std::max(1.0f - slope, kMinConeFactor) * lit;

        const float value =
            c.strength[i] * received * cone * spread / std::max(distance2, c.min_distance2[i]);
        const float in_cone = inside > 0.0f ? value : 0.0f;
        const float in_front = front > c.cutoff[i] ? in_cone : 0.0f;
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

std::optional<LightSelection::Choice> LightSelection::choose(const LightSampleContext& context,
                                                             double u) const {
    if (count_ == 1) {
        return Choice{0, 1.0f, u};
    }
    if (!by_strength_.empty()) {
        const AliasTable::Sample sample = by_strength_.sample(u);
        return Choice{sample.index, sample.pmf, sample.u};
    }
    Column weights;
    const float sum = estimate(context, weights);
    if (!(sum > 0.0f && sum < kInfinity)) {
        return std::nullopt;
    }
    double rest = u * static_cast<double>(sum);
    Choice choice;
    for (std::uint32_t i = 0; i < size(); ++i) {
        const auto weight = static_cast<double>(weights[i]);
        if (weight > 0.0) {
            // Rounding may run past the end: the last possible group is kept then.
            choice = {i, weights[i] / sum, std::min(rest / weight, 0x1.fffffffffffffp-1)};
            if (rest < weight) {
                break;
            }
        }
        rest -= weight;
    }
    return choice;
}

float LightSelection::pmf(const LightSampleContext& context, std::uint32_t group) const {
    if (count_ == 1) {
        return 1.0f;
    }
    if (!by_strength_.empty()) {
        return by_strength_.pmf(group);
    }
    Column weights;
    const float sum = estimate(context, weights);
    return sum > 0.0f && sum < kInfinity ? weights[group] / sum : 0.0f;
}

}  // namespace pharos
