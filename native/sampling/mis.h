// Weights of multiple importance sampling for two techniques, one sample each (Veach 1997,
// section 9.2).
//
// Densities may be 0 or infinite (a density that overflowed wins against any finite one). Both
// weights of a pair sum to 1 wherever one of the densities is positive. Ratios, not squares: no
// overflow.
#pragma once

#include "core/math.h"

namespace pharos {

// Weight of the technique with density `pdf` against one with density `other`, equation 9.11.
[[nodiscard]] inline float power_heuristic(float pdf, float other) {
    if (!(pdf > 0.0f)) {
        return 0.0f;
    }
    if (pdf >= other) {
        const float ratio = pdf == other ? 1.0f : other / pdf;
        return 1.0f / (1.0f + ratio * ratio);
    }
    const float ratio = pdf / other;
    const float squared = ratio * ratio;
    return squared / (1.0f + squared);
}

// Equation 9.8.
[[nodiscard]] inline float balance_heuristic(float pdf, float other) {
    if (!(pdf > 0.0f)) {
        return 0.0f;
    }
    if (pdf >= other) {
        return pdf == other ? 0.5f : 1.0f / (1.0f + other / pdf);
    }
    const float ratio = pdf / other;
    return ratio / (1.0f + ratio);
}

}  // namespace pharos
