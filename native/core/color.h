// Colour arithmetic: scene-linear Rec.709 luminance and the sRGB transfer curve (IEC 61966-2-1).
#pragma once

#include "core/math.h"

namespace pharos {

[[nodiscard]] inline float luminance(const Rgb& c) {
    return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

[[nodiscard]] inline float average(const Rgb& c) {
    return (c.x + c.y + c.z) / 3.0f;
}

[[nodiscard]] inline float srgb_to_linear(float v) {
    return v < 0.04045f ? v * (1.0f / 12.92f) : std::pow((v + 0.055f) * (1.0f / 1.055f), 2.4f);
}

[[nodiscard]] inline float linear_to_srgb(float v) {
    return v < 0.0031308f ? v * 12.92f : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

}  // namespace pharos
