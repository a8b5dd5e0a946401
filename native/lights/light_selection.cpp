#include "lights/light_selection.h"

#include "core/color.h"

namespace pharos {

namespace {

// The receiver's cosine never counts as less: bump-mapped lobes may see below the horizon of n.
constexpr float kMinReceiverCosine = 0.02f;
constexpr float kMinConeFactor = 0.05f;

// Largest cosine between `axis` and any direction within a cone of half angle asin(sin_bound)
// around a direction at `cosine` to the axis.
float widest_cosine(float cosine, float sin_bound) {
    if (sin_bound >= 1.0f) {
        return 1.0f;
    }
    const float cos_bound = safe_sqrt(1.0f - sin_bound * sin_bound);
    if (cosine >= cos_bound) {
        return 1.0f;
    }
    return cosine * cos_bound + safe_sqrt(1.0f - cosine * cosine) * sin_bound;
}

float receiver_cosine(const LightSampleContext& context, const Vec3& direction, float sin_bound) {
    if (context.transmits) {
        return 1.0f;
    }
    return std::max(widest_cosine(glm::dot(context.n, direction), sin_bound), kMinReceiverCosine);
}

// Cosine or attenuation towards the receiver; `away` is the unit direction from the emitter to it.
float emission_factor(const LightBound& bound, const Vec3& away, float distance, float sin_bound) {
    const float cosine = glm::dot(bound.axis, away);
    switch (bound.orientation) {
        case EmitterOrientation::Any:
            return 1.0f;
        case EmitterOrientation::TwoSided:
            return widest_cosine(std::abs(cosine), sin_bound);
        case EmitterOrientation::Cone: {
            const float inside = widest_cosine(cosine, sin_bound) - bound.cos_limit;
            return inside > 0.0f ? std::clamp(inside / bound.cos_width, kMinConeFactor, 1.0f)
                                 : 0.0f;
        }
        case EmitterOrientation::Front:
            break;
    }
    if (!(cosine > 0.0f)) {
        return 0.0f;
    }
    if (bound.reach == kInfinity) {
        return widest_cosine(cosine, sin_bound);
    }
    // Spread: the nearest point of the emitter to the foot of the perpendicular.
    const float height = cosine * distance;
    const float lateral =
        std::max(distance * safe_sqrt(1.0f - cosine * cosine) - bound.radius, 0.0f);
    const float limit = height * bound.reach;
    if (lateral > limit * 1.001f) {
        return 0.0f;
    }
    const float lit_share = std::min(kPi * limit * limit / bound.area, 1.0f);
    return bound.spread_scale * std::max(1.0f - lateral / limit, kMinConeFactor) * lit_share;
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

float estimate_irradiance(const LightBound& bound, const LightSampleContext& context) {
    if (bound.distance == EmitterDistance::Ambient) {
        return bound.strength;
    }
    if (bound.distance == EmitterDistance::Distant) {
        return bound.strength * receiver_cosine(context, bound.center, bound.radius);
    }
    const Vec3 to_light = bound.center - context.p;
    const float distance2 = std::max(length_squared(to_light), 1e-20f);
    const float inverse = 1.0f / std::sqrt(distance2);
    const Vec3 direction = to_light * inverse;
    const float sin_bound = bound.radius * inverse;
    const float emitted = emission_factor(bound, -direction, distance2 * inverse, sin_bound);
    const float received = receiver_cosine(context, direction, sin_bound);
    // Irradiance does not exceed pi times the radiance, strength / area.
    return bound.strength * emitted * received / std::max(distance2, bound.area * kInvPi);
}

LightSelection::LightSelection(std::vector<LightBound> bounds, float scene_radius)
    : bounds_(std::move(bounds)) {
    if (bounds_.size() <= kMaxEstimated) {
        return;
    }
    const float radius = std::isfinite(scene_radius) ? std::max(scene_radius, 1e-3f) : 1.0f;
    std::vector<float> strengths;
    strengths.reserve(bounds_.size());
    for (const LightBound& bound : bounds_) {
        const bool local = bound.distance == EmitterDistance::Local;
        strengths.push_back(bound.strength / (local ? radius * radius : 1.0f));
    }
    by_strength_ = AliasTable(strengths);
}

float LightSelection::estimate(const LightSampleContext& context,
                               std::array<float, kMaxEstimated>& weights) const {
    float sum = 0.0f;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
        weights[i] = estimate_irradiance(bounds_[i], context);
        sum += weights[i];
    }
    return sum;
}

std::optional<LightSelection::Choice> LightSelection::choose(const LightSampleContext& context,
                                                             double u) const {
    if (bounds_.size() == 1) {
        return Choice{0, 1.0f, u};
    }
    if (!by_strength_.empty()) {
        const AliasTable::Sample sample = by_strength_.sample(u);
        return Choice{sample.index, sample.pmf, sample.u};
    }
    std::array<float, kMaxEstimated> weights;
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
    if (bounds_.size() == 1) {
        return 1.0f;
    }
    if (!by_strength_.empty()) {
        return by_strength_.pmf(group);
    }
    std::array<float, kMaxEstimated> weights;
    const float sum = estimate(context, weights);
    return sum > 0.0f && sum < kInfinity ? weights[group] / sum : 0.0f;
}

}  // namespace pharos
