// Descriptions to lamps: units and shapes of each Blender version.

#include "lights/lamp.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

// Bulbs this small cannot be met by a float32 ray and would overflow their radiance.
constexpr float kMinRadius = 1e-7f;

// Of sizes and positions: their squares, and sums of them, are numbers.
constexpr float kLargest = 1e15f;

float finite_or(float value, float fallback) {
    return std::isfinite(value) ? value : fallback;
}

// Object scale enters the cone as 1 / length along each axis.
SpotCone make_cone(const LightDescription& d, std::uint32_t version) {
    SpotCone cone;
    cone.active = true;
    cone.extra_cosine = version < 305;
    const float angle = std::clamp(finite_or(d.spot_angle, 0.0f), 0.0f, kPi);
    cone.cos_half = std::cos(0.5f * angle);
    cone.width = (1.0f - cone.cos_half) * saturate(finite_or(d.spot_blend, 0.0f));
    const Vec3 fallback[3] = {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
    Vec3 rows[3];
    for (int i = 0; i < 3; ++i) {
        const Vec3 column(d.to_world[i]);
        const Vec3 unit = normalize_or(column, fallback[i]);
        const float length = glm::length(column);
        const bool scaled = !cone.extra_cosine && length > 1e-15f && std::isfinite(length);
        rows[i] = unit * (scaled ? 1.0f / length : 1.0f);
    }
    cone.u = rows[0];
    cone.v = rows[1];
    cone.axis = -rows[2];
    return cone;
}

bool make_bulb(const LightDescription& d, std::uint32_t version, Lamp& lamp) {
    const float radius = std::clamp(finite_or(d.radius, 0.0f), 0.0f, kLargest);
    lamp.radiance = d.strength * (0.25f * kInvPi);
    if (d.type == LightType::Spot) {
        lamp.cone = make_cone(d, version);
    }
    if (radius <= kMinRadius) {
        lamp.shape = LampShape::Point;
        return true;
    }
    const bool disc = version < 400 || (version >= 401 && d.soft_falloff);
    lamp.shape = disc ? LampShape::Disc : LampShape::Sphere;
    lamp.radius = radius;
    if (d.normalize) {
        lamp.radiance *= 1.0f / (kPi * radius) / radius;
    }
    return true;
}

AreaSpread make_spread(float spread, std::uint32_t version) {
    AreaSpread result;
    constexpr double kDegree = std::numbers::pi / 180.0;
    const double full = static_cast<double>(std::isfinite(spread) ? spread : kPi);
    const double half = 0.5 * (version < 400 ? std::max(full, kDegree) : full);
    if (half >= 0.5 * std::numbers::pi * 0.99999) {
        return result;
    }
    // Scale 1 / (1 - h cot h) keeps the flux; its denominator is h^2 / 3 + h^4 / 45 + ... for small
    // h.
    const double cotangent = 1.0 / std::tan(half);
    const double squared = half * half;
    const double denominator =
        half < 0.05 ? squared * (1.0 / 3.0 + squared / 45.0) : 1.0 - half * cotangent;
    result.active = true;
    result.slope = static_cast<float>(cotangent);
    result.reach = static_cast<float>(1.0 / cotangent);
    result.scale = static_cast<float>(1.0 / denominator);
    return result;
}

bool make_area(const LightDescription& d, std::uint32_t version, Lamp& lamp) {
    const Vec3 side_u = Vec3(d.to_world[0]) * d.size_u;
    const Vec3 side_v = Vec3(d.to_world[1]) * d.size_v;
    const Vec3 across = glm::cross(side_u, side_v);
    const float parallelogram = glm::length(across);
    if (!(parallelogram > 1e-20f) || !std::isfinite(parallelogram)) {
        return false;
    }
    const bool ellipse = d.shape == AreaShape::Ellipse;
    lamp.shape = ellipse ? LampShape::Ellipse : LampShape::Rectangle;
    lamp.area = parallelogram * (ellipse ? 0.25f * kPi : 1.0f);
    Vec3 normal = across * (1.0f / parallelogram);
    // Local -Z shines, mirrored or not.
    if (glm::dot(normal, Vec3(d.to_world[2])) > 0.0f) {
        normal = -normal;
    }
    lamp.frame = {normalize_or(side_u, Vec3(0.0f)), normalize_or(side_v, Vec3(0.0f)), normal};
    if (is_zero(lamp.frame.x) || is_zero(lamp.frame.y)) {
        return false;
    }
    lamp.half_u = 0.5f * glm::length(side_u);
    lamp.half_v = 0.5f * glm::length(side_v);
    if (!(std::max(lamp.half_u, lamp.half_v) <= kLargest)) {
        return false;
    }
    const float skew = glm::dot(lamp.frame.x, lamp.frame.y);
    lamp.orthogonal = std::abs(skew) < 1e-4f;
    const float inverse = 1.0f / (1.0f - skew * skew);
    lamp.dual_x = (lamp.frame.x - lamp.frame.y * skew) * inverse;
    lamp.dual_y = (lamp.frame.y - lamp.frame.x * skew) * inverse;

    const float per_area = d.normalize ? 1.0f / lamp.area : 1.0f;
    lamp.radiance = d.strength * (per_area * (version < 400 ? 0.25f : kInvPi));
    if (version >= 400 && d.spread <= 0.0f) {
        lamp.shape = LampShape::Beam;
        lamp.spread.active = ellipse;  // which outline the beam has
        lamp.radiance *= kPi;
        return true;
    }
    lamp.spread = make_spread(d.spread, version);
    return true;
}

bool make_sun(const LightDescription& d, std::uint32_t version, Lamp& lamp) {
    const Vec3 axis = Vec3(d.to_world[2]);
    const float size = max_component(glm::abs(axis));  // so that the square is a number
    lamp.center = normalize_or(size > 0.0f ? axis / size : Vec3(0.0f), Vec3(0, 0, 1));
    lamp.frame = Frame::from_z(lamp.center);
    lamp.radiance = d.strength;
    const float angle = std::clamp(finite_or(d.angle, 0.0f), 0.0f, kPi);
    if (angle < 1e-6f) {
        lamp.shape = LampShape::DistantPoint;
        return true;
    }
    // A disc at distance 1 has no tangent at 90 degrees.
    const bool disc = version < 400;
    const float half = disc ? std::min(0.5f * angle, 1.57f) : 0.5f * angle;
    lamp.shape = disc ? LampShape::DistantDisc : LampShape::DistantCone;
    lamp.one_minus_cos = 2.0f * sqr(std::sin(0.5f * half));
    lamp.radius = std::tan(half);
    if (d.normalize) {
        lamp.radiance *= 1.0f / (kPi * sqr(disc ? lamp.radius : std::sin(half)));
    }
    return true;
}

bool is_delta(LampShape shape) {
    return shape == LampShape::Point || shape == LampShape::Beam ||
           shape == LampShape::DistantPoint;
}

}  // namespace

std::optional<Lamp> make_lamp(const LightDescription& d,
                              std::uint32_t blender_version,
                              std::uint32_t index) {
    if (!is_finite(d.strength) || is_zero(d.strength)) {
        return std::nullopt;
    }
    Lamp lamp;
    lamp.cast_shadow = d.cast_shadow;
    lamp.visibility = d.visibility;
    lamp.max_bounces = d.max_bounces;
    lamp.index = index;
    lamp.program = d.program;
    lamp.center = Vec3(d.to_world[3]);
    bool shines = max_component(glm::abs(lamp.center)) <= kLargest;  // false for NaN
    switch (d.type) {
        case LightType::Point:
        case LightType::Spot:
            shines = shines && make_bulb(d, blender_version, lamp);
            break;
        case LightType::Area:
            shines = shines && make_area(d, blender_version, lamp);
            break;
        case LightType::Sun:
            shines = make_sun(d, blender_version, lamp);
            break;
        default:
            shines = false;
    }
    lamp.hittable = d.use_mis && !is_delta(lamp.shape);
    return shines && is_finite(lamp.radiance) ? std::optional(lamp) : std::nullopt;
}

}  // namespace pharos
