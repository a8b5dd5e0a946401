// Noise, cells and patterns: what follows from their definitions. Equality with Blender's pictures
// is tested inside Blender (tests/blender/test_textures.py).
#include <bit>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "materials/cellular.h"
#include "materials/gradient_noise.h"
#include "program_support.h"

namespace pharos {
namespace {

using detail::cellular;
using detail::fractal_noise;
using detail::FractalInputs;
using detail::hash_words;
using detail::signed_noise;
using test::OpCase;
using test::random_lanes;
using test::run_op;

TEST(ProceduralHash, DependsOnEveryWordAndEveryBit) {
    const std::uint32_t base = hash_words<4>({1, 2, 3, 4});
    int changed = 0;
    for (std::size_t word = 0; word < 4; ++word) {
        for (int bit = 0; bit < 32; ++bit) {
            std::array<std::uint32_t, 4> key{1, 2, 3, 4};
            key[word] ^= 1u << bit;
            changed += std::popcount(hash_words(key) ^ base);
        }
    }
    // Half of the bits, 2048 of 4096 on average with a deviation of 32.
    EXPECT_NEAR(changed, 2048, 200);
}

template <std::size_t D>
void expect_lattice_zero_and_period() {
    for (int i = -3; i < 3; ++i) {
        detail::NoisePoint<D> p{};
        p.fill(static_cast<float>(i));
        EXPECT_NEAR(signed_noise<D>(p, true), 0.0f, 1e-6f);
        detail::NoisePoint<D> far = p;
        for (float& x : p) {
            x += 0.375f;
        }
        for (float& x : far) {
            x += 100000.375f;
        }
        if (i >= 0) {
            EXPECT_NEAR(signed_noise<D>(p, true), signed_noise<D>(far, true), 0.05f);
        }
        EXPECT_LE(std::abs(signed_noise<D>(p, true)), 1.0f);
    }
}

TEST(GradientNoise, IsZeroAtLatticePointsAndRepeatsFarAway) {
    expect_lattice_zero_and_period<1>();
    expect_lattice_zero_and_period<2>();
    expect_lattice_zero_and_period<3>();
    expect_lattice_zero_and_period<4>();
}

TEST(GradientNoise, IsSmooth) {
    float last = signed_noise<3>({0.0f, 0.3f, 0.7f}, true);
    for (int i = 1; i < 4000; ++i) {
        const float now = signed_noise<3>({static_cast<float>(i) * 0.002f, 0.3f, 0.7f}, true);
        EXPECT_LT(std::abs(now - last), 0.01f);
        last = now;
    }
}

// Each kind of sum with one octave alone.
TEST(FractalNoise, OneOctave) {
    const detail::NoisePoint<3> p{0.3f, 1.7f, -2.2f};
    const float n = signed_noise<3>(p, true);
    FractalInputs in;
    in.offset = 0.4f;
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::Fbm, p, in), 0.5f * n + 0.5f);
    in.normalize = false;
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::Fbm, p, in), n);
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::Multifractal, p, in), n + 1.0f);
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::HeteroTerrain, p, in), n + 0.4f);
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::HybridMultifractal, p, in), n + 0.4f);
    EXPECT_FLOAT_EQ(fractal_noise<3>(FractalType::RidgedMultifractal, p, in),
                    (0.4f - std::abs(n)) * (0.4f - std::abs(n)));
}

// Half an octave lies half-way.
TEST(FractalNoise, PartOfAnOctave) {
    const detail::NoisePoint<2> p{0.3f, 1.7f};
    FractalInputs in;
    const auto at = [&](float octaves) {
        in.octaves = octaves;
        return fractal_noise<2>(FractalType::Fbm, p, in);
    };
    EXPECT_NEAR(at(1.5f), 0.5f * (at(1.0f) + at(2.0f)), 1e-6f);
}

// Without randomness the points are the lattice: distances are known.
TEST(Cellular, RegularLattice) {
    detail::CellInputs in;
    in.randomness = 0.0f;
    const detail::NoisePoint<3> p{0.25f, 3.5f, -1.125f};
    EXPECT_NEAR(cellular<3>(p, in).distance, std::hypot(0.25f, 0.5f, 0.125f), 1e-6f);
    in.metric = CellMetric::Manhattan;
    EXPECT_NEAR(cellular<3>(p, in).distance, 0.875f, 1e-6f);
    in.metric = CellMetric::Chebychev;
    EXPECT_NEAR(cellular<3>(p, in).distance, 0.5f, 1e-6f);
    in.metric = CellMetric::Euclidean;
    in.feature = CellFeature::DistanceToEdge;
    EXPECT_NEAR(cellular<3>({0.125f, 0.25f, -0.25f}, in).distance, 0.25f, 1e-6f);
    in.feature = CellFeature::NSphereRadius;
    EXPECT_NEAR(cellular<3>(p, in).distance, 0.5f, 1e-6f);
}

// The soft minimum without softness is the minimum; F2 is never nearer than F1.
TEST(Cellular, Order) {
    for (const auto& lane : random_lanes(200, 2, -5.0f, 5.0f)) {
        detail::CellInputs in;
        in.smoothness = 0.0f;
        const detail::NoisePoint<2> p{lane[0], lane[1]};
        const float f1 = cellular<2>(p, in).distance;
        in.feature = CellFeature::SmoothF1;
        EXPECT_EQ(cellular<2>(p, in).distance, f1);
        in.smoothness = 1e-4f;
        EXPECT_NEAR(cellular<2>(p, in).distance, f1, 1e-3f);
        in.feature = CellFeature::F2;
        EXPECT_GE(cellular<2>(p, in).distance, f1);
    }
}

// Every operation with extreme inputs: values are numbers.
TEST(ProgramNoise, ExtremeInputsGiveNumbers) {
    const float extremes[] = {0.0f,
                              -0.0f,
                              1e-30f,
                              -1e10f,
                              1e30f,
                              -1e38f,
                              std::numeric_limits<float>::infinity(),
                              std::numeric_limits<float>::quiet_NaN()};
    std::vector<std::vector<float>> lanes;
    for (const float x : extremes) {
        std::vector<float> lane(27, 0.5f);
        lane[0] = lane[2] = lane[3] = x;
        lanes.push_back(lane);
    }
    for (std::uint16_t dimensions = 0; dimensions < 4; ++dimensions) {
        for (std::uint16_t type = 0; type < 5; ++type) {
            const auto mode = static_cast<std::uint16_t>(dimensions + 4 * type);
            const OpCase noise{NodeOpCode::Noise, mode, {3, 1, 1, 1, 1, 1, 1, 1, 1}, 1, {}};
            const OpCase cells{NodeOpCode::Voronoi, mode, {3, 1, 1, 1, 1, 1, 1, 1, 1}, 8, {}};
            for (const OpCase& test : {noise, cells}) {
                const std::vector<Rgb> values = run_op(test, lanes, false);
                EXPECT_EQ(values.size(), lanes.size());
                for (std::size_t i = 0; i < 4; ++i) {
                    EXPECT_TRUE(is_finite(values[i])) << mode << " " << i;
                }
            }
        }
    }
}

TEST(ProgramNoise, FoldedConstantsAreTheSame) {
    for (const std::uint16_t mode : std::vector<std::uint16_t>{2, 6, 0x62}) {
        const std::uint32_t outputs = mode & kColorNoiseBit ? 3 : 1;
        const OpCase noise{NodeOpCode::Noise, mode, {3, 1, 1, 1, 1, 1, 1, 1, 1}, outputs, {}};
        for (const auto& lane : random_lanes(5, 11, 0.1f, 3.0f)) {
            EXPECT_EQ(run_op(noise, {lane}, true)[0], run_op(noise, {lane}, false)[0]);
        }
    }
}

}  // namespace
}  // namespace pharos
