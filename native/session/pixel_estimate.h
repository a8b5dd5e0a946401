// What a pixel will show, from the noisy picture so far: the yardstick of guided roulette and of
// the selection's weights.
//
// Averaging over a window lets a bright edge raise its dark neighbours by so much that nearly all
// of their paths are killed: black specks beside the edge. The estimate is therefore that of the
// darker quadrants around the pixel (the quadrants are those of Kuwahara's filter, 1976): too low
// costs only some splits, too high costs the picture.
#pragma once

#include <vector>

#include "film/film.h"

namespace pharos {

// Luminance a pixel as the paths carried it: before exposure, row by row as the film keeps them.
[[nodiscard]] std::vector<float> film_luminance(const Film& film);

// Radiance's luminance a pixel (before exposure), row by row as the film keeps them, at least a
// tenth of the picture's mean: empty while the picture is black. Finite for finite films.
[[nodiscard]] std::vector<float> estimate_pixels(const Film& film);

}  // namespace pharos
