#include "guiding/network_state.h"

#include <cmath>

#include "sampling/sampler.h"

namespace pharos {
namespace {

// Uniform in [-1, 1), from a counter.
float signed_random(std::uint32_t seed, std::size_t index) {
    const std::uint32_t bits =
        hash_combine(hash_combine(seed, 0x51ed270bu), static_cast<std::uint32_t>(index));
    return static_cast<float>(bits >> 8) * 0x1p-23f - 1.0f;
}

// The input of the smooth range limit (decode-inl.h) whose output is `value`.
float inverse_smooth_limit(float value, float center, float half) {
    const float v = (value - center) / half;
    return center + half * v / std::sqrt(1.0f - v * v);
}

void initialize_output_biases(const NetworkLayout& layout, float* bias) {
    const GuidingConfig& config = layout.config;
    const int lobes = config.lobes;
    constexpr float kGoldenAngle = 2.39996323f;
    for (int k = 0; k < lobes; ++k) {
        // Fibonacci sphere, a little turned so that no lobe starts on an axis.
        const float z = 1.0f - (2.0f * static_cast<float>(k) + 1.0f) / static_cast<float>(lobes);
        const float phi = 0.5f + kGoldenAngle * static_cast<float>(k);
        const float r = safe_sqrt(1.0f - z * z);
        const Vec3 mu(r * std::cos(phi), r * std::sin(phi), z);
        for (int axis = 0; axis < 3; ++axis) {
            const float short_mu = 0.6f * mu[axis];
            bias[(1 + axis) * lobes + k] =
                config.mu == MuActivation::Sigmoid ? 2.0f * std::atanh(short_mu) : short_mu;
        }
        const float low = std::log(1e-2f);
        const float high = std::log(config.kappa_max);
        bias[4 * lobes + k] =
            config.kappa == KappaActivation::Exponential
                ? inverse_smooth_limit(std::log(2.0f), 0.5f * (low + high), 0.5f * (high - low))
                : std::sqrt(2.0f);
    }
}

void initialize(const NetworkLayout& layout, AlignedFloats& parameters) {
    parameters.assign(layout.parameters(), 0.0f);
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        const bool last = l + 1 == layout.layers;
        // He's range for the hidden layers; the last one starts small, so that the biases rule.
        const float range =
            (last ? 0.1f : 1.0f) * std::sqrt(6.0f / static_cast<float>(shape.inputs));
        const std::size_t used =
            static_cast<std::size_t>(shape.outputs) * static_cast<std::size_t>(shape.inputs);
        for (std::size_t i = 0; i < used; ++i) {
            parameters[shape.weights + i] =
                range * signed_random(layout.config.seed, shape.weights + i);
        }
        if (last) {
            initialize_output_biases(layout, parameters.data() + shape.biases);
        }
    }
    for (std::size_t i = 0; i < layout.grid_parameters; ++i) {
        parameters[layout.mlp_parameters + i] =
            1e-2f * signed_random(layout.config.seed, layout.mlp_parameters + i);
    }
}

}  // namespace

bool all_finite(std::span<const float> values) {
    // A product with 0 is 0 for every finite value and NaN otherwise.
    float sum[8] = {};
    for (std::size_t i = 0; i < values.size(); ++i) {
        sum[i % 8] += values[i] * 0.0f;
    }
    float total = 0.0f;
    for (const float s : sum) {
        total += s;
    }
    return total == 0.0f;
}

void restart_optimizer(NetworkState& state) {
    state.step = 0;
    state.first_moment.assign(state.parameters.size(), 0.0f);
    state.second_moment.assign(state.parameters.size(), 0.0f);
    state.average = state.parameters;
}

void reset_weights(const NetworkLayout& layout, NetworkState& state) {
    initialize(layout, state.parameters);
    restart_optimizer(state);
    state.goes_on = false;
}

NetworkState make_network_state(const NetworkLayout& layout, const Bounds3& scene_box) {
    NetworkState state;
    reset_weights(layout, state);
    state.published = state.parameters;
    if (!scene_box.empty() && is_finite(scene_box.lower) && is_finite(scene_box.upper)) {
        state.center = scene_box.center();
        // A flat scene keeps some sense of scale: no axis is stretched more than eight times.
        const Vec3 half = 0.5f * scene_box.extent();
        const float smallest = std::max(0.125f * max_component(half), 1e-30f);
        for (int axis = 0; axis < 3; ++axis) {
            state.inverse_half_extent[axis] = 1.0f / std::max(half[axis], smallest);
        }
    }
    return state;
}

NetworkView published_view(const NetworkLayout& layout, const NetworkState& state) {
    return {&layout,
            state.published.data(),
            state.center,
            state.inverse_half_extent,
            state.published_scale};
}

}  // namespace pharos
