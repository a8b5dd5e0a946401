// CIE XYZ to scene-linear Rec.709.
#pragma once

#include "core/math.h"

namespace pharos {

[[nodiscard]] inline Rgb rgb_from_xyz(const Vec3& c) {
    return Rgb(3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z,
               -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
               0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z);
}

}  // namespace pharos
