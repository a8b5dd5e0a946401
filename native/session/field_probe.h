// What the guiding field believes at one point of a picture, beside the light that is there.
//
// The field learns from passes over the whole picture (or is loaded), is asked at the first hit of
// a pixel, and the same distribution is found by brute force: paths traced from that point into
// every direction of a latitude-longitude grid. Both are luminance x |cos| (of the SLIDES preset:
// luminance) per solid angle. With next-event estimation the field leaves to it what it finds
// better, so that the two differ where lights are seen; without, they should be equal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/scene_report.h"
#include "guiding/directional_mixture.h"
#include "scene/scene_description.h"

namespace pharos {

struct ProbeSettings {
    std::uint32_t x = 0;  // pixel of the full frame, origin bottom left
    std::uint32_t y = 0;
    std::uint32_t height = 64;           // of the grid; its width is twice that
    std::uint32_t rays = 64;             // into each direction of the grid
    unsigned threads = 0;                // 0: one per core
    std::span<const std::byte> weights;  // of a saved field; empty: it starts from nothing
    bool train = true;                   // for the description's samples
};

struct FieldProbe {
    Vec3 position{0.0f};
    Vec3 normal{0.0f};  // on the camera's side
    VmfMixture mixture;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    // Row 0 looks to -z, columns run once around from -x over -y, +x and +y.
    std::vector<float> learned;  // A x density
    std::vector<float> truth;
    double divergence = 0.0;  // Kullback-Leibler, of the truth from what was learned, in nats
    std::vector<std::byte> weights;
};

// Direction of a point of the grid, (u, v) in [0, 1]^2.
[[nodiscard]] Vec3 latlong_direction(float u, float v);

// Of the distributions that two such pictures are after normalisation.
[[nodiscard]] double latlong_divergence(std::span<const float> truth,
                                        std::span<const float> learned,
                                        std::uint32_t height);

// Throws std::invalid_argument where the scene has no camera, the camera sees no surface at the
// pixel, or the weights do not fit.
[[nodiscard]] FieldProbe probe_field(SceneDescription description,
                                     const ProbeSettings& settings,
                                     SceneReport& report);

}  // namespace pharos
