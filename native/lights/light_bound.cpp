#include "lights/light_bound.h"

#include <algorithm>
#include <cmath>

#include "core/color.h"

namespace pharos {

namespace {

// Axes that differ by less count as one.
constexpr float kSameAxis = 0.999f;

// Half angle of the cone around `axis` that a bound shines into.
float emission_angle(const LightBound& bound) {
    switch (bound.orientation) {
        case EmitterOrientation::Front:
            return 0.5f * kPi;
        case EmitterOrientation::Cone:
            return std::acos(std::clamp(bound.cos_limit, -1.0f, 1.0f));
        case EmitterOrientation::Any:
        case EmitterOrientation::TwoSided:
            break;
    }
    return kPi;
}

bool all_two_sided_along(std::span<const LightBound> bounds, const Vec3& axis) {
    return std::ranges::all_of(bounds, [&](const LightBound& b) {
        return b.orientation == EmitterOrientation::TwoSided &&
               std::abs(glm::dot(b.axis, axis)) >= kSameAxis;
    });
}

// The cone around the mean axis that holds all cones; full light towards the axis, falling off
// linearly in the cosine as that of plane emitters does.
void merge_orientation(std::span<const LightBound> bounds, LightBound& merged) {
    merged.orientation = EmitterOrientation::Any;
    if (all_two_sided_along(bounds, bounds.front().axis)) {
        merged.orientation = EmitterOrientation::TwoSided;
        merged.axis = bounds.front().axis;
        return;
    }
    Vec3 sum(0.0f);
    for (const LightBound& b : bounds) {
        sum += b.axis;
    }
    const Vec3 axis = normalize_or(sum, Vec3(0.0f));
    float widest = is_zero(axis) ? kPi : 0.0f;
    for (const LightBound& b : bounds) {
        const float turned = std::acos(std::clamp(glm::dot(b.axis, axis), -1.0f, 1.0f));
        widest = std::max(widest, turned + emission_angle(b));
    }
    if (widest < kPi) {
        merged.orientation = EmitterOrientation::Cone;
        merged.axis = axis;
        merged.cos_limit = std::cos(widest) - 1e-3f;
        merged.cos_width = 1.0f - std::max(merged.cos_limit, 0.0f);
    }
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

LightBound merge_bounds(std::span<const LightBound> bounds) {
    LightBound merged;
    for (const LightBound& b : bounds) {
        merged.strength += b.strength;
    }
    if (bounds.front().distance != EmitterDistance::Local) {
        // From anywhere around: a cone of half a turn about any direction.
        merged.distance = EmitterDistance::Ambient;
        merged.center = Vec3(0.0f, 0.0f, 1.0f);
        return merged;
    }
    Bounds3 box;
    for (const LightBound& b : bounds) {
        box.extend(b.center - Vec3(b.radius));
        box.extend(b.center + Vec3(b.radius));
    }
    merged.center = box.center();
    for (const LightBound& b : bounds) {
        merged.radius = std::max(merged.radius, glm::length(b.center - merged.center) + b.radius);
    }
    // Within, the distance to the nearest of them is unknown: half of the radius is taken for it.
    merged.area = kPi * sqr(0.5f * merged.radius);
    merge_orientation(bounds, merged);
    return merged;
}

}  // namespace pharos
