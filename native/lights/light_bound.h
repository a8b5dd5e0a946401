// What the choice of a light knows of an emitter without sampling it: where it is, how strong,
// which way it shines. Bounds of several emitters make nodes of the light tree.
#pragma once

#include <cstdint>
#include <span>

#include "core/math.h"
#include "lights/lamp.h"

namespace pharos {

enum class EmitterOrientation : std::uint8_t {
    Any,       // the same in all directions
    Front,     // cosine around axis, nothing behind the plane through the center
    TwoSided,  // |cosine| around axis
    Cone,      // a spot's
};

enum class EmitterDistance : std::uint8_t { Local, Distant, Ambient };

struct LightBound {
    EmitterDistance distance = EmitterDistance::Local;
    EmitterOrientation orientation = EmitterOrientation::Any;
    float strength = 0.0f;  // irradiance across: Local at 1 m in the main direction, else anywhere
    float radius = 0.0f;    // of a sphere around the emitter; Distant: sine of the half angle
    float area = 0.0f;      // keeps irradiance finite nearby
    float cos_limit = -1.0f;  // Cone: no light outside
    float cos_width = 0.0f;   // Cone: full light this much further in
    float reach = kInfinity;  // Front with spread: tangent of the widest angle
    float spread_scale = 1.0f;
    Vec3 center;  // Distant: direction towards it
    Vec3 axis;    // of the emission
};

[[nodiscard]] LightBound bound_lamp(const Lamp& lamp);

// Of all together: encloses every emitter, shines wherever one of them does, and is as strong as
// their sum. `bounds` holds either local emitters only or none of them.
[[nodiscard]] LightBound merge_bounds(std::span<const LightBound> bounds);

}  // namespace pharos
