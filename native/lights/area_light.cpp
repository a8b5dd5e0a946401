#include "lights/area_light.h"

#include "lights/spherical_rectangle.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

// Below this ratio of the squared diagonal to the squared distance the solid angle is uniform over
// the area within some percent.
constexpr float kNearRatio = 0.02f;
// Solid angles below are known to less than 1e-3 in float32.
constexpr float kMinSolidAngle = 1e-3f;

// The lamp as a receiver sees it: the part that can shine there, relative to the foot of the
// perpendicular from the receiver.
struct AreaView {
    Vec2 foot;                   // receiver in the lamp's plane coordinates
    Vec2 lower, upper;           // sampled rectangle relative to foot
    float height = 0.0f;         // above the plane
    bool whole_ellipse = false;  // the ellipse is sampled, not the rectangle
};

std::optional<AreaView> view_from(const Lamp& lamp, const Vec3& p) {
    const Vec3 q = p - lamp.center;
    AreaView view;
    view.height = glm::dot(q, lamp.frame.z);
    if (!(view.height > 0.0f)) {
        return std::nullopt;
    }
    view.foot = Vec2(glm::dot(q, lamp.dual_x), glm::dot(q, lamp.dual_y));
    const Vec2 half(lamp.half_u, lamp.half_v);
    view.lower = -half - view.foot;
    view.upper = half - view.foot;
    if (lamp.spread.active) {
        // Light arrives from within a disc around the foot; a margin keeps its rim.
        const float reach = view.height * lamp.spread.reach * 1.0001f;
        const Vec2 limit(reach * glm::length(lamp.dual_x), reach * glm::length(lamp.dual_y));
        view.lower = glm::max(view.lower, -limit);
        view.upper = glm::min(view.upper, limit);
        if (!(view.lower.x < view.upper.x && view.lower.y < view.upper.y)) {
            return std::nullopt;
        }
    }
    if (lamp.shape == LampShape::Ellipse) {
        const Vec2 size = view.upper - view.lower;
        view.whole_ellipse = size.x * size.y > kPi * lamp.half_u * lamp.half_v;
    }
    return view;
}

// The spherical rectangle where it is worth its cost and exact enough.
std::optional<SphericalRectangle> spherical_view(const Lamp& lamp, const AreaView& view) {
    if (lamp.shape != LampShape::Rectangle || !lamp.orthogonal) {
        return std::nullopt;
    }
    const Vec2 size = view.upper - view.lower;
    const Vec2 middle = 0.5f * (view.upper + view.lower);
    const float distance2 = glm::dot(middle, middle) + view.height * view.height;
    if (glm::dot(size, size) < kNearRatio * distance2) {
        return std::nullopt;
    }
    const SphericalRectangle r = SphericalRectangle::make(view.lower, view.upper, view.height);
    return r.solid_angle > kMinSolidAngle ? std::optional(r) : std::nullopt;
}

float sampled_area(const Lamp& lamp, const AreaView& view) {
    if (view.whole_ellipse) {
        return lamp.area;
    }
    const Vec2 size = view.upper - view.lower;
    // Plane coordinates are metres along unit axes; sheared axes span less.
    const float skew = glm::length(glm::cross(lamp.frame.x, lamp.frame.y));
    return size.x * size.y * skew;
}

}  // namespace

float spread_factor(const Lamp& lamp, const Vec3& wi) {
    if (!lamp.spread.active) {
        return 1.0f;
    }
    const float cosine = -glm::dot(wi, lamp.frame.z);
    if (!(cosine > 0.0f)) {
        return 0.0f;
    }
    const float tangent = glm::length(glm::cross(wi, lamp.frame.z)) / cosine;
    return lamp.spread.scale * std::max(1.0f - lamp.spread.slope * tangent, 0.0f);
}

std::optional<LampSample> sample_area_light(const Lamp& lamp, const Vec3& p, const Vec2& u) {
    const std::optional<AreaView> view = view_from(lamp, p);
    if (!view) {
        return std::nullopt;
    }
    const std::optional<SphericalRectangle> spherical = spherical_view(lamp, *view);
    Vec2 point;  // relative to the foot
    if (spherical) {
        point = spherical->sample(u);
    } else if (view->whole_ellipse) {
        point = sample_uniform_disk(u) * Vec2(lamp.half_u, lamp.half_v) - view->foot;
    } else {
        point = glm::mix(view->lower, view->upper, u);
        const Vec2 inside = (point + view->foot) / Vec2(lamp.half_u, lamp.half_v);
        if (lamp.shape == LampShape::Ellipse && glm::dot(inside, inside) > 1.0f) {
            return std::nullopt;
        }
    }
    const Vec3 to_light =
        lamp.frame.x * point.x + lamp.frame.y * point.y - lamp.frame.z * view->height;
    const float distance2 = length_squared(to_light);
    const float distance = std::sqrt(distance2);
    LampSample sample;
    sample.wi = to_light * (1.0f / distance);
    sample.distance = distance;
    sample.L = lamp.radiance * spread_factor(lamp, sample.wi);
    const float cosine = view->height / distance;
    sample.pdf = spherical ? 1.0f / spherical->solid_angle
                           : distance2 / (cosine * sampled_area(lamp, *view));
    const bool usable =
        distance2 > 0.0f && sample.pdf > 0.0f && sample.pdf < kInfinity && is_finite(sample.L);
    return usable && !is_zero(sample.L) ? std::optional(sample) : std::nullopt;
}

float area_light_pdf(const Lamp& lamp, const Vec3& p, const Vec3& q) {
    const std::optional<AreaView> view = view_from(lamp, p);
    if (!view) {
        return 0.0f;
    }
    if (const auto spherical = spherical_view(lamp, *view)) {
        return 1.0f / spherical->solid_angle;
    }
    const float distance2 = length_squared(q - p);
    const float cosine = view->height / std::sqrt(distance2);
    return distance2 / (cosine * sampled_area(lamp, *view));
}

std::optional<LampHit> hit_area_light(const Lamp& lamp,
                                      const Ray& ray,
                                      const LightSampleContext* context) {
    // Only the front is seen.
    const float toward = glm::dot(ray.direction, lamp.frame.z);
    if (!(toward < 0.0f)) {
        return std::nullopt;
    }
    const float t = glm::dot(lamp.center - ray.origin, lamp.frame.z) / toward;
    if (!(t > ray.t_min && t < ray.t_max)) {
        return std::nullopt;
    }
    const Vec3 q = ray.origin + ray.direction * t - lamp.center;
    const Vec2 inside(glm::dot(q, lamp.dual_x) / lamp.half_u,
                      glm::dot(q, lamp.dual_y) / lamp.half_v);
    const bool hit = lamp.shape == LampShape::Ellipse
                         ? glm::dot(inside, inside) <= 1.0f
                         : std::abs(inside.x) <= 1.0f && std::abs(inside.y) <= 1.0f;
    const float factor = hit ? spread_factor(lamp, ray.direction) : 0.0f;
    if (!(factor > 0.0f)) {
        return std::nullopt;
    }
    LampHit result;
    result.t = t;
    result.L = lamp.radiance * factor;
    if (context != nullptr) {
        result.pdf = area_light_pdf(lamp, context->p, lamp.center + q);
    }
    // A spread too narrow for its density is seen by nobody.
    return is_finite(result.L) && result.pdf >= 0.0f ? std::optional(result) : std::nullopt;
}

}  // namespace pharos
