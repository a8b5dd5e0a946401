// Reflectance of a dielectric under a thin film: colours of soap bubbles and oil (Belcour, Barla
// 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence").
//
// Light that goes back and forth in the film interferes with itself: a series in the optical path
// difference, whose terms are seen through the eye's matching functions by the Fourier transform of
// the paper's Gaussian fits. White light is D65.
#pragma once

#include "core/math.h"

namespace pharos {

// Below this the film is not there (as in Cycles).
inline constexpr float kThinnestFilm = 0.1f;

// What light meets: a film over a base, indices relative to where it comes from.
struct FilmInterface {
    float film_eta = 1.33f;
    float base_eta = 1.5f;
    float thickness = 0.0f;  // nm
};

// In [0, 1] per channel; 1 where nothing gets through. `cosine` in [0, 1] to the normal outside.
[[nodiscard]] Rgb film_reflectance(const FilmInterface& film, float cosine);

}  // namespace pharos
