// The network's kernels: vectors in, vectors out, samples in SIMD lanes, weights broadcast.
// Compiled for several instruction sets and chosen at run time, once a call (Highway). No
// allocation, no threads, no scene: what the field and the trainer are built from.
#pragma once

#include <cstddef>
#include <span>

#include "core/math.h"
#include "guiding/directional_mixture.h"
#include "guiding/network_layout.h"

namespace pharos {

struct FieldQuery;

// Records of one training task.
inline constexpr int kTrainChunk = 128;
// Added to the density inside the logarithm.
inline constexpr float kDensityFloor = 1e-8f;
// Added to A in denominators; A is in units of the scale.
inline constexpr float kIntegralEpsilon = 1e-3f;
// Of one record's gradient with respect to log A.
inline constexpr float kGradientLimit = 20.0f;
// The slides' constant in the denominator of the relative squared loss, of a field whose integral
// is about 1: with it the dim background counts as plain squared error and the lobe finds the peak.
inline constexpr float kFieldEpsilon = 1e-2f;

// One set of weights and how the scene's positions become inputs.
struct NetworkView {
    const NetworkLayout* layout = nullptr;
    const float* parameters = nullptr;  // 64-byte aligned
    Vec3 center{0.0f};
    Vec3 inverse_half_extent{1.0f};
    float radiance_scale = 1.0f;  // unit of A inside the network
};

// Training records as columns, each padded by zeros to a multiple of kTrainChunk and 64-byte
// aligned. A padding record has weight 0 and pdf 1.
struct TrainingColumns {
    const float* position[3] = {};
    const float* normal[3] = {};
    const float* wi[3] = {};
    const float* target = nullptr;  // radiance (* cos) / pdf, in units of the scale
    const float* pdf = nullptr;
    const float* weight = nullptr;  // of the record: 1 / its probability to survive thinning
};

// Floats that train_chunk needs for a layout; the memory must be 64-byte aligned.
[[nodiscard]] std::size_t workspace_size(const NetworkLayout& layout);

// Mixtures of a batch of vertices. Non-finite weights give the uniform mixture.
void evaluate_network(const NetworkView& view,
                      const FieldQuery& query,
                      std::span<VmfMixture> mixtures);

// Density at wi and A (in units of the scale) of the kTrainChunk records from `first` on.
void evaluate_chunk(const NetworkView& view,
                    const TrainingColumns& columns,
                    std::size_t first,
                    std::span<float> workspace,
                    std::span<float> pdf_and_integral);

// Gradient of (1 / batch) * sum of the records' losses with respect to the layers' parameters
// (written, not added) and, for grid encodings, to the position inputs (start of the workspace,
// rows of kTrainChunk). Returns the sum of losses.
[[nodiscard]] float train_chunk(const NetworkView& view,
                                const TrainingColumns& columns,
                                std::size_t first,
                                std::span<float> workspace,
                                std::span<float> gradient);

struct AdamStep {
    float rate = 0.0f;  // bias corrections included
    float beta1 = 0.9f;
    float beta2 = 0.99f;
    float epsilon = 1e-8f;        // relative to the corrected second moment
    float gradient_scale = 1.0f;  // clipping of the norm
    float ema = 0.98f;
};

// Arrays of one length, a multiple of 16, 64-byte aligned.
struct AdamArrays {
    std::span<const float> gradient;
    std::span<float> parameters;
    std::span<float> first_moment;
    std::span<float> second_moment;
    std::span<float> average;
};

void adam_update(const AdamStep& step, const AdamArrays& arrays);

}  // namespace pharos
