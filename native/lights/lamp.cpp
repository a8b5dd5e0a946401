#include "lights/lamp.h"

#include "lights/area_light.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

float smoothstep(float t) {
    const float x = saturate(t);
    return x * x * (3.0f - 2.0f * x);
}

std::optional<LampSample> finish(const LampSample& sample) {
    const bool usable = sample.pdf > 0.0f && sample.pdf < kInfinity && is_finite(sample.L);
    return usable && !is_zero(sample.L) ? std::optional(sample) : std::nullopt;
}

// --- point ---

std::optional<LampSample> sample_point(const Lamp& lamp, const Vec3& p) {
    const Vec3 to_light = lamp.center - p;
    const float distance = glm::length(to_light);
    if (!(distance > 0.0f)) {
        return std::nullopt;
    }
    LampSample sample;
    sample.wi = to_light * (1.0f / distance);
    sample.distance = distance;
    sample.pdf = 1.0f;
    sample.delta = true;
    sample.L = lamp.radiance * (spot_attenuation(lamp.cone, sample.wi) / distance / distance);
    return finish(sample);
}

// --- disc that faces the receiver ---

Vec3 facing_normal(const Lamp& lamp, const Vec3& p) {
    return normalize_or(p - lamp.center, Vec3(0, 0, 1));
}

std::optional<LampSample> sample_disc(const Lamp& lamp, const Vec3& p, const Vec2& u) {
    const Vec3 normal = facing_normal(lamp, p);
    const Frame frame = Frame::from_z(normal);
    const Vec2 point = sample_uniform_disk(u) * lamp.radius;
    const Vec3 to_light = lamp.center - p + frame.x * point.x + frame.y * point.y;
    const float distance2 = length_squared(to_light);
    LampSample sample;
    sample.distance = std::sqrt(distance2);
    sample.wi = to_light * (1.0f / sample.distance);
    const float cosine = -glm::dot(sample.wi, normal);
    sample.pdf = distance2 / (cosine * kPi * lamp.radius * lamp.radius);
    sample.L = lamp.radiance * spot_attenuation(lamp.cone, sample.wi);
    return cosine > 0.0f ? finish(sample) : std::nullopt;
}

std::optional<LampHit> hit_disc(const Lamp& lamp,
                                const Ray& ray,
                                const LightSampleContext* context) {
    const Vec3 from = context != nullptr ? context->p : ray.origin;
    const Vec3 normal = facing_normal(lamp, from);
    const float toward = glm::dot(ray.direction, normal);
    const float t = glm::dot(lamp.center - ray.origin, normal) / toward;
    if (!(toward < 0.0f && t > ray.t_min && t < ray.t_max)) {
        return std::nullopt;
    }
    const Vec3 q = ray.origin + ray.direction * t;
    if (length_squared(q - lamp.center) > lamp.radius * lamp.radius) {
        return std::nullopt;
    }
    LampHit hit;
    hit.t = t;
    hit.L = lamp.radiance * spot_attenuation(lamp.cone, ray.direction);
    if (context != nullptr) {
        hit.pdf = length_squared(q - from) / (-toward * kPi * lamp.radius * lamp.radius);
    }
    return hit;
}

// --- sphere ---

// Density of directions towards the sphere from p; they all are equally likely from outside.
struct SphereView {
    Vec3 axis;
    float distance2 = 0.0f;
    float one_minus_cos = 0.0f;
    bool inside = false;
};

SphereView view_sphere(const Lamp& lamp, const Vec3& p) {
    SphereView view;
    const Vec3 to_center = lamp.center - p;
    view.distance2 = length_squared(to_center);
    const float radius2 = lamp.radius * lamp.radius;
    view.inside = view.distance2 <= radius2;
    if (!view.inside) {
        view.axis = to_center * (1.0f / std::sqrt(view.distance2));
        view.one_minus_cos = one_minus_cos_from_sin2(radius2 / view.distance2);
    }
    return view;
}

float sphere_pdf(const SphereView& view, const LightSampleContext& context, const Vec3& wi) {
    if (!view.inside) {
        return uniform_cone_pdf(view.one_minus_cos);
    }
    return context.transmits ? uniform_sphere_pdf()
                             : cosine_hemisphere_pdf(glm::dot(wi, context.n));
}

// Distance along a unit direction to the sphere: its near side from outside, its far side from
// inside. The offset from the centre's foot is found by subtracting vectors, not squares (Haines et
// al. 2019).
float sphere_distance(const Lamp& lamp, const Vec3& origin, const Vec3& direction, bool inside) {
    const Vec3 to_center = lamp.center - origin;
    const float along = glm::dot(to_center, direction);
    const Vec3 miss = to_center - direction * along;
    const float half_chord = lamp.radius * lamp.radius - length_squared(miss);
    if (half_chord < 0.0f) {
        return -1.0f;
    }
    return inside ? along + std::sqrt(half_chord) : along - std::sqrt(half_chord);
}

std::optional<LampSample> sample_sphere(const Lamp& lamp,
                                        const LightSampleContext& context,
                                        const Vec2& u) {
    const SphereView view = view_sphere(lamp, context.p);
    LampSample sample;
    if (!view.inside) {
        const Vec3 local = sample_uniform_cone(u, view.one_minus_cos);
        sample.wi = Frame::from_z(view.axis).to_world(local);
    } else if (context.transmits) {
        sample.wi = sample_uniform_sphere(u);
    } else {
        sample.wi = Frame::from_z(context.n).to_world(sample_cosine_hemisphere(u));
    }
    sample.pdf = sphere_pdf(view, context, sample.wi);
    const float distance = sphere_distance(lamp, context.p, sample.wi, view.inside);
    // Rounding at the rim of a distant sphere: the tangent point.
    sample.distance = distance > 0.0f ? distance : std::sqrt(view.distance2);
    sample.L = lamp.radiance * (view.inside ? 1.0f : spot_attenuation(lamp.cone, sample.wi));
    return finish(sample);
}

std::optional<LampHit> hit_sphere(const Lamp& lamp,
                                  const Ray& ray,
                                  const LightSampleContext* context) {
    const SphereView view = view_sphere(lamp, context != nullptr ? context->p : ray.origin);
    const float t = sphere_distance(lamp, ray.origin, ray.direction, view.inside);
    if (!(t > ray.t_min && t < ray.t_max)) {
        return std::nullopt;
    }
    LampHit hit;
    hit.t = t;
    hit.L = lamp.radiance * (view.inside ? 1.0f : spot_attenuation(lamp.cone, ray.direction));
    if (context != nullptr) {
        hit.pdf = sphere_pdf(view, *context, ray.direction);
    }
    return hit;
}

// --- sun ---

std::optional<LampSample> sample_sun(const Lamp& lamp, const Vec2& u) {
    LampSample sample;
    sample.distance = kInfinity;
    sample.L = lamp.radiance;
    if (lamp.shape == LampShape::DistantPoint) {
        sample.wi = lamp.center;
        sample.pdf = 1.0f;
        sample.delta = true;
    } else if (lamp.shape == LampShape::DistantCone) {
        sample.wi = lamp.frame.to_world(sample_uniform_cone(u, lamp.one_minus_cos));
        sample.pdf = uniform_cone_pdf(lamp.one_minus_cos);
    } else {
        const Vec2 point = sample_uniform_disk(u) * lamp.radius;
        const float stretch = std::sqrt(1.0f + point.x * point.x + point.y * point.y);
        sample.wi = lamp.frame.to_world(Vec3(point, 1.0f)) * (1.0f / stretch);
        // Radiance and density both grow by 1 / cos^3.
        const float inverse_cos3 = stretch * stretch * stretch;
        sample.L *= inverse_cos3;
        sample.pdf = inverse_cos3 * kInvPi / (lamp.radius * lamp.radius);
    }
    return finish(sample);
}

std::optional<LampHit> hit_sun(const Lamp& lamp,
                               const Vec3& wi,
                               const LightSampleContext* context) {
    // The chord keeps the angle exact where its cosine would not: |wi - axis|^2 = 2 (1 - cos).
    const float drop = 0.5f * length_squared(wi - lamp.center);
    if (drop > lamp.one_minus_cos) {
        return std::nullopt;
    }
    LampHit hit;
    hit.t = kInfinity;
    hit.L = lamp.radiance;
    float pdf = uniform_cone_pdf(lamp.one_minus_cos);
    if (lamp.shape == LampShape::DistantDisc) {
        const float cosine = 1.0f - drop;
        const float inverse_cos3 = 1.0f / (cosine * cosine * cosine);
        hit.L *= inverse_cos3;
        pdf = inverse_cos3 * kInvPi / (lamp.radius * lamp.radius);
    }
    hit.pdf = context != nullptr ? pdf : 0.0f;
    return hit;
}

// --- beam ---

std::optional<LampSample> sample_beam(const Lamp& lamp, const Vec3& p) {
    const Vec3 q = p - lamp.center;
    const float height = glm::dot(q, lamp.frame.z);
    const Vec2 inside(glm::dot(q, lamp.dual_x) / lamp.half_u,
                      glm::dot(q, lamp.dual_y) / lamp.half_v);
    const bool ellipse = lamp.spread.active;
    const bool lit = ellipse ? glm::dot(inside, inside) <= 1.0f
                             : std::abs(inside.x) <= 1.0f && std::abs(inside.y) <= 1.0f;
    if (!(height > 0.0f && lit)) {
        return std::nullopt;
    }
    return LampSample{lamp.radiance, -lamp.frame.z, 1.0f, height, true};
}

}  // namespace

float spot_attenuation(const SpotCone& cone, const Vec3& wi) {
    if (!cone.active) {
        return 1.0f;
    }
    const Vec3 local(-glm::dot(wi, cone.u), -glm::dot(wi, cone.v), -glm::dot(wi, cone.axis));
    const float cosine = cone.extra_cosine ? local.z : local.z / glm::length(local);
    const float above = cosine - cone.cos_half;
    if (!(above > 0.0f)) {
        return 0.0f;
    }
    const float edge = above < cone.width ? smoothstep(above / cone.width) : 1.0f;
    return cone.extra_cosine ? cosine * edge : edge;
}

LampPoint lamp_point(const Lamp& lamp, const Vec3& from, const Vec3& wi, float distance) {
    LampPoint point;
    point.n = -wi;
    if (is_distant(lamp)) {
        point.p = -wi;
        return point;
    }
    point.p = from + wi * distance;
    const Vec3 q = point.p - lamp.center;
    if (lamp.shape == LampShape::Sphere) {
        point.n = normalize_or(q, point.n);
    } else if (lamp.shape >= LampShape::Rectangle) {
        point.n = lamp.frame.z;
        const float along_u = 0.5f * glm::dot(q, lamp.dual_x) / lamp.half_u;
        const float along_v = 0.5f * glm::dot(q, lamp.dual_y) / lamp.half_v;
        point.u = along_v + 0.5f;
        point.v = -along_u - along_v;
    }
    return point;
}

std::optional<LampSample> sample_lamp(const Lamp& lamp,
                                      const LightSampleContext& context,
                                      const Vec2& u) {
    switch (lamp.shape) {
        case LampShape::Point:
            return sample_point(lamp, context.p);
        case LampShape::Disc:
            return sample_disc(lamp, context.p, u);
        case LampShape::Sphere:
            return sample_sphere(lamp, context, u);
        case LampShape::Rectangle:
        case LampShape::Ellipse: {
            const auto sample = sample_area_light(lamp, context.p, u);
            return sample ? finish(*sample) : std::nullopt;
        }
        case LampShape::Beam:
            return sample_beam(lamp, context.p);
        default:
            return sample_sun(lamp, u);
    }
}

std::optional<LampHit> hit_lamp(const Lamp& lamp,
                                const Ray& ray,
                                const LightSampleContext* context) {
    switch (lamp.shape) {
        case LampShape::Disc:
            return hit_disc(lamp, ray, context);
        case LampShape::Sphere:
            return hit_sphere(lamp, ray, context);
        case LampShape::Rectangle:
        case LampShape::Ellipse:
            return hit_area_light(lamp, ray, context);
        case LampShape::DistantDisc:
        case LampShape::DistantCone:
            return hit_sun(lamp, ray.direction, context);
        default:
            return std::nullopt;
    }
}

}  // namespace pharos
