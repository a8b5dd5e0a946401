#include "guiding/network_layout.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace pharos {
namespace {

void require(bool condition, const char* setting) {
    if (!condition) {
        throw std::invalid_argument(std::string("GuidingConfig: ") + setting +
                                    " is out of its limits");
    }
}

void check_config(const GuidingConfig& c) {
    require(c.octaves >= 0 && c.octaves <= 8, "octaves");
    require(c.grid_levels >= 1 && c.grid_levels <= 8, "grid_levels");
    require(c.grid_features >= 1 && c.grid_features <= 4, "grid_features");
    require(c.grid_log2_size >= 8 && c.grid_log2_size <= 20, "grid_log2_size");
    require(c.width >= 8 && c.width <= kMaxWidth && c.width % 8 == 0, "width");
    require(c.hidden_layers >= 1 && c.hidden_layers < kMaxLayers, "hidden_layers");
    require(c.lobes >= 1 && c.lobes <= 8, "lobes");
    require(c.leaky_slope > 0.0f && c.leaky_slope < 1.0f, "leaky_slope");
    require(c.kappa_max >= 10.0f && c.kappa_max <= 1e6f, "kappa_max");
    require(c.weight_clip > 0.0f && c.weight_clip <= 1e6f, "weight_clip");
    require(c.learning_rate > 0.0f && c.learning_rate <= 1.0f, "learning_rate");
    require(c.learning_rate_floor >= 0.0f && c.learning_rate_floor <= 1.0f, "learning_rate_floor");
    require(c.learning_rate_steps > 0.0f, "learning_rate_steps");
    require(c.relearning_rate_steps > 0.0f, "relearning_rate_steps");
    require(c.batch_size >= 128 && c.batch_size <= 16384 && c.batch_size % 128 == 0, "batch_size");
    require(c.ema_decay >= 0.0f && c.ema_decay < 1.0f, "ema_decay");
    require(c.gradient_clip > 0.0f, "gradient_clip");
    require(c.zero_keep > 0.0f && c.zero_keep <= 1.0f, "zero_keep");
    require(c.held_out >= 0.0f && c.held_out <= 0.5f, "held_out");
}

}  // namespace

int widest_rows(const NetworkLayout& layout) {
    int widest = layout.inputs;
    for (int l = 0; l < layout.layers; ++l) {
        widest = std::max(widest, layout.layer[static_cast<std::size_t>(l)].rows);
    }
    return widest;
}

NetworkLayout make_network_layout(const GuidingConfig& config) {
    check_config(config);
    NetworkLayout layout;
    layout.config = config;
    layout.position_inputs = config.encoding == Encoding::Frequency
                                 ? 3 + 6 * config.octaves
                                 : config.grid_levels * config.grid_features;
    layout.inputs = layout.position_inputs + (config.use_normal ? 3 : 0);
    layout.layers = config.hidden_layers + 1;
    int inputs = layout.inputs;
    std::size_t offset = 0;
    for (int l = 0; l < layout.layers; ++l) {
        LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        shape.inputs = inputs;
        shape.outputs = l + 1 < layout.layers ? config.width : kOutputsPerLobe * config.lobes + 1;
        shape.rows = (shape.outputs + kRowTile - 1) / kRowTile * kRowTile;
        shape.weights = offset;
        offset += static_cast<std::size_t>(shape.rows) * static_cast<std::size_t>(inputs);
        shape.biases = offset;
        offset += static_cast<std::size_t>(shape.rows);
        inputs = shape.outputs;
    }
    layout.mlp_parameters = (offset + 15) / 16 * 16;
    if (config.encoding == Encoding::HashGrid) {
        layout.grid_parameters =
            (std::size_t{1} << config.grid_log2_size) *
            static_cast<std::size_t>(config.grid_levels * config.grid_features);
    }
    return layout;
}

}  // namespace pharos
