// Multi-resolution hash grid (Mueller et al. 2022, "Instant Neural Graphics Primitives"): trilinear
// features of several levels, for the comparison with the frequency encoding, which learns faster
// here. The table lies behind the layers' parameters. Positions are in [-1, 1]^3, clamped.
#pragma once

#include <span>

#include "core/math.h"
#include "guiding/network_layout.h"

namespace pharos {

inline constexpr int kGridBaseResolution = 8;
inline constexpr float kGridGrowth = 1.65f;

// Writes grid_levels * grid_features values, `stride` floats apart.
void encode_grid(const GuidingConfig& config,
                 const float* table,
                 const Vec3& position,
                 float* features,
                 int stride);

// Adds the gradient of the features to the table's.
void scatter_grid_gradient(const GuidingConfig& config,
                           const Vec3& position,
                           const float* feature_gradient,
                           int stride,
                           std::span<float> table_gradient);

}  // namespace pharos
