// A microfacet lobe of the material as a vMF lobe, for the product with what was learned (DESIGN
// "Guiding"; the product itself: guiding/directional_mixture.h).
//
// Reflection: around the mirrored direction, wider than the lobe's peak (prototype2, section 2).
// Refraction spreads the half vectors less than reflection does, by the ratio of the solid angles
// (Walter et al. 2007, eq. 17, at the mean half vector).
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"

namespace pharos {

// kappa 0: no microfacet lobe, or too wide a one for the product to tell more than the mixture.
struct NarrowLobe {
    Vec3 axis{0.0f};  // unit
    float kappa = 0.0f;
};

// wo: unit, away from the surface, on the side of the lobe's normal; on the other side kappa is 0.
[[nodiscard]] NarrowLobe narrow_lobe(const Closure& lobe, const Vec3& wo);

}  // namespace pharos
