// How opaque a surface is, for what a picture shows of the surfaces in front.
#pragma once

#include "core/color.h"
#include "materials/bsdf.h"
#include "materials/material.h"

namespace pharos {

[[nodiscard]] inline Rgb surface_alpha(const Material& material, const Bsdf& bsdf) {
    Rgb alpha(1.0f);
    if (material.transparent) {
        for (const Closure& closure : bsdf.closures) {
            alpha -= closure.type == ClosureType::Transparent ? closure.weight : Rgb(0.0f);
        }
    }
    return glm::clamp(alpha, 0.0f, 1.0f);
}

// Whether passes that can only hold one surface hold this one.
[[nodiscard]] inline bool is_shown(const Rgb& alpha) {
    return average(alpha) >= 0.5f;
}

}  // namespace pharos
