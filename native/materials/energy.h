// Albedo tables of GGX microfacets, height-correlated: what one bounce keeps, for multi-scatter
// compensation (Kulla, Conty 2017; scaling by the view side as Cycles 4.x) and for layering.
//
// Contract: rough = sqrt(alpha) in [0, 1], mu = cos of the view direction in [0, 1] (clamped), eta
// = transmitted / incident index > 0. The tables are computed on first use by integrating the
// project's own lobes over a Fibonacci lattice of visible normals: the same bits on every run,
// immutable afterwards, safe from any thread.
#pragma once

namespace pharos {

// Directional albedo of a white reflecting lobe, and its cosine-weighted mean over directions.
[[nodiscard]] float ggx_albedo(float mu, float rough);
[[nodiscard]] float ggx_average_albedo(float rough);

// Reflected plus transmitted albedo of a white glass lobe, and its mean.
[[nodiscard]] float ggx_glass_albedo(float mu, float rough, float eta);
[[nodiscard]] float ggx_glass_average_albedo(float rough, float eta);

// Mean of dielectric_shape() (fresnel.h) over the lobe: albedo = lerp(f0, f90, this) once
// energy-compensated.
[[nodiscard]] float ggx_dielectric_shape(float mu, float rough, float eta);

}  // namespace pharos
