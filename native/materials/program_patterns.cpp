// Patterns: cells (Voronoi), waves, magic, bricks.
#include <algorithm>

#include "materials/cellular.h"
#include "materials/gradient_noise.h"
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

constexpr float kMostOctaves = 15.0f;
constexpr float kTwoPi = 2.0f * kPi;

// x within [lower, upper]; NaN becomes `lower`.
[[nodiscard]] float bounded(float x, float lower, float upper) {
    return std::fmin(std::fmax(x, lower), upper);
}

[[nodiscard]] CellInputs cell_inputs(const Evaluation& e, const NodeOp& op, std::size_t lane) {
    CellInputs in;
    in.octaves = bounded(e.operand(op, 3).scalar(lane), 0.0f, kMostOctaves);
    in.roughness = bounded(e.operand(op, 4).scalar(lane), 0.0f, 1.0f);
    in.lacunarity = e.operand(op, 5).scalar(lane);
    in.smoothness = bounded(0.5f * e.operand(op, 6).scalar(lane), 0.0f, 0.5f);
    in.exponent = e.operand(op, 7).scalar(lane);
    in.randomness = bounded(e.operand(op, 8).scalar(lane), 0.0f, 1.0f);
    in.feature = static_cast<CellFeature>(op.mode >> 2 & 7);
    in.metric = static_cast<CellMetric>(op.mode >> 5 & 3);
    in.normalize = (op.mode & kNormalizeCellsBit) != 0;
    return in;
}

template <std::size_t D>
void run_voronoi_in(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand w = e.operand(op, 1);
    const Operand scale = e.operand(op, 2);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const float s = scale.scalar(i);
        NoisePoint<D> p{};
        const Vec3 v = vector.vector(i) * s;
        for (std::size_t k = 0; k < D; ++k) {
            p[k] = D == 1 || k == 3 ? w.scalar(i) * s : v[static_cast<int>(k)];
        }
        const CellResult<D> result = cellular<D>(p, cell_inputs(e, op, i));
        e.output(op)[i] = result.distance;
        float position[4] = {};
        for (std::size_t k = 0; k < D; ++k) {
            position[D == 1 ? 3 : k] = s != 0.0f ? result.position[k] / s : 0.0f;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            e.output(op, 1 + k)[i] = result.color[k];
        }
        for (std::size_t k = 0; k < 4; ++k) {
            e.output(op, 4 + k)[i] = position[k];
        }
    }
}

// Distance along a wave, before it is bent.
[[nodiscard]] float wave_phase(const Vec3& p, bool rings, int direction) {
    constexpr int kOblique = 3;  // bands: the diagonal; rings: spheres
    if (rings) {
        Vec3 q = p;
        if (direction < kOblique) {
            q[direction] = 0.0f;
        }
        return glm::length(q) * 20.0f;
    }
    return direction < kOblique ? p[direction] * 20.0f : (p.x + p.y + p.z) * 10.0f;
}

[[nodiscard]] float wave_profile(WaveProfile profile, float n) {
    switch (profile) {
        case WaveProfile::Sin:
            return 0.5f + 0.5f * std::sin(n - 0.5f * kPi);
        case WaveProfile::Saw:
            n /= kTwoPi;
            return n - std::floor(n);
        default:
            n /= kTwoPi;
            return std::abs(n - std::floor(n + 0.5f)) * 2.0f;
    }
}

}  // namespace

void run_voronoi(const Evaluation& e, const NodeOp& op) {
    switch (op.mode & 3) {
        case 0:
            return run_voronoi_in<1>(e, op);
        case 1:
            return run_voronoi_in<2>(e, op);
        case 2:
            return run_voronoi_in<3>(e, op);
        default:
            return run_voronoi_in<4>(e, op);
    }
}

void run_wave(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand scale = e.operand(op, 1);
    const Operand distortion = e.operand(op, 2);
    const Operand detail = e.operand(op, 3);
    const Operand detail_scale = e.operand(op, 4);
    const Operand detail_roughness = e.operand(op, 5);
    const Operand phase = e.operand(op, 6);
    const bool rings = (op.mode & 1) != 0;
    const int direction = op.mode >> 1 & 3;
    const auto profile = static_cast<WaveProfile>(op.mode >> 3 & 3);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        // A hair to the side, as for the checker.
        const Vec3 p = (vector.vector(i) * scale.scalar(i) + Vec3(0.000001f)) * 0.999999f;
        float n = wave_phase(p, rings, direction) + phase.scalar(i);
        if (const float bend = distortion.scalar(i); bend != 0.0f) {
            FractalInputs fractal;
            fractal.periodic = (op.mode & kLegacyNoiseBit) == 0;
            fractal.octaves = bounded(detail.scalar(i), 0.0f, kMostOctaves);
            fractal.gain_per_octave = std::fmax(detail_roughness.scalar(i), 0.0f);
            if (!fractal.periodic) {
                fractal.gain_per_octave = std::fmin(fractal.gain_per_octave, 1.0f);
            }
            const Vec3 q = p * detail_scale.scalar(i);
            n +=
                bend * (2.0f * fractal_noise<3>(FractalType::Fbm, {q.x, q.y, q.z}, fractal) - 1.0f);
        }
        out[i] = wave_profile(profile, n);
    }
}

namespace {

// Sines of sines: each further turn takes the sum of the three so far with other signs.
[[nodiscard]] Vec3 magic(const Vec3& p, int depth, float distortion) {
    float x = std::sin((p.x + p.y + p.z) * 5.0f);
    float y = std::cos((-p.x + p.y - p.z) * 5.0f);
    float z = -std::cos((-p.x - p.y + p.z) * 5.0f);

    struct Turn {
        int target;       // which of x, y, z
        float signs[3];   // of the three in the sum
        float amplitude;  // its sign
        bool sine;
    };

    constexpr Turn kTurns[] = {
        {1, {1, -1, 1}, -1, false},
        {0, {1, -1, -1}, 1, false},
        {2, {-1, -1, -1}, 1, true},
        {0, {-1, 1, -1}, -1, false},
        {1, {-1, 1, 1}, -1, true},
        {1, {-1, 1, 1}, -1, false},
        {0, {1, 1, 1}, 1, false},
        {2, {1, 1, -1}, 1, true},
        {0, {-1, -1, 1}, -1, false},
        {1, {1, -1, 1}, -1, true},
    };
    float* const values[] = {&x, &y, &z};
    for (int i = 0; i < std::min(depth, 10); ++i) {
        if (i == 0) {
            x *= distortion;
            y *= distortion;
            z *= distortion;
        }
        const Turn& turn = kTurns[i];
        const float angle = turn.signs[0] * x + turn.signs[1] * y + turn.signs[2] * z;
        *values[turn.target] =
            turn.amplitude * (turn.sine ? std::sin(angle) : std::cos(angle)) * distortion;
    }
    if (distortion != 0.0f) {
        const float halves = 0.5f / distortion;
        return Vec3(0.5f - x * halves, 0.5f - y * halves, 0.5f - z * halves);
    }
    return Vec3(0.5f - x, 0.5f - y, 0.5f - z);
}

}  // namespace

void run_magic(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand scale = e.operand(op, 1);
    const Operand distortion = e.operand(op, 2);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        // Far away the sines would be coarse: whole turns are taken off.
        Vec3 p = vector.vector(i) * scale.scalar(i);
        for (int k = 0; k < 3; ++k) {
            p[k] = std::fmod(p[k], kTwoPi);
        }
        const Vec3 color = magic(p, op.mode, distortion.scalar(i));
        e.store(op, i, color);
        e.output(op, 3)[i] = (color.x + color.y + color.z) * (1.0f / 3.0f);
    }
}

namespace {

// A number of each brick (the cubic congruence known from Perlin's early lectures).
[[nodiscard]] float brick_tint(std::uint32_t n) {
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    const std::uint32_t m = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
    return 0.5f * (static_cast<float>(m) / 1073741824.0f);
}

struct BrickInputs {
    Vec3 p;
    float mortar_size = 0.0f;
    float mortar_smooth = 0.0f;
    float bias = 0.0f;
    float width = 0.0f;
    float height = 0.0f;
    float offset = 0.0f;
    float squash = 1.0f;
    int offset_frequency = 2;
    int squash_frequency = 2;
};

struct BrickResult {
    float tint = 0.0f;
    float mortar = 0.0f;
};

[[nodiscard]] std::int32_t whole(float x) {
    const float floor = std::floor(x);
    return std::abs(floor) < 2147483648.0f ? static_cast<std::int32_t>(floor) : INT32_MIN;
}

[[nodiscard]] BrickResult brick(const BrickInputs& in) {
    const std::int32_t row = whole(in.p.y / in.height);
    float width = in.width;
    float offset = 0.0f;
    if (in.offset_frequency != 0 && in.squash_frequency != 0) {
        width *= row % in.squash_frequency != 0 ? 1.0f : in.squash;
        offset = row % in.offset_frequency != 0 ? 0.0f : width * in.offset;
    }
    const std::int32_t column = whole((in.p.x + offset) / width);
    const float x = in.p.x + offset - width * static_cast<float>(column);
    const float y = in.p.y - in.height * static_cast<float>(row);
    const std::uint32_t number =
        (static_cast<std::uint32_t>(row) << 16) + (static_cast<std::uint32_t>(column) & 0xffffu);
    BrickResult out;
    out.tint = saturate(brick_tint(number) + in.bias);
    const float edge = std::fmin(std::fmin(x, y), std::fmin(width - x, in.height - y));
    if (edge >= in.mortar_size) {
        out.mortar = 0.0f;
    } else if (in.mortar_smooth == 0.0f) {
        out.mortar = 1.0f;
    } else {
        const float t = saturate((1.0f - edge / in.mortar_size) / in.mortar_smooth);
        out.mortar = t * t * (3.0f - 2.0f * t);
    }
    return out;
}

}  // namespace

void run_brick(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand color1 = e.operand(op, 1);
    const Operand color2 = e.operand(op, 2);
    const Operand mortar = e.operand(op, 3);
    const auto scalar = [&](std::uint32_t number, std::size_t lane) {
        return e.operand(op, number).scalar(lane);
    };
    for (std::size_t i = 0; i < e.lanes; ++i) {
        BrickInputs in;
        in.p = vector.vector(i) * scalar(4, i);
        in.mortar_size = scalar(5, i);
        in.mortar_smooth = scalar(6, i);
        in.bias = scalar(7, i);
        in.width = scalar(8, i);
        in.height = scalar(9, i);
        in.offset = scalar(10, i);
        in.squash = scalar(11, i);
        in.offset_frequency = static_cast<int>(bounded(scalar(12, i), 0.0f, 99.0f));
        in.squash_frequency = static_cast<int>(bounded(scalar(13, i), 0.0f, 99.0f));
        const BrickResult result = brick(in);
        const Vec3 brick_color = result.mortar != 1.0f
                                     ? lerp(color1.vector(i), color2.vector(i), result.tint)
                                     : color1.vector(i);
        e.store(op, i, lerp(brick_color, mortar.vector(i), result.mortar));
        e.output(op, 3)[i] = result.mortar;
    }
}

}  // namespace pharos::detail
