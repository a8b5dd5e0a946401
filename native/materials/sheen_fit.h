// Parameters of the microfibre sheen of Blender 4.x as a linearly transformed cosine
// (Zeltner, Burley, Chiang 2022, "Practical Multiple-Scattering Sheen Using LTCs").
#pragma once

#include "core/math.h"

namespace pharos {

// See lobes/sheen.h for the transform.
struct SheenLtc {
    float a = 1.0f;
    float b = 0.0f;
    float albedo = 0.0f;
};

// mu = cos of the view direction, in [0, 1]; roughness in [1e-3, 1].
[[nodiscard]] SheenLtc sheen_ltc(float mu, float roughness);

}  // namespace pharos
