// Gradient noise in one to four dimensions (Perlin 2002, "Improving Noise") and sums of its octaves
// (Musgrave, in Ebert et al., "Texturing and Modeling", chapter 16).
//
// Contract: any input is safe; a coordinate that is no number gives zero. Signed noise lies in
// about [-1, 1], is zero at whole numbers, and repeats far away where floats are too coarse.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "materials/node_program.h"
#include "materials/procedural_hash.h"

namespace pharos::detail {

template <std::size_t D>
using NoisePoint = std::array<float, D>;

template <std::size_t D>
[[nodiscard]] NoisePoint<D> scaled(const NoisePoint<D>& p, float factor) {
    NoisePoint<D> out = p;
    for (float& x : out) {
        x *= factor;
    }
    return out;
}

namespace noise {

[[nodiscard]] inline float negate_if(float x, std::uint32_t bit) {
    return bit != 0 ? -x : x;
}

// The offset `d` seen along a lattice point's gradient, one of 16, 8, 16 and 32.
template <std::size_t D>
[[nodiscard]] inline float along_gradient(std::uint32_t hash, const NoisePoint<D>& d) {
    if constexpr (D == 1) {
        return negate_if(static_cast<float>(1 + (hash & 7)), hash & 8) * d[0];
    } else if constexpr (D == 2) {
        const bool first = (hash & 7) < 4;
        const float u = first ? d[0] : d[1];
        const float v = 2.0f * (first ? d[1] : d[0]);
        return negate_if(u, hash & 1) + negate_if(v, hash & 2);
    } else if constexpr (D == 3) {
        const std::uint32_t h = hash & 15;
        const float u = h < 8 ? d[0] : d[1];
        const float v = h < 4 ? d[1] : (h == 12 || h == 14) ? d[0] : d[2];
        return negate_if(u, h & 1) + negate_if(v, h & 2);
    } else {
        const std::uint32_t h = hash & 31;
        const float u = h < 24 ? d[0] : d[1];
        const float v = h < 16 ? d[1] : d[2];
        const float s = h < 8 ? d[2] : d[3];
        return negate_if(u, h & 1) + negate_if(v, h & 2) + negate_if(s, h & 4);
    }
}

// Brings the range of each dimension's sum to about [-1, 1].
template <std::size_t D>
inline constexpr float kRange = D == 1   ? 0.25f
                                : D == 2 ? 0.6616f
                                : D == 3 ? 0.982f
                                         : 0.8344f;

inline constexpr float kPeriod = 100000.0f;
inline constexpr float kCoarse = 1000000.0f;

}  // namespace noise

// `periodic`: Blender 4.0 and later.
template <std::size_t D>
[[nodiscard]] inline float signed_noise(NoisePoint<D> p, bool periodic) {
    std::array<std::uint32_t, D> cell{};
    NoisePoint<D> fade{};
    for (std::size_t k = 0; k < D; ++k) {
        if (periodic) {
            p[k] =
                std::fmod(p[k], noise::kPeriod) + (std::abs(p[k]) >= noise::kCoarse ? 0.5f : 0.0f);
        }
        const float floor = std::floor(p[k]);
        // As processors convert what no integer holds.
        const bool holds = std::abs(floor) < 2147483648.0f;
        cell[k] = static_cast<std::uint32_t>(holds ? static_cast<std::int32_t>(floor) : INT32_MIN);
        p[k] -= floor;
        fade[k] = p[k] * p[k] * p[k] * (p[k] * (p[k] * 6.0f - 15.0f) + 10.0f);
    }
    // The corners of the cell, then halved along one axis after the other.
    std::array<float, std::size_t{1} << D> corner{};
    for (std::size_t c = 0; c < corner.size(); ++c) {
        std::array<std::uint32_t, D> at = cell;
        NoisePoint<D> offset = p;
        for (std::size_t k = 0; k < D; ++k) {
            const std::size_t bit = c >> k & 1;
            at[k] += static_cast<std::uint32_t>(bit);
            offset[k] -= static_cast<float>(bit);
        }
        corner[c] = noise::along_gradient<D>(hash_words(at), offset);
    }
    for (std::size_t k = 0, count = corner.size() / 2; k < D; ++k, count /= 2) {
        for (std::size_t c = 0; c < count; ++c) {
            corner[c] = (1.0f - fade[k]) * corner[2 * c] + fade[k] * corner[2 * c + 1];
        }
    }
    return std::isfinite(corner[0]) ? corner[0] * noise::kRange<D> : 0.0f;
}

struct FractalInputs {
    float octaves = 0.0f;  // with a last one in part
    float gain_per_octave = 0.5f;
    float lacunarity = 2.0f;
    float offset = 0.0f;
    float gain = 1.0f;
    bool normalize = true;  // fBm alone: to [0, 1]
    bool periodic = true;
};

// Octaves as the Noise node counts them: one more than `octaves` says.
template <std::size_t D>
[[nodiscard]] float fractal_noise(FractalType type,
                                  const NoisePoint<D>& p,
                                  const FractalInputs& in);

// Octaves as the Musgrave node (3.x) counts them; `octaves` of zero is none.
template <std::size_t D>
[[nodiscard]] float musgrave_noise(FractalType type,
                                   const NoisePoint<D>& p,
                                   const FractalInputs& in);

}  // namespace pharos::detail
