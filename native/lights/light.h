// The light contract: what illuminates a point, how to sample it, and the density of a chance hit.
//
// A LightSample's pdf includes the choice of the light and is per solid angle as seen from the
// context point; a delta light's pdf is the discrete probability of its choice and its L already
// holds the inverse-square law (so contribution = f_cos * L / pdf in both cases). Chance hits use
// the same context as sampling did: the *previous* vertex.
#pragma once

#include <cstdint>
#include <optional>

#include "core/math.h"

namespace pharos {

// The receiving vertex: all a light may look at.
struct LightSampleContext {
    Vec3 p;
    Vec3 n;                  // shading normal on wo's side
    bool transmits = false;  // the surface also receives light from behind n
};

// Light `group` was chosen with probability `pmf`; `u` is what is left of the random number. pmf 0:
// nothing arrives.
struct LightChoice {
    std::uint32_t group = 0;
    float pmf = 0.0f;
    double u = 0.0;
};

// A receiver that asks for a light; `u` is what is left for a point on it.
struct LightQuery {
    LightSampleContext context;
    double u_choice = 0.0;
    Vec2 u;
    LightChoice choice;
};

struct LightSample {
    Rgb L{0.0f};
    Vec3 wi;  // unit, from the context point to the light
    float pdf = 0.0f;
    float distance = 0.0f;  // kInfinity for sun and world
    bool delta = false;     // no ray meets it by chance (also lamps without MIS): MIS weight 1
    bool cast_shadow = true;
    std::uint32_t visibility = 31;  // of the light, for the receiving lobe's type
    std::uint32_t max_bounces = 1024;
};

// A point of a lamp as Cycles tells node trees: of a sun p is where its light travels to; what
// always faces the receiver has n = -wi. u and v: barycentrics such that (1 - u - v, u) runs over
// an area light, along its x and y; elsewhere 0.
struct LampPoint {
    Vec3 p;
    Vec3 n;
    float u = 0.0f;
    float v = 0.0f;
};

// Emission met by a ray, and the density next-event estimation would have had for it.
struct LightHit {
    Rgb L{0.0f};
    float pdf = 0.0f;  // solid angle, choice included; 0: not sampled by NEE
    float distance = 0.0f;
    std::uint32_t light = 0;
    std::uint32_t lamp = 0;               // of the sampler, for lamp_point()
    std::uint32_t program = 0xffffffffu;  // what it emits multiplies L
    std::uint32_t visibility = 31;
};

}  // namespace pharos
