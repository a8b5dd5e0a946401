// Encoding and layers of the network for one instruction set; included by mlp.cpp once a target.
//
// Activations lie as rows of kStride samples: [feature][sample]. Every kernel keeps a tile of 4
// rows x some vectors of samples in registers and broadcasts single weights.
#undef PHAROS_VECTOR_BYTES
#if HWY_MAX_BYTES < 16
#define PHAROS_VECTOR_BYTES 16  // Highway's scalar fallback: every x86-64 has SSE2
#else
#define PHAROS_VECTOR_BYTES HWY_MAX_BYTES
#endif

namespace pharos {
namespace HWY_NAMESPACE {

using V [[gnu::vector_size(PHAROS_VECTOR_BYTES)]] = float;
inline constexpr int kLanes = PHAROS_VECTOR_BYTES / 4;

PHAROS_SIMD_INLINE V load(const float* p) {
    return *reinterpret_cast<const V*>(p);
}

[[gnu::always_inline]] inline void store(float* p, const V& v) {
    *reinterpret_cast<V*>(p) = v;
}

PHAROS_SIMD_INLINE V finite_or_zero(const V& x) {
    return simd::select(simd::abs(x) <= 3e38f, x, V{});
}

// Position over the scene box, raw and with octaves of sine and cosine of (pi / 2) 2^k p by the
// double-angle recurrence; outside of the box the coordinate stops soon.
template <int kStride>
inline void encode_position(const NetworkView& view, const float* const position[3], float* rows) {
    const int octaves = view.layout->config.octaves;
    for (int axis = 0; axis < 3; ++axis) {
        for (int s = 0; s < kStride; s += kLanes) {
            const V centered = finite_or_zero(load(position[axis] + s)) - view.center[axis];
            const V scaled = centered * view.inverse_half_extent[axis];
            const V p =
                simd::min(simd::max(scaled, simd::broadcast<V>(-1.25f)), simd::broadcast<V>(1.25f));
            store(rows + axis * kStride + s, p);
            if (octaves > 0) {
                float* out = rows + (3 + axis * 2 * octaves) * kStride + s;
                simd::SinCos<V> wave = simd::sincos_turns<V>(0.25f * p);
                for (int k = 0; k < octaves; ++k) {
                    store(out + (2 * k) * kStride, wave.sin);
                    store(out + (2 * k + 1) * kStride, wave.cos);
                    const V doubled = 2.0f * wave.sin * wave.cos;
                    wave.cos = 1.0f - 2.0f * wave.sin * wave.sin;
                    wave.sin = doubled;
                }
            }
        }
    }
}

template <int kStride>
inline void encode_position_grid(const NetworkView& view,
                                 const float* const position[3],
                                 float* rows) {
    const float* table = view.parameters + view.layout->mlp_parameters;
    for (int s = 0; s < kStride; ++s) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis) {
            const float x = position[axis][s];
            const float scaled = ((std::isfinite(x) ? x : 0.0f) - view.center[axis]) *
                                 view.inverse_half_extent[axis];
            p[axis] = std::clamp(scaled, -1.0f, 1.0f);
        }
        encode_grid(view.layout->config, table, p, rows + s, kStride);
    }
}

template <int kStride>
inline void encode(const NetworkView& view,
                   const float* const position[3],
                   const float* const normal[3],
                   float* rows) {
    if (view.layout->config.encoding == Encoding::Frequency) {
        encode_position<kStride>(view, position, rows);
    } else {
        encode_position_grid<kStride>(view, position, rows);
    }
    if (view.layout->config.use_normal) {
        float* out = rows + view.layout->position_inputs * kStride;
        for (int axis = 0; axis < 3; ++axis) {
            for (int s = 0; s < kStride; s += kLanes) {
                const V n = finite_or_zero(load(normal[axis] + s));
                const V limited =
                    simd::min(simd::max(n, simd::broadcast<V>(-1.0f)), simd::broadcast<V>(1.0f));
                store(out + axis * kStride + s, limited);
            }
        }
    }
}

// Vectors of samples in a register tile of four rows: 16 accumulators of 32 registers, 12 of 16.
inline constexpr int kTileVectors = PHAROS_VECTOR_BYTES == 64 ? 4 : 3;

// Calls tile.template run<count>(first) over `kVectors` vectors, in tiles of kTileVectors and at
// the end of two.
template <int kVectors, int kFirst = 0, class Tile>
[[gnu::always_inline]] inline void for_each_tile(const Tile& tile) {
    constexpr int kLeft = kVectors - kFirst;
    if constexpr (kLeft > 0) {
        constexpr bool kWhole = kLeft >= kTileVectors && kLeft - kTileVectors != 1;
        constexpr int kCount = kWhole ? kTileVectors : std::min(2, kLeft);
        tile.template run<kCount>(kFirst * kLanes);
        for_each_tile<kVectors, kFirst + kCount>(tile);
    }
}

// Four outputs of a layer: y = activation(W x + b); slope 1 is the identity.
template <int kStride>
struct ForwardTile {
    const float* __restrict weight;
    const float* __restrict bias;
    int inputs;
    float slope;
    const float* __restrict x;
    float* __restrict y;

    template <int kVectors>
    [[gnu::always_inline]] void run(int s) const {
        V sum[kRowTile][kVectors];
#pragma GCC unroll 16
        for (int i = 0; i < kRowTile; ++i) {
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) {
                sum[i][v] = simd::broadcast<V>(bias[i]);
            }
        }
        const float* input = x + s;
        // Unrolled so that the loop is short enough for its end to be predicted.
#pragma GCC unroll 4
        for (int k = 0; k < inputs; ++k, input += kStride) {
            V in[kVectors];
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) {
                in[v] = load(input + v * kLanes);
            }
#pragma GCC unroll 16
            for (int i = 0; i < kRowTile; ++i) {
                const float w = weight[i * inputs + k];
#pragma GCC unroll 16
                for (int v = 0; v < kVectors; ++v) {
                    sum[i][v] += w * in[v];
                }
            }
        }
#pragma GCC unroll 16
        for (int i = 0; i < kRowTile; ++i) {
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) {
                // slope < 1: the larger of the two is the leaky ReLU
                store(y + i * kStride + s + v * kLanes, simd::max(sum[i][v], slope * sum[i][v]));
            }
        }
    }
};

template <int kStride>
inline void layer_forward(
    const LayerShape& shape, const float* parameters, float slope, const float* x, float* y) {
    for (int row = 0; row < shape.rows; row += kRowTile) {
        const ForwardTile<kStride> tile{parameters + shape.weights + row * shape.inputs,
                                        parameters + shape.biases + row,
                                        shape.inputs,
                                        slope,
                                        x,
                                        y + row * kStride};
        for_each_tile<kStride / kLanes>(tile);
    }
}

// kRows inputs of layer_backward_inputs.
template <int kStride, int kRows>
struct BackwardInputsTile {
    const float* __restrict weight;
    int inputs;
    int outputs;
    float slope;
    const float* __restrict dy;
    const float* __restrict x;
    float* __restrict dx;

    template <int kVectors>
    [[gnu::always_inline]] void run(int s) const {
        V sum[kRows][kVectors] = {};
        const float* out = dy + s;
        const float* w = weight;
#pragma GCC unroll 4
        for (int row = 0; row < outputs; ++row, w += inputs, out += kStride) {
            V in[kVectors];
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) {
                in[v] = load(out + v * kLanes);
            }
#pragma GCC unroll 16
            for (int i = 0; i < kRows; ++i) {
#pragma GCC unroll 16
                for (int v = 0; v < kVectors; ++v) {
                    sum[i][v] += w[i] * in[v];
                }
            }
        }
#pragma GCC unroll 16
        for (int i = 0; i < kRows; ++i) {
#pragma GCC unroll 16
            for (int v = 0; v < kVectors; ++v) {
                const int at = i * kStride + s + v * kLanes;
                const V scaled = slope * sum[i][v];
                store(dx + at, simd::select(load(x + at) > 0.0f, sum[i][v], scaled));
            }
        }
    }
};

// Rows on the way back through a layer: the gradient of its outputs, its inputs, and their
// gradient.
struct BackwardRows {
    const float* dy;
    const float* x;
    float* dx;
};

// dx = W^T dy, times the slope where the activation x (an output of the layer below) is negative.
template <int kStride>
inline void layer_backward_inputs(const LayerShape& shape,
                                  const float* parameters,
                                  float slope,
                                  const BackwardRows& rows) {
    const float* weight = parameters + shape.weights;
    const int inputs = shape.inputs;
    const int outputs = shape.outputs;
    int k = 0;
    for (; k + kRowTile <= inputs; k += kRowTile) {
        const int at = k * kStride;
        for_each_tile<kStride / kLanes>(BackwardInputsTile<kStride, kRowTile>{
            weight + k, inputs, outputs, slope, rows.dy, rows.x + at, rows.dx + at});
    }
    for (; k < inputs; ++k) {
        const int at = k * kStride;
        for_each_tile<kStride / kLanes>(BackwardInputsTile<kStride, 1>{
            weight + k, inputs, outputs, slope, rows.dy, rows.x + at, rows.dx + at});
    }
}

PHAROS_SIMD_INLINE float sum_lanes(const V& v) {
    // Halving in a fixed order.
    float lanes[kLanes];
    __builtin_memcpy(lanes, &v, sizeof(v));
    for (int half = kLanes / 2; half > 0; half /= 2) {
        for (int i = 0; i < half; ++i) {
            lanes[i] += lanes[i + half];
        }
    }
    return lanes[0];
}

// add_pairs: a and b to [a0 + a1, a2 + a3, b0 + b1, b2 + b3] in every 128 bits.
// add_halves: neighbouring 128-bit blocks of a, then of b, added.
#if PHAROS_VECTOR_BYTES == 64
PHAROS_SIMD_INLINE V add_pairs(const V& a, const V& b) {
    return __builtin_shufflevector(
               a, b, 0, 2, 16, 18, 4, 6, 20, 22, 8, 10, 24, 26, 12, 14, 28, 30) +
           __builtin_shufflevector(a, b, 1, 3, 17, 19, 5, 7, 21, 23, 9, 11, 25, 27, 13, 15, 29, 31);
}

PHAROS_SIMD_INLINE V add_halves(const V& a, const V& b) {
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27) +
           __builtin_shufflevector(
               a, b, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31);
}
#elif PHAROS_VECTOR_BYTES == 32
PHAROS_SIMD_INLINE V add_pairs(const V& a, const V& b) {
    return __builtin_shufflevector(a, b, 0, 2, 8, 10, 4, 6, 12, 14) +
           __builtin_shufflevector(a, b, 1, 3, 9, 11, 5, 7, 13, 15);
}

PHAROS_SIMD_INLINE V add_halves(const V& a, const V& b) {
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
           __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}
#else
PHAROS_SIMD_INLINE V add_pairs(const V& a, const V& b) {
    return __builtin_shufflevector(a, b, 0, 2, 4, 6) + __builtin_shufflevector(a, b, 1, 3, 5, 7);
}
#endif

// Lane i of the result is the sum over v[i]: kLanes horizontal sums at once, in a fixed order.
PHAROS_SIMD_INLINE V sum_each(const V v[kLanes]) {
    V quad[kLanes / 4];
#pragma GCC unroll 4
    for (int i = 0; i < kLanes / 4; ++i) {
        const V* four = v + 4 * i;
        quad[i] = add_pairs(add_pairs(four[0], four[1]), add_pairs(four[2], four[3]));
    }
#if PHAROS_VECTOR_BYTES == 64
    return add_halves(add_halves(quad[0], quad[1]), add_halves(quad[2], quad[3]));
#elif PHAROS_VECTOR_BYTES == 32
    return add_halves(quad[0], quad[1]);
#else
    return quad[0];
#endif
}

// Gradients of weights and biases: sums over the samples of dy x^T and dy.
template <int kStride>
inline void layer_backward_weights(const LayerShape& shape,
                                   const float* __restrict dy,
                                   const float* __restrict x,
                                   float* __restrict gradient) {
    constexpr int kColumns = kLanes / kRowTile;  // a tile has as many sums as a vector has lanes
    const int inputs = shape.inputs;
    for (int row = 0; row < shape.rows; row += kRowTile) {
        const float* out = dy + row * kStride;
        float* row_gradient = gradient + shape.weights + row * inputs;
        int k = 0;
        for (; k + kColumns <= inputs; k += kColumns) {
            V sum[kLanes] = {};
            const float* in = x + k * kStride;
            for (int s = 0; s < kStride; s += kLanes) {
#pragma GCC unroll 16
                for (int c = 0; c < kColumns; ++c) {
                    const V a = load(in + c * kStride + s);
#pragma GCC unroll 16
                    for (int i = 0; i < kRowTile; ++i) {
                        sum[i * kColumns + c] += load(out + i * kStride + s) * a;
                    }
                }
            }
            const V total = sum_each(sum);
            float lanes[kLanes];
            __builtin_memcpy(lanes, &total, sizeof(total));
            for (int i = 0; i < kRowTile; ++i) {
                __builtin_memcpy(
                    row_gradient + i * inputs + k, lanes + i * kColumns, kColumns * sizeof(float));
            }
        }
        for (; k < inputs; ++k) {
            for (int i = 0; i < kRowTile; ++i) {
                V sum{};
                for (int s = 0; s < kStride; s += kLanes) {
                    sum += load(out + i * kStride + s) * load(x + k * kStride + s);
                }
                row_gradient[i * inputs + k] = sum_lanes(sum);
            }
        }
        for (int i = 0; i < kRowTile; ++i) {
            V sum{};
            for (int s = 0; s < kStride; s += kLanes) {
                sum += load(out + i * kStride + s);
            }
            gradient[shape.biases + static_cast<std::size_t>(row + i)] = sum_lanes(sum);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace pharos
