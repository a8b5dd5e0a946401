// Noise: the Noise and Musgrave nodes in every dimension and kind of sum, and white noise.
#include <algorithm>

#include "materials/gradient_noise.h"
#include "materials/procedural_hash.h"
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

// Coordinates by dimension: W alone, the plane, space, space and W.
template <std::size_t D>
[[nodiscard]] NoisePoint<D> read_point(const Operand& vector,
                                       const Operand& w,
                                       std::size_t lane,
                                       float scale = 1.0f) {
    NoisePoint<D> p{};
    if constexpr (D == 1) {
        p[0] = w.scalar(lane) * scale;
    } else {
        const Vec3 v = vector.vector(lane) * scale;
        for (std::size_t k = 0; k < std::min<std::size_t>(D, 3); ++k) {
            p[k] = v[static_cast<int>(k)];
        }
        if constexpr (D == 4) {
            p[3] = w.scalar(lane) * scale;
        }
    }
    return p;
}

// A place of its own for each use of the same noise, far from where pictures are.
template <std::size_t D>
[[nodiscard]] NoisePoint<D> far_place(float seed) {
    NoisePoint<D> offset{};
    if constexpr (D == 1) {
        return {100.0f + hash_floats<1>({seed}) * 100.0f};
    }
    for (std::size_t k = 0; k < D; ++k) {
        offset[k] = 100.0f + hash_floats<2>({seed, static_cast<float>(k)}) * 100.0f;
    }
    return offset;
}

template <std::size_t D>
[[nodiscard]] NoisePoint<D> sum(const NoisePoint<D>& a, const NoisePoint<D>& b) {
    NoisePoint<D> out = a;
    for (std::size_t k = 0; k < D; ++k) {
        out[k] += b[k];
    }
    return out;
}

// Places 0 ... D - 1 bend the coordinates, the next two make the colour.
template <std::size_t D>
struct FarPlaces {
    std::array<NoisePoint<D>, D + 2> at{};

    FarPlaces() {
        for (std::size_t k = 0; k < at.size(); ++k) {
            at[k] = far_place<D>(static_cast<float>(k));
        }
    }

    [[nodiscard]] NoisePoint<D> distort(const NoisePoint<D>& p,
                                        float distortion,
                                        bool periodic) const {
        NoisePoint<D> out = p;
        for (std::size_t k = 0; k < D && distortion != 0.0f; ++k) {
            out[k] += signed_noise<D>(sum<D>(p, at[k]), periodic) * distortion;
        }
        return out;
    }
};

struct NoiseOperands {
    Operand vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion;
};

[[nodiscard]] FractalInputs fractal_inputs(const NoiseOperands& in,
                                           std::size_t lane,
                                           std::uint16_t mode) {
    constexpr float kMostOctaves = 15.0f;
    FractalInputs fractal;
    fractal.periodic = (mode & kLegacyNoiseBit) == 0;
    fractal.normalize = (mode & kNormalizeNoiseBit) != 0;
    fractal.octaves = std::fmin(std::fmax(in.detail.scalar(lane), 0.0f), kMostOctaves);
    fractal.gain_per_octave = std::fmax(in.roughness.scalar(lane), 0.0f);
    if (!fractal.periodic) {
        fractal.gain_per_octave = std::fmin(fractal.gain_per_octave, 1.0f);
    }
    fractal.lacunarity = in.lacunarity.scalar(lane);
    fractal.offset = in.offset.scalar(lane);
    fractal.gain = in.gain.scalar(lane);
    return fractal;
}

template <std::size_t D>
void run_noise_in(const Evaluation& e, const NodeOp& op, const NoiseOperands& in) {
    const auto type = static_cast<FractalType>(op.mode >> 2 & 7);
    const bool color = (op.mode & kColorNoiseBit) != 0;
    const FarPlaces<D> places;
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const FractalInputs fractal = fractal_inputs(in, i, op.mode);
        const NoisePoint<D> p =
            places.distort(read_point<D>(in.vector, in.w, i, in.scale.scalar(i)),
                           in.distortion.scalar(i),
                           fractal.periodic);
        e.output(op)[i] = fractal_noise<D>(type, p, fractal);
        if (color) {
            e.output(op, 1)[i] = fractal_noise<D>(type, sum<D>(p, places.at[D]), fractal);
            e.output(op, 2)[i] = fractal_noise<D>(type, sum<D>(p, places.at[D + 1]), fractal);
        }
    }
}

template <std::size_t D>
void run_musgrave_in(const Evaluation& e, const NodeOp& op, const NoiseOperands& in) {
    const auto type = static_cast<FractalType>(op.mode >> 2 & 7);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        FractalInputs fractal = fractal_inputs(in, i, kLegacyNoiseBit);
        const float dimension = std::fmax(in.roughness.scalar(i), 1e-5f);
        fractal.lacunarity = std::fmax(fractal.lacunarity, 1e-5f);
        fractal.gain_per_octave = std::pow(fractal.lacunarity, -dimension);
        const NoisePoint<D> p = read_point<D>(in.vector, in.w, i, in.scale.scalar(i));
        e.output(op)[i] = musgrave_noise<D>(type, p, fractal);
    }
}

template <std::size_t D>
void run_white_noise_in(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand w = e.operand(op, 1);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const NoisePoint<D> p = read_point<D>(vector, w, i);
        const auto [x, y, z] = hash_floats_to_3(p);
        e.store(op, i, Vec3(x, y, z));
        e.output(op, 3)[i] = D == 4 ? hash_floats(p) : x;
    }
}

}  // namespace

void run_noise(const Evaluation& e, const NodeOp& op) {
    const NoiseOperands in{e.operand(op, 0),
                           e.operand(op, 1),
                           e.operand(op, 2),
                           e.operand(op, 3),
                           e.operand(op, 4),
                           e.operand(op, 5),
                           e.operand(op, 6),
                           e.operand(op, 7),
                           e.operand(op, 8)};
    switch (op.mode & 3) {
        case 0:
            return run_noise_in<1>(e, op, in);
        case 1:
            return run_noise_in<2>(e, op, in);
        case 2:
            return run_noise_in<3>(e, op, in);
        default:
            return run_noise_in<4>(e, op, in);
    }
}

void run_musgrave(const Evaluation& e, const NodeOp& op) {
    const NoiseOperands in{e.operand(op, 0),
                           e.operand(op, 1),
                           e.operand(op, 2),
                           e.operand(op, 3),
                           e.operand(op, 4),
                           e.operand(op, 5),
                           e.operand(op, 6),
                           e.operand(op, 7),
                           Operand()};
    switch (op.mode & 3) {
        case 0:
            return run_musgrave_in<1>(e, op, in);
        case 1:
            return run_musgrave_in<2>(e, op, in);
        case 2:
            return run_musgrave_in<3>(e, op, in);
        default:
            return run_musgrave_in<4>(e, op, in);
    }
}

void run_white_noise(const Evaluation& e, const NodeOp& op) {
    switch (op.mode & 3) {
        case 0:
            return run_white_noise_in<1>(e, op);
        case 1:
            return run_white_noise_in<2>(e, op);
        case 2:
            return run_white_noise_in<3>(e, op);
        default:
            return run_white_noise_in<4>(e, op);
    }
}

}  // namespace pharos::detail
