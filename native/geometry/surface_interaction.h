// A point where a ray met a surface: all that materials, lights and the integrator look at.
//
// wo points back along the ray. ng and ns are unit and face wo's side of the geometric surface
// (flipped together when the back is hit; `front_face` remembers).
#pragma once

#include <cstdint>

#include "core/math.h"

namespace pharos {

struct SurfaceInteraction {
    Vec3 p;
    float t = 0.0f;        // distance along the ray
    Vec3 ng;               // geometric normal, on wo's side
    float p_error = 0.0f;  // bound of |p - exact point|, metres
    Vec3 ns;               // shading normal (interpolated), flipped with ng
    float u = 0.0f;        // barycentric: p = (1-u-v) p0 + u p1 + v p2
    Vec3 wo;
    float v = 0.0f;
    std::uint32_t instance = 0;
    std::uint32_t triangle = 0;
    std::uint32_t material = 0;  // index into the scene's materials
    bool front_face = true;
};

}  // namespace pharos
