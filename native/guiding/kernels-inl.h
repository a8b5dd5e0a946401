// The dispatched entry points; included by mlp.cpp once a target, after decode-inl.h.
namespace pharos {
namespace HWY_NAMESPACE {

// Layer after layer from `inputs`; returns the last layer's rows. Two buffers swap.
template <int kStride>
inline float* forward(const NetworkView& view, float* inputs, float* other) {
    const NetworkLayout& layout = *view.layout;
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        const float slope = l + 1 < layout.layers ? layout.config.leaky_slope : 1.0f;
        layer_forward<kStride>(shape, view.parameters, slope, inputs, other);
        std::swap(inputs, other);
    }
    return inputs;
}

using F8 [[gnu::vector_size(32)]] = float;

// Four floats from each of two places.
PHAROS_SIMD_INLINE F8 two_halves(const float* low, const float* high) {
    using F4 [[gnu::vector_size(16)]] = float;
    F4 a;
    F4 b;
    __builtin_memcpy(&a, low, sizeof(a));
    __builtin_memcpy(&b, high, sizeof(b));
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

// Eight rows of lanes become eight records of eight floats: rows i and i + 4 share a vector from
// the start, so that all shuffles stay within 128 bits.
[[gnu::always_inline]] inline void transpose_8x8(const float* rows, int stride, F8 out[8]) {
#pragma GCC unroll 2
    for (int half = 0; half < 2; ++half) {
        F8 a[4];
        F8 b[4];
#pragma GCC unroll 4
        for (int i = 0; i < 4; ++i) {
            a[i] = two_halves(rows + i * stride + 4 * half, rows + (i + 4) * stride + 4 * half);
        }
#pragma GCC unroll 2
        for (int i = 0; i < 4; i += 2) {
            b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
            b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
        }
        F8* to = out + 4 * half;
        to[0] = __builtin_shufflevector(b[0], b[2], 0, 1, 8, 9, 4, 5, 12, 13);
        to[1] = __builtin_shufflevector(b[0], b[2], 2, 3, 10, 11, 6, 7, 14, 15);
        to[2] = __builtin_shufflevector(b[1], b[3], 0, 1, 8, 9, 4, 5, 12, 13);
        to[3] = __builtin_shufflevector(b[1], b[3], 2, 3, 10, 11, 6, 7, 14, 15);
    }
}

// One quantity of all lobes of kLanes mixtures: from rows over lobes to the mixtures' arrays.
[[gnu::always_inline]] inline void write_lobes(const float* rows,
                                               float (VmfMixture::*member)[kMaxLobes],
                                               VmfMixture* mixtures,
                                               int count) {
    if constexpr (kLanes >= 8) {
        for (int group = 0; group < kLanes; group += 8) {
            F8 lobes[8];
            transpose_8x8(rows + group, kLanes, lobes);
            const int end = std::min(8, count - group);
            for (int i = 0; i < end; ++i) {
                *reinterpret_cast<F8*>(mixtures[group + i].*member) = lobes[i];
            }
        }
    } else {
        const int end = std::min(kLanes, count);
        for (int i = 0; i < end; ++i) {
            for (int k = 0; k < kMaxLobes; ++k) {
                (mixtures[i].*member)[k] = rows[k * kLanes + i];
            }
        }
    }
}

// Decodes one vector of vertices into `count` mixtures.
inline void write_mixtures(
    const NetworkView& view, const float* rows, int stride, VmfMixture* mixtures, int count) {
    const GuidingConfig& config = view.layout->config;
    Decoded decoded;
    decode(rows, stride, config, decoded);
    alignas(64) float columns[6][kMaxLobes * kLanes];
    // `checksum` is finite exactly where everything is.
    V checksum = decoded.integral;
    for (int k = 0; k < kMaxLobes; ++k) {
        const bool used = k < config.lobes;
        const V coefficient = used ? decoded.weight[k] * decoded.normalization[k] : V{};
        store(columns[0] + k * kLanes, used ? decoded.weight[k] : V{});
        store(columns[1] + k * kLanes, used ? decoded.mu[k][0] : V{});
        store(columns[2] + k * kLanes, used ? decoded.mu[k][1] : V{});
        store(columns[3] + k * kLanes, used ? decoded.mu[k][2] : simd::broadcast<V>(1.0f));
        store(columns[4] + k * kLanes, used ? decoded.kappa[k] : V{});
        store(columns[5] + k * kLanes, coefficient);
        if (used) {
            checksum += coefficient + decoded.kappa[k] +
                        (decoded.mu[k][0] + decoded.mu[k][1] + decoded.mu[k][2]);
        }
    }
    write_lobes(columns[0], &VmfMixture::weight, mixtures, count);
    write_lobes(columns[1], &VmfMixture::mu_x, mixtures, count);
    write_lobes(columns[2], &VmfMixture::mu_y, mixtures, count);
    write_lobes(columns[3], &VmfMixture::mu_z, mixtures, count);
    write_lobes(columns[4], &VmfMixture::kappa, mixtures, count);
    write_lobes(columns[5], &VmfMixture::coefficient, mixtures, count);
    const V integral = decoded.integral * view.radiance_scale;
    for (int i = 0; i < std::min(kLanes, count); ++i) {
        mixtures[i].A = integral[i];
        mixtures[i].expected = integral[i];
        mixtures[i].lobe_count = config.lobes;
    }
    // Non-finite weights must not reach a path: such a vertex is sampled uniformly.
    const V valid = simd::select(simd::abs(checksum) <= 1e30f, V{}, simd::broadcast<V>(1.0f));
    if (sum_lanes(valid) > 0.0f) {
        for (int i = 0; i < std::min(kLanes, count); ++i) {
            if (valid[i] > 0.0f) {
                mixtures[i] = VmfMixture{};
            }
        }
    }
}

template <int kStride>
inline void evaluate_block(const NetworkView& view,
                           const FieldQuery& query,
                           std::size_t first,
                           int count,
                           VmfMixture* mixtures) {
    alignas(64) float columns[6][kStride];
    const std::span<const float> spans[6] = {
        query.px, query.py, query.pz, query.nx, query.ny, query.nz};
    for (int c = 0; c < 6; ++c) {
        if (c < 3 || view.layout->config.use_normal) {
            __builtin_memcpy(columns[c],
                             spans[c].data() + first,
                             static_cast<std::size_t>(count) * sizeof(float));
            for (int i = count; i < kStride; ++i) {
                columns[c][i] = 0.0f;
            }
        }
    }
    alignas(64) float a[kMaxWidth * kStride];
    alignas(64) float b[kMaxWidth * kStride];
    const float* const position[3] = {columns[0], columns[1], columns[2]};
    const float* const normal[3] = {columns[3], columns[4], columns[5]};
    encode<kStride>(view, position, normal, a);
    const float* rows = forward<kStride>(view, a, b);
    for (int s = 0; s < count; s += kLanes) {
        write_mixtures(view, rows + s, kStride, mixtures + s, count - s);
    }
}

inline void evaluate_kernel(const NetworkView& view,
                            const FieldQuery& query,
                            std::span<VmfMixture> mixtures) {
    constexpr int kBlock = 64;
    std::size_t first = 0;
    while (first < mixtures.size()) {
        const std::size_t left = mixtures.size() - first;
        if (left > kBlock / 2) {
            const int count = static_cast<int>(std::min<std::size_t>(left, kBlock));
            evaluate_block<kBlock>(view, query, first, count, mixtures.data() + first);
            first += static_cast<std::size_t>(count);
        } else {
            const int count = static_cast<int>(left);
            evaluate_block<kBlock / 2>(view, query, first, count, mixtures.data() + first);
            first += static_cast<std::size_t>(count);
        }
    }
}

// Activations of all layers, kept for the way back.
struct Activations {
    float* rows[kMaxLayers + 1];
};

inline Activations forward_chunk(const NetworkView& view,
                                 const TrainingColumns& columns,
                                 std::size_t first,
                                 float* memory) {
    const float* const position[3] = {
        columns.position[0] + first, columns.position[1] + first, columns.position[2] + first};
    const float* const normal[3] = {
        columns.normal[0] + first, columns.normal[1] + first, columns.normal[2] + first};
    const NetworkLayout& layout = *view.layout;
    Activations at{};
    at.rows[0] = memory;
    memory += layout.inputs * kTrainChunk;
    encode<kTrainChunk>(view, position, normal, at.rows[0]);
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        const float slope = l + 1 < layout.layers ? layout.config.leaky_slope : 1.0f;
        at.rows[l + 1] = memory;
        memory += shape.rows * kTrainChunk;
        layer_forward<kTrainChunk>(shape, view.parameters, slope, at.rows[l], at.rows[l + 1]);
    }
    return at;
}

inline void evaluate_chunk_kernel(const NetworkView& view,
                                  const TrainingColumns& columns,
                                  std::size_t first,
                                  float* workspace,
                                  float* pdf_and_integral) {
    const GuidingConfig& config = view.layout->config;
    const Activations at = forward_chunk(view, columns, first, workspace);
    const float* rows = at.rows[view.layout->layers];
    for (int s = 0; s < kTrainChunk; s += kLanes) {
        const std::size_t i = first + static_cast<std::size_t>(s);
        Decoded mixture;
        decode(rows + s, kTrainChunk, config, mixture);
        const V wi[3] = {load(columns.wi[0] + i), load(columns.wi[1] + i), load(columns.wi[2] + i)};
        store(pdf_and_integral + s, lobe_densities(mixture, config.lobes, wi).sum);
        store(pdf_and_integral + kTrainChunk + s, mixture.integral);
    }
}

inline float train_chunk_kernel(const NetworkView& view,
                                const TrainingColumns& columns,
                                std::size_t first,
                                float* workspace,
                                float* gradient) {
    const NetworkLayout& layout = *view.layout;
    const GuidingConfig& config = layout.config;
    const Activations at = forward_chunk(view, columns, first, workspace);
    float* dy = at.rows[layout.layers];
    const float inverse_batch = 1.0f / static_cast<float>(config.batch_size);
    V loss{};
    for (int s = 0; s < kTrainChunk; s += kLanes) {
        const std::size_t i = first + static_cast<std::size_t>(s);
        const RecordVector record{
            {load(columns.wi[0] + i), load(columns.wi[1] + i), load(columns.wi[2] + i)},
            load(columns.target + i),
            load(columns.pdf + i),
            load(columns.weight + i)};
        loss += record_gradient(config, record, inverse_batch, kTrainChunk, dy + s);
    }
    const LayerShape& last = layout.layer[static_cast<std::size_t>(layout.layers - 1)];
    for (int padding = last.outputs; padding < last.rows; ++padding) {
        for (int s = 0; s < kTrainChunk; s += kLanes) {
            store(dy + padding * kTrainChunk + s, V{});
        }
    }
    // Backwards; two buffers behind the activations swap.
    float* spare = dy + last.rows * kTrainChunk;
    float* other = spare + widest_rows(layout) * kTrainChunk;
    for (int l = layout.layers - 1; l >= 0; --l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        layer_backward_weights<kTrainChunk>(shape, dy, at.rows[l], gradient);
        if (l > 0) {
            layer_backward_inputs<kTrainChunk>(
                shape, view.parameters, config.leaky_slope, {dy, at.rows[l], spare});
            dy = spare;
            std::swap(spare, other);
        } else if (config.encoding == Encoding::HashGrid) {
            layer_backward_inputs<kTrainChunk>(
                shape, view.parameters, 1.0f, {dy, at.rows[0], spare});
            __builtin_memcpy(at.rows[0],
                             spare,
                             static_cast<std::size_t>(layout.inputs) * kTrainChunk * sizeof(float));
        }
    }
    return sum_lanes(loss);
}

inline void sample_mixtures_kernel(std::span<const VmfMixture> mixtures,
                                   std::span<const float> u_lobe,
                                   std::span<const Vec2> u,
                                   std::span<Vec3> wi) {
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
        wi[i] = HWY_NAMESPACE::sample_mixture(mixtures[i], u_lobe[i], u[i]);
    }
}

inline void mixture_pdfs_kernel(std::span<const VmfMixture> mixtures,
                                std::span<const Vec3> wi,
                                std::span<float> pdf) {
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
        pdf[i] = HWY_NAMESPACE::mixture_pdf(mixtures[i], wi[i]);
    }
}

inline void adam_kernel(const AdamStep& step, const AdamArrays& arrays) {
    const float* gradient = arrays.gradient.data();
    float* first = arrays.first_moment.data();
    float* second = arrays.second_moment.data();
    float* parameters = arrays.parameters.data();
    float* average = arrays.average.data();
    for (std::size_t i = 0; i < arrays.gradient.size(); i += static_cast<std::size_t>(kLanes)) {
        const V g = load(gradient + i) * step.gradient_scale;
        const V m = load(first + i) * step.beta1 + g * (1.0f - step.beta1);
        const V v = load(second + i) * step.beta2 + g * g * (1.0f - step.beta2);
        const V w = load(parameters + i) - step.rate * m / (simd::sqrt<V>(v) + step.epsilon);
        store(first + i, m);
        store(second + i, v);
        store(parameters + i, w);
        store(average + i, load(average + i) * step.ema + w * (1.0f - step.ema));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace pharos
