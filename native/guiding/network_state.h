// Everything of the field that changes: weights, averages, moments, the published snapshot; and its
// file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "guiding/aligned_floats.h"
#include "guiding/mlp.h"
#include "guiding/network_layout.h"

namespace pharos {

struct NetworkState {
    AlignedFloats parameters;
    AlignedFloats average;  // exponential moving average: the next snapshot's candidate
    AlignedFloats first_moment;
    AlignedFloats second_moment;
    AlignedFloats published;
    std::uint64_t step = 0;  // of the optimiser; 0 restarts rate, moments and average
    bool goes_on = false;  // since an edit, with the weights of before; of live pictures: not kept
    std::uint64_t generation = 0;
    float radiance_scale = 0.0f;   // unit of A in training; 0 until a pass had light
    float published_scale = 1.0f;  // the same of the published snapshot
    Vec3 center{0.0f};
    Vec3 inverse_half_extent{1.0f};
};

// Lobes start at Fibonacci directions with equal weights and kappa 2: a nearly uniform mixture. The
// published snapshot is the same.
[[nodiscard]] NetworkState make_network_state(const NetworkLayout& layout,
                                              const Bounds3& scene_box);

// New weights, moments zero, step 0; the published snapshot stays.
void reset_weights(const NetworkLayout& layout, NetworkState& state);
void restart_optimizer(NetworkState& state);

[[nodiscard]] bool all_finite(std::span<const float> values);

[[nodiscard]] NetworkView published_view(const NetworkLayout& layout, const NetworkState& state);

// Flat file: header, raw floats without padding, checksum. load throws std::invalid_argument and
// leaves the state as it was.
[[nodiscard]] std::vector<std::byte> save_state(const NetworkLayout& layout,
                                                const NetworkState& state);
void load_state(const NetworkLayout& layout, std::span<const std::byte> data, NetworkState& state);

}  // namespace pharos
