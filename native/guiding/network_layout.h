// Sizes and offsets of the network: an MLP of leaky-ReLU layers whose parameters lie in one array.
//
// Layer l has weight rows [output][input] followed by its biases; output rows are padded to a
// multiple of kRowTile with zeros that never train. The last layer's rows are, in groups over
// lobes: logit, mu x, mu y, mu z, kappa; then one row for log A.
#pragma once

#include <array>
#include <cstddef>

#include "guiding/guiding_config.h"

namespace pharos {

inline constexpr int kRowTile = 4;
inline constexpr int kMaxWidth = 128;
inline constexpr int kMaxInputs = 3 + 6 * 8 + 3;
inline constexpr int kMaxLayers = 7;
inline constexpr int kOutputsPerLobe = 5;

struct LayerShape {
    int inputs = 0;
    int outputs = 0;  // that mean something
    int rows = 0;     // outputs, padded
    std::size_t weights = 0;
    std::size_t biases = 0;
};

struct NetworkLayout {
    GuidingConfig config;
    int inputs = 0;
    int position_inputs = 0;  // the first ones; the normal follows
    int layers = 0;
    std::array<LayerShape, kMaxLayers> layer{};
    std::size_t mlp_parameters = 0;   // padded
    std::size_t grid_parameters = 0;  // behind those of the layers

    [[nodiscard]] std::size_t parameters() const { return mlp_parameters + grid_parameters; }
};

// Rows of the widest of all layers and the inputs.
[[nodiscard]] int widest_rows(const NetworkLayout& layout);

// Throws std::invalid_argument naming the setting that is out of its limits.
[[nodiscard]] NetworkLayout make_network_layout(const GuidingConfig& config);

}  // namespace pharos
