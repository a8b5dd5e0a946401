// A lamp as the host hands it over, in Blender's units (cycles-parity: section 2.1).
#pragma once

#include <cstdint>
#include <string>

#include "core/math.h"
#include "core/visibility.h"

namespace pharos {

enum class LightType : std::uint32_t { Point, Spot, Area, Sun };
enum class AreaShape : std::uint32_t { Rectangle, Ellipse };

// A lamp's node tree is a program of the scene's: what it emits multiplies the strength.
// strength = colour x watts (x blackbody x 2^exposure where the version has them); for a sun W/m2.
struct LightDescription {
    std::string name;
    LightType type = LightType::Point;
    Mat4 to_world{1.0f};  // with the object's scale; lamps shine along local -Z
    Rgb strength{0.0f};
    float radius = 0.0f;      // point, spot
    float spot_angle = 0.0f;  // full cone angle
    float spot_blend = 0.0f;
    AreaShape shape = AreaShape::Rectangle;
    float size_u = 1.0f;  // area: full extents before the object's scale; ellipse: diameters
    float size_v = 1.0f;
    float spread = kPi;
    float angle = 0.0f;  // sun: full angle
    bool soft_falloff = true;
    bool normalize = true;
    bool cast_shadow = true;
    bool use_mis = true;
    std::uint32_t visibility = kVisibleAll;
    std::uint32_t max_bounces = 1024;
    std::uint32_t program = kNone;  // into SceneDescription::light_programs
    bool is_portal = false;  // area: emits nothing, the world's light is looked for through it

    bool operator==(const LightDescription&) const = default;
};

}  // namespace pharos
