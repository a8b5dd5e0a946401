// Arithmetic operations against formulas in double, over batches and folded.
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "program_support.h"

namespace pharos {
namespace {

using test::OpCase;
using test::random_lanes;
using test::run_op;

constexpr double kPiD = std::numbers::pi;

using Lanes = std::vector<std::vector<float>>;
using Reference = std::function<glm::dvec3(const std::vector<float>&)>;

// Every lane of a batch against the formula, a batch of one and the folded program against the
// batch.
void check_op(const OpCase& test,
              const Lanes& lanes,
              double tolerance,
              const Reference& reference) {
    const std::vector<Rgb> got = run_op(test, lanes, false);
    for (std::size_t i = 0; i < lanes.size(); ++i) {
        const glm::dvec3 want = reference(lanes[i]);
        for (int c = 0; c < 3; ++c) {
            const double scale = 1.0 + std::abs(want[c]);
            EXPECT_NEAR(static_cast<double>(got[i][c]), want[c], tolerance * scale)
                << "code " << static_cast<int>(test.code) << " mode " << test.mode << " lane " << i
                << " component " << c;
        }
    }
    for (std::size_t i = 0; i < lanes.size(); i += 97) {
        // Operands beyond the fourth come from the first lane of a run.
        if (test.sizes.size() <= 4) {
            EXPECT_EQ(run_op(test, {lanes[i]}, false)[0], got[i]);
            EXPECT_EQ(run_op(test, {lanes[i]}, true)[0], got[i]);
        }
    }
}

[[nodiscard]] double fraction(double x) {
    return x - std::floor(x);
}

[[nodiscard]] double smooth_min(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - h * h * h * k / 6.0;
}

struct ScalarCase {
    MathMode mode;
    std::function<double(double, double, double)> formula;
};

TEST(ProgramMath, EveryScalarModeMatchesItsFormula) {
    const std::vector<ScalarCase> cases = {
        {MathMode::Add, [](double a, double b, double) { return a + b; }},
        {MathMode::Subtract, [](double a, double b, double) { return a - b; }},
        {MathMode::Multiply, [](double a, double b, double) { return a * b; }},
        {MathMode::Divide, [](double a, double b, double) { return a / b; }},
        {MathMode::Sine, [](double a, double, double) { return std::sin(a); }},
        {MathMode::Cosine, [](double a, double, double) { return std::cos(a); }},
        {MathMode::Arcsine,
         [](double a, double, double) { return std::asin(std::clamp(a, -1.0, 1.0)); }},
        {MathMode::Arccosine,
         [](double a, double, double) { return std::acos(std::clamp(a, -1.0, 1.0)); }},
        {MathMode::Arctangent, [](double a, double, double) { return std::atan(a); }},
        {MathMode::Power,
         [](double a, double b, double) { return a < 0.0 ? 0.0 : std::pow(a, b); }},
        {MathMode::Logarithm,
         [](double a, double b, double) {
             return a > 0.0 && b > 0.0 ? std::log(a) / std::log(b) : 0.0;
         }},
        {MathMode::Minimum, [](double a, double b, double) { return std::min(a, b); }},
        {MathMode::Maximum, [](double a, double b, double) { return std::max(a, b); }},
        {MathMode::Round, [](double a, double, double) { return std::floor(a + 0.5); }},
        {MathMode::LessThan, [](double a, double b, double) { return a < b ? 1.0 : 0.0; }},
        {MathMode::GreaterThan, [](double a, double b, double) { return a > b ? 1.0 : 0.0; }},
        {MathMode::Absolute, [](double a, double, double) { return std::abs(a); }},
        {MathMode::Arctan2, [](double a, double b, double) { return std::atan2(a, b); }},
        {MathMode::Floor, [](double a, double, double) { return std::floor(a); }},
        {MathMode::Ceil, [](double a, double, double) { return std::ceil(a); }},
        {MathMode::Fract, [](double a, double, double) { return fraction(a); }},
        {MathMode::Sqrt, [](double a, double, double) { return std::sqrt(std::max(a, 0.0)); }},
        {MathMode::InverseSqrt,
         [](double a, double, double) { return a > 0.0 ? 1.0 / std::sqrt(a) : 0.0; }},
        {MathMode::Sign,
         [](double a, double, double) { return a > 0.0 ? 1.0 : (a < 0.0 ? -1.0 : 0.0); }},
        {MathMode::Exponent, [](double a, double, double) { return std::exp(a); }},
        {MathMode::Radians, [](double a, double, double) { return a * kPiD / 180.0; }},
        {MathMode::Degrees, [](double a, double, double) { return a * 180.0 / kPiD; }},
        {MathMode::Sinh, [](double a, double, double) { return std::sinh(a); }},
        {MathMode::Cosh, [](double a, double, double) { return std::cosh(a); }},
        {MathMode::Tanh, [](double a, double, double) { return std::tanh(a); }},
        {MathMode::Trunc, [](double a, double, double) { return std::trunc(a); }},
        {MathMode::Compare,
         [](double a, double b, double c) {
             return std::abs(a - b) <= std::max(c, 1e-7) ? 1.0 : 0.0;
         }},
        {MathMode::MultiplyAdd, [](double a, double b, double c) { return a * b + c; }},
        {MathMode::Pingpong,
         [](double a, double b, double) {
             return std::abs(fraction((a - b) / (2.0 * b)) * 2.0 * b - b);
         }},
        {MathMode::SmoothMin, [](double a, double b, double c) { return smooth_min(a, b, c); }},
        {MathMode::SmoothMax, [](double a, double b, double c) { return -smooth_min(-a, -b, c); }},
    };
    for (const ScalarCase& scalar : cases) {
        const OpCase test{
            NodeOpCode::Math, static_cast<std::uint16_t>(scalar.mode), {1, 1, 1}, 1, {}};
        check_op(test, random_lanes(500, 3, -4.0f, 4.0f), 2e-5, [&](const std::vector<float>& v) {
            const double a = static_cast<double>(v[0]);
            const double b = static_cast<double>(v[1]);
            const double c = static_cast<double>(v[2]);
            return glm::dvec3(scalar.formula(a, b, c));
        });
    }
}

[[nodiscard]] float math(MathMode mode, float a, float b = 0.0f, float c = 0.0f) {
    const OpCase test{NodeOpCode::Math, static_cast<std::uint16_t>(mode), {1, 1, 1}, 1, {}};
    const float varied = run_op(test, {{a, b, c}}, false)[0].x;
    EXPECT_EQ(run_op(test, {{a, b, c}}, true)[0].x, varied);
    return varied;
}

TEST(ProgramMath, SteppedModesByExample) {
    EXPECT_FLOAT_EQ(math(MathMode::Modulo, 5.5f, 2.0f), 1.5f);
    EXPECT_FLOAT_EQ(math(MathMode::Modulo, -5.5f, 2.0f), -1.5f);
    EXPECT_FLOAT_EQ(math(MathMode::FlooredModulo, -5.5f, 2.0f), 0.5f);
    EXPECT_FLOAT_EQ(math(MathMode::Snap, 5.5f, 2.0f), 4.0f);
    EXPECT_FLOAT_EQ(math(MathMode::Snap, -0.5f, 2.0f), -2.0f);
    EXPECT_FLOAT_EQ(math(MathMode::Wrap, 5.5f, 3.0f, 1.0f), 1.5f);
    EXPECT_FLOAT_EQ(math(MathMode::Wrap, 0.5f, 3.0f, 1.0f), 2.5f);
    EXPECT_FLOAT_EQ(math(MathMode::Wrap, 0.5f, 3.0f, 3.0f), 3.0f);
    EXPECT_FLOAT_EQ(math(MathMode::Pingpong, 3.5f, 2.0f), 0.5f);
    EXPECT_FLOAT_EQ(math(MathMode::Compare, 1.0f, 1.05f, 0.1f), 1.0f);
    EXPECT_FLOAT_EQ(math(MathMode::Tangent, 0.5f), std::tan(0.5f));
    EXPECT_FLOAT_EQ(math(MathMode::SmoothMin, 1.0f, 2.0f, 0.0f), 1.0f);
}

TEST(ProgramMath, WhatHasNoValueIsZero) {
    EXPECT_EQ(math(MathMode::Divide, 1.0f, 0.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Modulo, 1.0f, 0.0f), 0.0f);
    EXPECT_EQ(math(MathMode::FlooredModulo, 1.0f, 0.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Snap, 1.0f, 0.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Pingpong, 1.0f, 0.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Power, -2.0f, 0.5f), 0.0f);
    EXPECT_EQ(math(MathMode::Power, -2.0f, 3.0f), -8.0f);
    EXPECT_EQ(math(MathMode::Power, 0.0f, 0.0f), 1.0f);
    EXPECT_EQ(math(MathMode::Logarithm, -1.0f, 10.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Logarithm, 4.0f, 1.0f), 0.0f);
    EXPECT_EQ(math(MathMode::Sqrt, -1.0f), 0.0f);
    EXPECT_EQ(math(MathMode::InverseSqrt, 0.0f), 0.0f);
}

TEST(ProgramMath, ClampBitLimitsTheResult) {
    const OpCase test{NodeOpCode::Math,
                      static_cast<std::uint16_t>(static_cast<int>(MathMode::Add) | kClampBit),
                      {1, 1, 1},
                      1,
                      {}};
    const std::vector<Rgb> got =
        run_op(test, {{2.0f, 1.0f, 0.0f}, {-2.0f, 1.0f, 0.0f}, {0.25f, 0.5f, 0.0f}}, false);
    EXPECT_EQ(got[0].x, 1.0f);
    EXPECT_EQ(got[1].x, 0.0f);
    EXPECT_EQ(got[2].x, 0.75f);
}

struct VectorCase {
    VectorMathMode mode;
    std::function<glm::dvec3(glm::dvec3, glm::dvec3, glm::dvec3, double)> formula;
};

[[nodiscard]] glm::dvec3 each(const glm::dvec3& a, const std::function<double(double)>& f) {
    return {f(a.x), f(a.y), f(a.z)};
}

TEST(ProgramMath, EveryVectorModeMatchesItsFormula) {
    using V = glm::dvec3;
    // NOLINTBEGIN(performance-unnecessary-value-param): formulas read best by value
    const std::vector<VectorCase> cases = {
        {VectorMathMode::Add, [](V a, V b, V, double) { return a + b; }},
        {VectorMathMode::Subtract, [](V a, V b, V, double) { return a - b; }},
        {VectorMathMode::Multiply, [](V a, V b, V, double) { return a * b; }},
        {VectorMathMode::Divide, [](V a, V b, V, double) { return a / b; }},
        {VectorMathMode::CrossProduct, [](V a, V b, V, double) { return glm::cross(a, b); }},
        {VectorMathMode::Project,
         [](V a, V b, V, double) { return b * (glm::dot(a, b) / glm::dot(b, b)); }},
        {VectorMathMode::Reflect,
         [](V a, V b, V, double) { return a - b * (2.0 * glm::dot(a, b) / glm::dot(b, b)); }},
        {VectorMathMode::DotProduct, [](V a, V b, V, double) { return V(glm::dot(a, b)); }},
        {VectorMathMode::Distance, [](V a, V b, V, double) { return V(glm::length(a - b)); }},
        {VectorMathMode::Length, [](V a, V, V, double) { return V(glm::length(a)); }},
        {VectorMathMode::Scale, [](V a, V, V, double s) { return a * s; }},
        {VectorMathMode::Normalize, [](V a, V, V, double) { return a / glm::length(a); }},
        {VectorMathMode::Floor, [](V a, V, V, double) { return glm::floor(a); }},
        {VectorMathMode::Ceil, [](V a, V, V, double) { return glm::ceil(a); }},
        {VectorMathMode::Fraction, [](V a, V, V, double) { return a - glm::floor(a); }},
        {VectorMathMode::Absolute, [](V a, V, V, double) { return glm::abs(a); }},
        {VectorMathMode::Minimum, [](V a, V b, V, double) { return glm::min(a, b); }},
        {VectorMathMode::Maximum, [](V a, V b, V, double) { return glm::max(a, b); }},
        {VectorMathMode::Sine,
         [](V a, V, V, double) { return each(a, [](double x) { return std::sin(x); }); }},
        {VectorMathMode::Cosine,
         [](V a, V, V, double) { return each(a, [](double x) { return std::cos(x); }); }},
        {VectorMathMode::Faceforward,
         [](V a, V b, V c, double) { return glm::dot(c, b) < 0.0 ? a : -a; }},
        {VectorMathMode::MultiplyAdd, [](V a, V b, V c, double) { return a * b + c; }},
        {VectorMathMode::Sign, [](V a, V, V, double) { return glm::sign(a); }},
        {VectorMathMode::Power,
         [](V a, V b, V, double) {
             return V(a.x < 0.0 ? 0.0 : std::pow(a.x, b.x),
                      a.y < 0.0 ? 0.0 : std::pow(a.y, b.y),
                      a.z < 0.0 ? 0.0 : std::pow(a.z, b.z));
         }},
    };
    // NOLINTEND(performance-unnecessary-value-param)
    for (const VectorCase& vector : cases) {
        const OpCase test{
            NodeOpCode::VectorMath, static_cast<std::uint16_t>(vector.mode), {3, 3, 3, 1}, 3, {}};
        check_op(test, random_lanes(500, 10, -3.0f, 3.0f), 3e-5, [&](const std::vector<float>& v) {
            const auto at = [&](std::size_t k) { return static_cast<double>(v[k]); };
            return vector.formula(
                {at(0), at(1), at(2)}, {at(3), at(4), at(5)}, {at(6), at(7), at(8)}, at(9));
        });
    }
}

TEST(ProgramMath, VectorModesByExample) {
    const auto run = [](VectorMathMode mode, const std::vector<float>& v) {
        const OpCase test{
            NodeOpCode::VectorMath, static_cast<std::uint16_t>(mode), {3, 3, 3, 1}, 3, {}};
        return run_op(test, {v}, false)[0];
    };
    // Straight down into denser glass goes straight on; grazing out of it is reflected wholly.
    const Rgb down = run(VectorMathMode::Refract, {0, 0, -1, 0, 0, 2, 0, 0, 0, 1.0f / 1.5f});
    EXPECT_NEAR(down.z, -1.0f, 1e-6f);
    EXPECT_EQ(run(VectorMathMode::Refract, {0.9f, 0, -0.43589f, 0, 0, 1, 0, 0, 0, 1.5f}),
              Rgb(0.0f));
    EXPECT_EQ(run(VectorMathMode::Normalize, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), Rgb(0.0f));
    EXPECT_NEAR(run(VectorMathMode::Normalize, {1e-30f, 0, 0, 0, 0, 0, 0, 0, 0, 0}).x, 1.0f, 1e-6f);
    EXPECT_NEAR(run(VectorMathMode::Normalize, {0, 1e30f, 0, 0, 0, 0, 0, 0, 0, 0}).y, 1.0f, 1e-6f);
    EXPECT_EQ(run(VectorMathMode::Snap, {5.5f, -0.5f, 1, 2, 2, 0, 0, 0, 0, 0}), Rgb(4, -2, 0));
    EXPECT_EQ(run(VectorMathMode::Modulo, {5.5f, -5.5f, 1, 2, 2, 0, 0, 0, 0, 0}),
              Rgb(1.5f, -1.5f, 0));
    EXPECT_EQ(run(VectorMathMode::Wrap, {5.5f, 0.5f, 2, 3, 3, 3, 1, 1, 1, 0}), Rgb(1.5f, 2.5f, 2));
    EXPECT_EQ(run(VectorMathMode::Divide, {1, 2, 3, 0, 2, 0, 0, 0, 0, 0}), Rgb(0, 1, 0));
    EXPECT_EQ(run(VectorMathMode::Project, {1, 2, 3, 0, 0, 0, 0, 0, 0, 0}), Rgb(0.0f));
}

// Rotation by Euler angles, axis by axis.
[[nodiscard]] glm::dvec3 rotate_xyz(const glm::dvec3& v, const glm::dvec3& angle) {
    const auto c = [&](int k) { return std::cos(angle[k]); };
    const auto s = [&](int k) { return std::sin(angle[k]); };
    const glm::dvec3 x(v.x, c(0) * v.y - s(0) * v.z, s(0) * v.y + c(0) * v.z);
    const glm::dvec3 y(c(1) * x.x + s(1) * x.z, x.y, -s(1) * x.x + c(1) * x.z);
    return {c(2) * y.x - s(2) * y.y, s(2) * y.x + c(2) * y.y, y.z};
}

TEST(ProgramMath, MappingTurnsScalesAndMoves) {
    const auto parts = [](const std::vector<float>& v, std::size_t k) {
        return glm::dvec3(static_cast<double>(v[3 * k]),
                          static_cast<double>(v[3 * k + 1]),
                          static_cast<double>(v[3 * k + 2]));
    };
    const auto run = [&](MappingMode mode, const Reference& reference) {
        check_op({NodeOpCode::Mapping, static_cast<std::uint16_t>(mode), {3, 3, 3, 3}, 3, {}},
                 random_lanes(500, 12, 0.3f, 2.0f),
                 2e-5,
                 reference);
    };
    run(MappingMode::Point, [&](const std::vector<float>& v) {
        return rotate_xyz(parts(v, 0) * parts(v, 3), parts(v, 2)) + parts(v, 1);
    });
    run(MappingMode::Vector, [&](const std::vector<float>& v) {
        return rotate_xyz(parts(v, 0) * parts(v, 3), parts(v, 2));
    });
    run(MappingMode::Normal, [&](const std::vector<float>& v) {
        return glm::normalize(rotate_xyz(parts(v, 0) / parts(v, 3), parts(v, 2)));
    });
    // Texture undoes Point.
    const Lanes lanes = random_lanes(200, 12, 0.3f, 2.0f);
    const std::vector<Rgb> points =
        run_op({NodeOpCode::Mapping, 0, {3, 3, 3, 3}, 3, {}}, lanes, false);
    Lanes back = lanes;
    for (std::size_t i = 0; i < lanes.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            back[i][static_cast<std::size_t>(k)] = points[i][k];
        }
    }
    const std::vector<Rgb> undone = run_op({NodeOpCode::Mapping,
                                            static_cast<std::uint16_t>(MappingMode::Texture),
                                            {3, 3, 3, 3},
                                            3,
                                            {}},
                                           back,
                                           false);
    for (std::size_t i = 0; i < lanes.size(); ++i) {
        EXPECT_NEAR(undone[i].x, lanes[i][0], 2e-5f);
        EXPECT_NEAR(undone[i].y, lanes[i][1], 2e-5f);
        EXPECT_NEAR(undone[i].z, lanes[i][2], 2e-5f);
    }
}

TEST(ProgramMath, MapRangeInEveryShape) {
    const auto run = [](int mode, const std::vector<float>& v) {
        return run_op({NodeOpCode::MapRange,
                       static_cast<std::uint16_t>(mode),
                       {1, 1, 1, 1, 1, 1},
                       1,
                       {}},
                      {v},
                      false)[0]
            .x;
    };
    const int clamp = kClampBit;
    EXPECT_FLOAT_EQ(run(0, {0.25f, 0, 1, 10, 20, 4}), 12.5f);
    EXPECT_FLOAT_EQ(run(0, {2.0f, 0, 1, 10, 20, 4}), 30.0f);
    EXPECT_FLOAT_EQ(run(0 | clamp, {2.0f, 0, 1, 10, 20, 4}), 20.0f);
    EXPECT_FLOAT_EQ(run(0 | clamp, {2.0f, 0, 1, 20, 10, 4}), 10.0f);
    EXPECT_FLOAT_EQ(run(0, {0.5f, 1, 1, 10, 20, 4}), 0.0f);
    EXPECT_FLOAT_EQ(run(1, {0.5f, 0, 1, 0, 1, 4}), 0.5f);  // floor(0.5 * 5) / 4
    EXPECT_FLOAT_EQ(run(1, {0.79f, 0, 1, 0, 1, 4}), 0.75f);
    EXPECT_FLOAT_EQ(run(2, {0.25f, 0, 1, 0, 1, 4}), 0.15625f);
    EXPECT_FLOAT_EQ(run(2, {0.25f, 1, 0, 0, 1, 4}), 0.84375f);
    EXPECT_FLOAT_EQ(run(2, {5.0f, 0, 1, 0, 1, 4}), 1.0f);
    EXPECT_FLOAT_EQ(run(3, {0.5f, 0, 1, 0, 1, 4}), 0.5f);
    EXPECT_FLOAT_EQ(run(3, {0.25f, 0, 1, 0, 1, 4}), 0.103515625f);
    const std::vector<Rgb> vector =
        run_op({NodeOpCode::VectorMapRange, 0, {3, 3, 3, 3, 3, 3}, 3, {}},
               {{0.5f, 1, 2, 0, 0, 0, 1, 2, 4, 5, 5, 5, 6, 7, 9, 0, 0, 0}},
               false);
    EXPECT_EQ(vector[0], Rgb(5.5f, 6, 7));
}

TEST(ProgramMath, ClampMixAndConversions) {
    const OpCase range{NodeOpCode::Clamp, 1, {1, 1, 1}, 1, {}};
    EXPECT_EQ(run_op(range, {{5, 3, 1}}, false)[0].x, 3.0f);
    const OpCase min_max{NodeOpCode::Clamp, 0, {1, 1, 1}, 1, {}};
    EXPECT_EQ(run_op(min_max, {{5, 3, 1}}, false)[0].x, 1.0f);
    EXPECT_EQ(run_op(min_max, {{2, 1, 3}}, false)[0].x, 2.0f);
    const OpCase mix{NodeOpCode::MixFloat, 0, {1, 1, 1}, 1, {}};
    EXPECT_EQ(run_op(mix, {{2, 1, 3}}, false)[0].x, 5.0f);
    const OpCase limited{NodeOpCode::MixFloat, kClampFactorBit, {1, 1, 1}, 1, {}};
    EXPECT_EQ(run_op(limited, {{2, 1, 3}}, false)[0].x, 3.0f);
    check_op({NodeOpCode::Luminance, 0, {3}, 1, {}},
             random_lanes(300, 3, 0.0f, 2.0f),
             1e-6,
             [](const std::vector<float>& v) {
                 return glm::dvec3(0.2126 * static_cast<double>(v[0]) +
                                   0.7152 * static_cast<double>(v[1]) +
                                   0.0722 * static_cast<double>(v[2]));
             });
    check_op({NodeOpCode::VectorAverage, 0, {3}, 1, {}},
             random_lanes(300, 3, -2.0f, 2.0f),
             1e-6,
             [](const std::vector<float>& v) {
                 return glm::dvec3((static_cast<double>(v[0]) + static_cast<double>(v[1]) +
                                    static_cast<double>(v[2])) /
                                   3.0);
             });
    check_op({NodeOpCode::Combine, 0, {1, 1, 1}, 3, {}},
             random_lanes(300, 3, -2.0f, 2.0f),
             0.0,
             [](const std::vector<float>& v) { return glm::dvec3(v[0], v[1], v[2]); });
    check_op({NodeOpCode::Copy, 3, {3}, 3, {}},
             random_lanes(300, 3, -2.0f, 2.0f),
             0.0,
             [](const std::vector<float>& v) { return glm::dvec3(v[0], v[1], v[2]); });
}

TEST(ProgramMath, VectorRotateAgreesWithItself) {
    const auto mode = [](VectorRotateMode m, bool invert) {
        return static_cast<std::uint16_t>(static_cast<int>(m) | (invert ? kInvertBit : 0));
    };
    for (const auto& v : random_lanes(20, 13, -2.0f, 2.0f)) {
        // About z by the axis, by name and by Euler angles.
        std::vector<float> w = v;
        w[6] = w[7] = 0.0f;
        w[8] = 1.5f;
        w[10] = w[11] = 0.0f;
        w[12] = w[9];
        for (const bool invert : {false, true}) {
            const auto run = [&](VectorRotateMode m) {
                return run_op({NodeOpCode::VectorRotate, mode(m, invert), {3, 3, 3, 1, 3}, 3, {}},
                              {w},
                              false)[0];
            };
            const Rgb by_axis = run(VectorRotateMode::AxisAngle);
            const glm::dvec3 center(w[3], w[4], w[5]);
            const double angle = static_cast<double>(invert ? -w[9] : w[9]);
            const glm::dvec3 want =
                rotate_xyz(glm::dvec3(w[0], w[1], w[2]) - center, {0.0, 0.0, angle}) + center;
            for (const Rgb& got :
                 {by_axis, run(VectorRotateMode::ZAxis), run(VectorRotateMode::EulerXyz)}) {
                EXPECT_NEAR(static_cast<double>(got.x), want.x, 1e-5);
                EXPECT_NEAR(static_cast<double>(got.y), want.y, 1e-5);
                EXPECT_NEAR(static_cast<double>(got.z), want.z, 1e-5);
            }
        }
    }
}

}  // namespace
}  // namespace pharos
