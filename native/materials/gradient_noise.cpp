#include "materials/gradient_noise.h"

#include <algorithm>

#include "core/math.h"

namespace pharos::detail {

namespace {

// One point on its way through the octaves. `whole` full ones and a share of one more.
template <std::size_t D>
class Octaves {
  public:
    Octaves(const NoisePoint<D>& p, const FractalInputs& in, int first_extra)
        : p_(p), in_(in), whole_(static_cast<int>(in.octaves) + first_extra) {
        rest_ = in.octaves - std::floor(in.octaves);
    }

    [[nodiscard]] int whole() const { return whole_; }

    [[nodiscard]] float rest() const { return rest_; }

    // The noise of this octave; the next call gives the next one's.
    [[nodiscard]] float next() {
        const float value = signed_noise<D>(p_, in_.periodic);
        p_ = scaled<D>(p_, in_.lacunarity);
        return value;
    }

  private:
    NoisePoint<D> p_;
    const FractalInputs& in_;
    int whole_;
    float rest_;
};

// Sum of ever finer and fainter noise, over [0, 1] when normalised.
template <std::size_t D>
[[nodiscard]] float brownian(const NoisePoint<D>& p, const FractalInputs& in) {
    float frequency = 1.0f;
    float amplitude = 1.0f;
    float most = 0.0f;
    float sum = 0.0f;
    const int octaves = static_cast<int>(in.octaves);
    const auto normalized = [&](float value, float range) {
        return in.normalize ? 0.5f * value / range + 0.5f : value;
    };
    for (int i = 0; i <= octaves; ++i) {
        sum += signed_noise<D>(scaled<D>(p, frequency), in.periodic) * amplitude;
        most += amplitude;
        amplitude *= in.gain_per_octave;
        frequency *= in.lacunarity;
    }
    const float rest = in.octaves - std::floor(in.octaves);
    if (rest == 0.0f) {
        return normalized(sum, most);
    }
    const float more = sum + signed_noise<D>(scaled<D>(p, frequency), in.periodic) * amplitude;
    return lerp(normalized(sum, most), normalized(more, most + amplitude), rest);
}

template <std::size_t D>
[[nodiscard]] float plain_sum(Octaves<D> octaves, const FractalInputs& in) {
    float value = 0.0f;
    float power = 1.0f;
    for (int i = 0; i < octaves.whole(); ++i, power *= in.gain_per_octave) {
        value += octaves.next() * power;
    }
    return octaves.rest() != 0.0f ? value + octaves.rest() * octaves.next() * power : value;
}

template <std::size_t D>
[[nodiscard]] float multifractal(Octaves<D> octaves, const FractalInputs& in) {
    float value = 1.0f;
    float power = 1.0f;
    for (int i = 0; i < octaves.whole(); ++i, power *= in.gain_per_octave) {
        value *= power * octaves.next() + 1.0f;
    }
    return octaves.rest() != 0.0f ? value * (octaves.rest() * power * octaves.next() + 1.0f)
                                  : value;
}

// Roughness grows with height.
template <std::size_t D>
[[nodiscard]] float hetero_terrain(Octaves<D> octaves, const FractalInputs& in) {
    float power = in.gain_per_octave;
    float value = in.offset + octaves.next();
    for (int i = 1; i < octaves.whole(); ++i, power *= in.gain_per_octave) {
        value += (octaves.next() + in.offset) * power * value;
    }
    if (octaves.rest() != 0.0f) {
        value += octaves.rest() * ((octaves.next() + in.offset) * power * value);
    }
    return value;
}

// Each octave counts as much as the one before was high.
template <std::size_t D>
[[nodiscard]] float hybrid_multifractal(Octaves<D> octaves, const FractalInputs& in) {
    float power = 1.0f;
    float value = 0.0f;
    float weight = 1.0f;
    const auto add = [&](float share) {
        weight = std::min(weight, 1.0f);
        const float signal = (octaves.next() + in.offset) * power;
        value += share * weight * signal;
        power *= in.gain_per_octave;
        weight *= in.gain * signal;
    };
    for (int i = 0; i < octaves.whole() && weight > 0.001f; ++i) {
        add(1.0f);
    }
    if (octaves.rest() != 0.0f && weight > 0.001f) {
        add(octaves.rest());
    }
    return value;
}

template <std::size_t D>
[[nodiscard]] float ridged_multifractal(Octaves<D> octaves, const FractalInputs& in) {
    float power = in.gain_per_octave;
    float signal = sqr(in.offset - std::abs(octaves.next()));
    float value = signal;
    for (int i = 1; i < octaves.whole(); ++i, power *= in.gain_per_octave) {
        const float weight = saturate(signal * in.gain);
        signal = sqr(in.offset - std::abs(octaves.next())) * weight;
        value += signal * power;
    }
    return value;
}

template <std::size_t D>
[[nodiscard]] float other_fractal(FractalType type,
                                  const Octaves<D>& octaves,
                                  const FractalInputs& in) {
    switch (type) {
        case FractalType::Multifractal:
            return multifractal<D>(octaves, in);
        case FractalType::HybridMultifractal:
            return hybrid_multifractal<D>(octaves, in);
        case FractalType::RidgedMultifractal:
            return ridged_multifractal<D>(octaves, in);
        default:
            return hetero_terrain<D>(octaves, in);
    }
}

}  // namespace

template <std::size_t D>
float fractal_noise(FractalType type, const NoisePoint<D>& p, const FractalInputs& in) {
    return type == FractalType::Fbm ? brownian<D>(p, in)
                                    : other_fractal<D>(type, Octaves<D>(p, in, 1), in);
}

template <std::size_t D>
float musgrave_noise(FractalType type, const NoisePoint<D>& p, const FractalInputs& in) {
    const Octaves<D> octaves(p, in, 0);
    return type == FractalType::Fbm ? plain_sum<D>(octaves, in)
                                    : other_fractal<D>(type, octaves, in);
}

template float fractal_noise<1>(FractalType, const NoisePoint<1>&, const FractalInputs&);
template float fractal_noise<2>(FractalType, const NoisePoint<2>&, const FractalInputs&);
template float fractal_noise<3>(FractalType, const NoisePoint<3>&, const FractalInputs&);
template float fractal_noise<4>(FractalType, const NoisePoint<4>&, const FractalInputs&);
template float musgrave_noise<1>(FractalType, const NoisePoint<1>&, const FractalInputs&);
template float musgrave_noise<2>(FractalType, const NoisePoint<2>&, const FractalInputs&);
template float musgrave_noise<3>(FractalType, const NoisePoint<3>&, const FractalInputs&);
template float musgrave_noise<4>(FractalType, const NoisePoint<4>&, const FractalInputs&);

}  // namespace pharos::detail
