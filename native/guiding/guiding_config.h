// Settings of the guiding field, and the two presets. All are run-time values.
#pragma once

#include <cstdint>

namespace pharos {

enum class Encoding : std::uint8_t {
    Frequency,  // position over the scene box, raw and `octaves` of sine and cosine
    HashGrid,   // multi-resolution hash grid (Mueller et al. 2022), for comparison
};

enum class MuActivation : std::uint8_t {
    Sigmoid,  // the slides': 2 sigmoid(x) - 1 per axis, then normalised
    Raw,      // x normalised
};

enum class KappaActivation : std::uint8_t {
    Exponential,  // the slides' exp(x), smoothly limited
    Quadratic,    // the slides' x^2, smoothly limited
};

enum class GuidingLoss : std::uint8_t {
    KullbackLeibler,  // one-sample KL of the mixture; A by relative squared loss
    RelativeSquared,  // the slides': of the whole field A * pdf against the radiance
};

struct GuidingConfig {
    Encoding encoding = Encoding::Frequency;
    int octaves = 3;  // 0 ... 8
    bool use_normal = true;
    int grid_levels = 6;      // HashGrid: 1 ... 8 levels of
    int grid_features = 4;    // 1 ... 4 features in
    int grid_log2_size = 14;  // 2^n entries
    int width = 32;           // of the hidden layers: multiple of 8, 8 ... 128
    int hidden_layers = 2;    // 1 ... 6
    int lobes = 8;            // 1 ... 8
    float leaky_slope = 0.01f;
    MuActivation mu = MuActivation::Raw;  // learns sharp lights faster than Sigmoid, and costs less
    KappaActivation kappa = KappaActivation::Exponential;
    float kappa_max = 3e4f;

    GuidingLoss loss = GuidingLoss::KullbackLeibler;
    bool target_cosine = true;   // learn L_i |cos|; false: L_i
    float weight_clip = 100.0f;  // of L_i cos / (p A)
    float learning_rate = 1e-2f;
    float learning_rate_floor = 0.1f;      // share of the rate that stays
    float learning_rate_steps = 2400.0f;   // decay: floor + (1 - floor) exp(-step / steps)
    float relearning_rate_steps = 250.0f;  // of weights that go on after an edit: nearly right
    int batch_size = 512;                  // multiple of 128, 128 ... 16384
    float ema_decay = 0.98f;
    float gradient_clip = 1.0f;  // of the global norm
    float zero_keep = 0.25f;     // share of the zero records that is kept (1 / 2^n)
    float held_out = 0.05f;
    std::uint32_t seed = 1;

    [[nodiscard]] static GuidingConfig neural() { return {}; }

    // The model and loss of the slides: one lobe, radiance without the cosine.
    [[nodiscard]] static GuidingConfig slides(bool use_normal = true) {
        GuidingConfig config;
        config.use_normal = use_normal;
        config.lobes = 1;
        config.mu = MuActivation::Sigmoid;
        config.loss = GuidingLoss::RelativeSquared;
        config.target_cosine = false;
        return config;
    }
};

}  // namespace pharos
