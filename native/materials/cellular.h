// Cells around random points, one in each cube of a lattice, in one to four dimensions (Worley
// 1996, "A Cellular Texture Basis Function"), and sums of their octaves.
//
// Contract: any input is safe. The nearest points are looked for in the cubes beside the point's
// own, as Blender's Voronoi node does: with extreme metrics that is not always the true nearest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "materials/gradient_noise.h"

namespace pharos::detail {

struct CellInputs {
    float octaves = 0.0f;
    float roughness = 0.5f;
    float lacunarity = 2.0f;
    float smoothness = 0.5f;  // already over [0, 0.5]
    float exponent = 0.5f;
    float randomness = 1.0f;
    bool normalize = false;
    CellFeature feature = CellFeature::F1;
    CellMetric metric = CellMetric::Euclidean;
};

template <std::size_t D>
struct CellResult {
    float distance = 0.0f;  // or the radius
    std::array<float, 3> color{};
    NoisePoint<D> position{};
};

template <std::size_t D>
[[nodiscard]] CellResult<D> cellular(const NoisePoint<D>& p, const CellInputs& in);

}  // namespace pharos::detail
