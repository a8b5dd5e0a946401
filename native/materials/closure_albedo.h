// Directional albedo of a closure, weight included: for sample weights, layering and roulette.
//
// Contract: exact for Lambert; for microfacets the mean Fresnel over visible normals from the
// tables of energy.h (single-scatter loss included where it is not compensated); estimates
// elsewhere.
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/microfacet.h"

namespace pharos {

// Transparent closures and microfacets too smooth for a density.
[[nodiscard]] inline bool is_delta(const Closure& c) {
    switch (c.type) {
        case ClosureType::Transparent:
            return true;
        case ClosureType::GgxReflection:
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
            return c.alpha_x * c.alpha_y <= kSingularAlphaProduct;
        default:
            return false;
    }
}

struct ClosureAlbedo {
    Rgb reflected{0.0f};
    Rgb transmitted{0.0f};
};

[[nodiscard]] ClosureAlbedo closure_albedo(const Closure& closure, const Vec3& wo);

// Share of a reflecting lobe that one bounce keeps; 1 where that is compensated or not known.
[[nodiscard]] float single_scatter_share(const Closure& closure, const Vec3& wo);

}  // namespace pharos
