// A camera with its image window already resolved from sensor, fit, shift and zoom.
#pragma once

#include <cstdint>

#include "core/math.h"

namespace pharos {

enum class CameraType : std::uint32_t { Perspective, Orthographic };

// The image plane window: at distance 1 for a perspective camera, in metres for an orthographic
// one. Pixel (x, y), origin bottom left, looks through lower + (x/width, y/height) * (upper -
// lower).
struct CameraDescription {
    CameraType type = CameraType::Perspective;
    Mat4 to_world{1.0f};  // looks along local -Z, +Y up; no scale
    Vec2 window_lower{-1.0f};
    Vec2 window_upper{1.0f};
    float near_clip = 0.1f;  // planes
    float far_clip = 1000.0f;
    float lens_radius = 0.0f;  // 0: pinhole
    float focus_distance = 10.0f;
    float aperture_ratio = 1.0f;
    std::uint32_t aperture_blades = 0;
    float aperture_rotation = 0.0f;

    bool operator==(const CameraDescription&) const = default;
};

}  // namespace pharos
