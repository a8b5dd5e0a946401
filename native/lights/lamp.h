// A lamp ready to sample: plain data, one record for every kind, made from its description by the
// formulas of the given Blender version (cycles-parity 2.1).
//
// Versions: disc-shaped bulbs and radiance S / (4 A) of areas before 4.0; spheres (unless soft
// falloff, from 4.1) and S / (pi A) from 4.0; spots lose an extra cosine and follow the object's
// scale from 3.5.
#pragma once

#include <cstdint>
#include <optional>

#include "core/math.h"
#include "lights/light.h"
#include "lights/light_description.h"

namespace pharos {

enum class LampShape : std::uint8_t {
    Point,  // delta
    Disc,   // always faces the receiver
    Sphere,
    Rectangle,
    Ellipse,
    Beam,          // an area with spread 0: delta, parallel light over the area
    DistantPoint,  // delta
    DistantDisc,   // sun before 4.0: a flat disc at distance 1
    DistantCone,   // sun from 4.0: constant radiance over a cone
};

// Attenuation of a spot by smoothstep(cosine - cos_half) / width.
struct SpotCone {
    bool active = false;
    bool extra_cosine = false;  // before 3.5
    float cos_half = -1.0f;
    float width = 0.0f;  // 0: a step
    Vec3 u, v, axis;  // rows of the map into the spot's space; axis points along the light's travel
};

// Factor scale * max(1 - slope * tan(a), 0), a = angle to the normal.
struct AreaSpread {
    bool active = false;
    float slope = 0.0f;       // cot(half spread)
    float reach = kInfinity;  // tan(half spread)
    float scale = 1.0f;
};

struct Lamp {
    LampShape shape = LampShape::Point;
    bool cast_shadow = true;
    bool hittable = false;   // rays may meet it by chance
    bool orthogonal = true;  // area: u and v at right angles
    std::uint32_t visibility = kVisibleAll;
    std::uint32_t max_bounces = 1024;
    std::uint32_t index = 0;  // in the description
    std::uint32_t program = kNone;
    Vec3 center;          // distant: unit vector towards the light
    Rgb radiance{0.0f};   // Point: intensity; DistantPoint and Beam: irradiance across the light
    float radius = 0.0f;  // Disc, Sphere; DistantDisc: tan of the half angle
    float one_minus_cos = 0.0f;  // DistantCone, DistantDisc: of the half angle
    Frame frame;                 // area: x, y along its sides, z its normal; distant: z = center
    Vec3 dual_x, dual_y;         // area: q = dot(q, dual_x) x + dot(q, dual_y) y within its plane
    float half_u = 0.0f;         // area: half extents along frame.x, frame.y
    float half_v = 0.0f;
    float area = 0.0f;  // m2, of Rectangle and Ellipse
    SpotCone cone;
    AreaSpread spread;
};

[[nodiscard]] inline bool is_distant(const Lamp& lamp) {
    return lamp.shape >= LampShape::DistantPoint;
}

// nullopt: the lamp cannot shine (no strength, no area, non-finite input).
[[nodiscard]] std::optional<Lamp> make_lamp(const LightDescription& description,
                                            std::uint32_t blender_version,
                                            std::uint32_t index);

// pdf is of the direction alone (solid angle), without the choice of the lamp; delta: 1.
struct LampSample {
    Rgb L{0.0f};
    Vec3 wi;
    float pdf = 0.0f;
    float distance = 0.0f;
    bool delta = false;
};

struct LampHit {
    Rgb L{0.0f};
    float t = 0.0f;
    float pdf = 0.0f;  // of sampling this direction from the context; 0 without one
};

// What a lamp's nodes are told of the point of it that shines along -wi, `distance` from `from`.
[[nodiscard]] LampPoint lamp_point(const Lamp& lamp,
                                   const Vec3& from,
                                   const Vec3& wi,
                                   float distance);

// nullopt where nothing arrives.
[[nodiscard]] std::optional<LampSample> sample_lamp(const Lamp& lamp,
                                                    const LightSampleContext& context,
                                                    const Vec2& u);

// The lamp's surface along a ray; `context` is null for rays that no light sample competes with.
[[nodiscard]] std::optional<LampHit> hit_lamp(const Lamp& lamp,
                                              const Ray& ray,
                                              const LightSampleContext* context);

// Factor of the spot's cone for light that travels along -wi; 1 for other lamps.
[[nodiscard]] float spot_attenuation(const SpotCone& cone, const Vec3& wi);

}  // namespace pharos
