// Colour operations against their definitions, by component.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "program_support.h"

namespace pharos {
namespace {

using test::OpCase;
using test::random_lanes;
using test::run_op;

[[nodiscard]] double at(const std::vector<float>& v, std::size_t k) {
    return static_cast<double>(v[k]);
}

[[nodiscard]] std::vector<Rgb> blend(BlendMode mode,
                                     const std::vector<std::vector<float>>& lanes,
                                     int bits = 0) {
    return run_op({NodeOpCode::MixColor,
                   static_cast<std::uint16_t>(static_cast<int>(mode) | bits),
                   {1, 3, 3},
                   3,
                   {}},
                  lanes,
                  false);
}

struct BlendCase {
    BlendMode mode;
    std::function<double(double a, double b)> whole;  // at factor 1
};

// Modes that mix linearly towards their result.
TEST(ProgramColor, LinearBlendModes) {
    const std::vector<BlendCase> cases = {
        {BlendMode::Mix, [](double, double b) { return b; }},
        {BlendMode::Add, [](double a, double b) { return a + b; }},
        {BlendMode::Multiply, [](double a, double b) { return a * b; }},
        {BlendMode::Subtract, [](double a, double b) { return a - b; }},
        {BlendMode::Screen, [](double a, double b) { return 1.0 - (1.0 - a) * (1.0 - b); }},
        {BlendMode::Divide, [](double a, double b) { return a / b; }},
        {BlendMode::Difference, [](double a, double b) { return std::abs(a - b); }},
        {BlendMode::Darken, [](double a, double b) { return std::min(a, b); }},
        {BlendMode::Lighten, [](double a, double b) { return std::max(a, b); }},
        {BlendMode::Overlay,
         [](double a, double b) {
             return a < 0.5 ? 2.0 * a * b : 1.0 - 2.0 * (1.0 - a) * (1.0 - b);
         }},
        {BlendMode::SoftLight,
         [](double a, double b) { return (1.0 - a) * a * b + a * (1.0 - (1.0 - a) * (1.0 - b)); }},
        {BlendMode::LinearLight, [](double a, double b) { return a + 2.0 * b - 1.0; }},
    };
    const auto lanes = random_lanes(500, 7, 0.05f, 1.0f);
    for (const BlendCase& test : cases) {
        const std::vector<Rgb> got = blend(test.mode, lanes);
        for (std::size_t i = 0; i < lanes.size(); ++i) {
            const double t = at(lanes[i], 0);
            for (std::size_t c = 0; c < 3; ++c) {
                const double a = at(lanes[i], 1 + c);
                const double want = (1.0 - t) * a + t * test.whole(a, at(lanes[i], 4 + c));
                EXPECT_NEAR(static_cast<double>(got[i][static_cast<int>(c)]), want, 1e-5)
                    << static_cast<int>(test.mode);
            }
        }
    }
}

TEST(ProgramColor, OtherBlendModesByExample) {
    const auto one = [](BlendMode mode, const std::vector<float>& v) {
        return blend(mode, {v})[0];
    };
    const auto near = [](const Rgb& a, const Rgb& b) {
        return glm::all(glm::lessThan(glm::abs(a - b), Vec3(1e-5f)));
    };
    EXPECT_TRUE(near(one(BlendMode::Dodge, {1, 0.2f, 0.9f, 0, 0.5f, 0.5f, 0.5f}), Rgb(0.4f, 1, 0)));
    EXPECT_TRUE(near(one(BlendMode::Dodge, {1, 0.2f, 0.2f, 0.2f, 1, 2, 0}), Rgb(1, 1, 0.2f)));
    EXPECT_TRUE(near(one(BlendMode::Burn, {1, 0.6f, 0.1f, 1, 0.5f, 0.5f, 0}), Rgb(0.2f, 0, 0)));
    EXPECT_TRUE(near(one(BlendMode::Exclusion, {1, 1, 0.5f, 0, 1, 0.5f, 1}), Rgb(0, 0.5f, 1)));
    EXPECT_TRUE(
        near(one(BlendMode::Divide, {1, 0.5f, 0.5f, 0.5f, 0, 0.25f, 1}), Rgb(0.5f, 2, 0.5f)));
    // Red takes the hue of green, then its greyness, brightness, and all but the brightness.
    EXPECT_TRUE(near(one(BlendMode::Hue, {1, 0.8f, 0, 0, 0, 0.3f, 0}), Rgb(0, 0.8f, 0)));
    EXPECT_TRUE(near(one(BlendMode::Hue, {1, 0.8f, 0, 0, 0.3f, 0.3f, 0.3f}), Rgb(0.8f, 0, 0)));
    EXPECT_TRUE(near(one(BlendMode::Saturation, {1, 0.8f, 0, 0, 0.5f, 0.5f, 0.25f}),
                     Rgb(0.8f, 0.4f, 0.4f)));
    EXPECT_TRUE(near(one(BlendMode::Value, {1, 0.8f, 0, 0, 0, 0.3f, 0}), Rgb(0.3f, 0, 0)));
    EXPECT_TRUE(
        near(one(BlendMode::Color, {1, 0.8f, 0, 0, 0.25f, 0.5f, 0.25f}), Rgb(0.4f, 0.8f, 0.4f)));
    // Clamp bits.
    EXPECT_TRUE(
        near(blend(BlendMode::Mix, {{2, 0, 0, 0, 1, 1, 1}}, kClampFactorBit)[0], Rgb(1.0f)));
    EXPECT_TRUE(near(blend(BlendMode::Add, {{1, 1, 1, 0, 1, 0, 0}}, kClampBit)[0], Rgb(1, 1, 0)));
}

TEST(ProgramColor, ColorModelsAreUndoneByTheirInverse) {
    const auto lanes = random_lanes(500, 3, 0.0f, 1.0f);
    for (const ColorModel model : {ColorModel::RedGreenBlue, ColorModel::Hsv, ColorModel::Hsl}) {
        const auto mode = static_cast<std::uint16_t>(model);
        const std::vector<Rgb> apart =
            run_op({NodeOpCode::SeparateColor, mode, {3}, 3, {}}, lanes, false);
        std::vector<std::vector<float>> parts;
        for (const Rgb& c : apart) {
            parts.push_back({c.x, c.y, c.z});
            EXPECT_TRUE(c.x >= 0.0f && c.x <= 1.0f && c.y >= 0.0f && c.y <= 1.000001f);
        }
        const std::vector<Rgb> whole =
            run_op({NodeOpCode::CombineColor, mode, {1, 1, 1}, 3, {}}, parts, false);
        for (std::size_t i = 0; i < lanes.size(); ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                EXPECT_NEAR(whole[i][static_cast<int>(c)], lanes[i][c], 2e-6f);
            }
        }
    }
    const auto hsv = [](const std::vector<float>& rgb) {
        return run_op({NodeOpCode::SeparateColor, 1, {3}, 3, {}}, {rgb}, false)[0];
    };
    EXPECT_EQ(hsv({0.5f, 0, 0}), Rgb(0, 1, 0.5f));
    EXPECT_NEAR(hsv({0, 0, 0.5f}).x, 2.0f / 3.0f, 1e-6f);
    EXPECT_EQ(hsv({0.5f, 0.5f, 0.5f}), Rgb(0, 0, 0.5f));
    EXPECT_EQ(hsv({0, 0, 0}), Rgb(0.0f));
}

TEST(ProgramColor, HueSaturationValue) {
    const auto run = [](const std::vector<float>& v) {
        // The colour comes fifth: give it first lane's constants.
        return run_op({NodeOpCode::HueSaturation, 0, {1, 1, 1, 1, 3}, 3, {}}, {v}, false)[0];
    };
    const Rgb same = run({0.5f, 1, 1, 1, 0.2f, 0.5f, 0.7f});
    EXPECT_NEAR(same.x, 0.2f, 1e-6f);
    EXPECT_NEAR(same.y, 0.5f, 1e-6f);
    EXPECT_NEAR(same.z, 0.7f, 1e-6f);
    const Rgb turned = run({0.5f + 1.0f / 3.0f, 1, 1, 1, 0.8f, 0, 0});  // red to green
    EXPECT_NEAR(turned.x, 0.0f, 2e-6f);
    EXPECT_NEAR(turned.y, 0.8f, 2e-6f);
    const Rgb grey = run({0.5f, 0, 2, 0.5f, 0.4f, 0.2f, 0});
    EXPECT_NEAR(grey.x, 0.6f, 1e-6f);  // half of 0.4 and half of grey 0.8
    EXPECT_NEAR(grey.y, 0.5f, 1e-6f);
    EXPECT_NEAR(grey.z, 0.4f, 1e-6f);
}

TEST(ProgramColor, Adjustments) {
    const auto invert = run_op({NodeOpCode::Invert, 0, {1, 3}, 3, {}}, {{0.5f, 0.2f, 1, 2}}, false);
    EXPECT_NEAR(invert[0].x, 0.5f, 1e-6f);
    EXPECT_NEAR(invert[0].z, 0.5f, 1e-6f);
    const OpCase gamma{NodeOpCode::Gamma, 0, {3, 1}, 3, {}};
    EXPECT_EQ(run_op(gamma, {{0.5f, -0.5f, 2, 2}}, false)[0], Rgb(0.25f, -0.5f, 4));
    EXPECT_EQ(run_op(gamma, {{0.5f, -0.5f, 2, 0}}, false)[0], Rgb(1.0f));
    const OpCase contrast{NodeOpCode::BrightContrast, 0, {3, 1, 1}, 3, {}};
    const Rgb c = run_op(contrast, {{0.5f, 0, 1, 0.1f, 0.4f}}, false)[0];
    EXPECT_NEAR(c.x, 0.5f * 1.4f + 0.1f - 0.2f, 1e-6f);
    EXPECT_EQ(c.y, 0.0f);  // -0.1 is cut off
    EXPECT_NEAR(c.z, 1.3f, 1e-6f);
}

TEST(ProgramColor, RampsInterpolateOrStep) {
    // Three rows: red, green, blue with growing alpha.
    const std::vector<std::vector<float>> tables = {{1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 1, 1}};
    const auto run = [&](int mode, float x) {
        return run_op(
            {NodeOpCode::Ramp, static_cast<std::uint16_t>(mode), {1}, 4, tables}, {{x}}, false)[0];
    };
    EXPECT_EQ(run(0, 0.0f), Rgb(1, 0, 0));
    EXPECT_EQ(run(0, 0.25f), Rgb(0.5f, 0.5f, 0));
    EXPECT_EQ(run(0, 0.5f), Rgb(0, 1, 0));
    EXPECT_EQ(run(0, 1.0f), Rgb(0, 0, 1));
    EXPECT_EQ(run(0, 7.0f), Rgb(0, 0, 1));
    EXPECT_EQ(run(0, -7.0f), Rgb(1, 0, 0));
    EXPECT_EQ(run(0, NAN), Rgb(1, 0, 0));
    EXPECT_EQ(run(kStepBit, 0.49f), Rgb(1, 0, 0));
    EXPECT_EQ(run(kStepBit, 0.51f), Rgb(0, 1, 0));
}

TEST(ProgramColor, CurvesLookUpEachChannel) {
    // r: identity, g: doubled, b: inverted, over [-1, 1].
    std::vector<float> table;
    for (int i = 0; i <= 16; ++i) {
        const float x = -1.0f + static_cast<float>(i) / 8.0f;
        table.insert(table.end(), {x, 2.0f * x, -x, 0.0f});
    }
    const auto run = [&](int mode, const std::vector<float>& v) {
        return run_op(
            {NodeOpCode::Curves, static_cast<std::uint16_t>(mode), {1, 3, 1, 1}, 3, {table}},
            {v},
            false)[0];
    };
    const Rgb inside = run(0, {1, 0.3f, 0.3f, 0.3f, -1, 1});
    EXPECT_NEAR(inside.x, 0.3f, 1e-6f);
    EXPECT_NEAR(inside.y, 0.6f, 1e-6f);
    EXPECT_NEAR(inside.z, -0.3f, 1e-6f);
    EXPECT_NEAR(run(0, {0.5f, 0.3f, 0.3f, 0.3f, -1, 1}).y, 0.45f, 1e-6f);
    EXPECT_NEAR(run(0, {1, 3, 3, 3, -1, 1}).y, 2.0f, 1e-6f);
    EXPECT_NEAR(run(kExtrapolateBit, {1, 3, 3, 3, -1, 1}).y, 6.0f, 1e-5f);
    EXPECT_NEAR(run(kExtrapolateBit, {1, -3, 3, 3, -1, 1}).x, -3.0f, 1e-5f);
}

TEST(ProgramColor, BlackBodiesGoFromRedToBlue) {
    const auto run = [](float kelvin) {
        return run_op({NodeOpCode::Blackbody, 0, {1}, 3, {}}, {{kelvin}}, false)[0];
    };
    for (float kelvin = 820.0f; kelvin < 12100.0f; kelvin += 20.0f) {
        const Rgb c = run(kelvin);
        const Rgb hotter = run(kelvin + 20.0f);
        // Cycles' fit has small steps where its pieces meet.
        EXPECT_LE(hotter.x, c.x + 1e-2f) << kelvin;
        EXPECT_GE(hotter.z, c.z - 1e-3f) << kelvin;
        EXPECT_NEAR(hotter.y, c.y, 3e-2f) << kelvin;
        // Cut-off negative parts raise the luminance of the coldest ones.
        EXPECT_NEAR(
            0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z, 1.0f, kelvin < 2000 ? 0.17f : 2e-3f)
            << kelvin;
    }
    const Rgb day = run(6504.0f);  // a black body near the white of Rec.709, a little greenless
    EXPECT_NEAR(day.x, 1.0f, 0.06f);
    EXPECT_NEAR(day.y, 1.0f, 0.03f);
    EXPECT_NEAR(day.z, 1.0f, 0.06f);
    EXPECT_EQ(run(-5.0f), run(799.0f));
    EXPECT_EQ(run(1e9f), run(12000.0f));
    EXPECT_EQ(run(std::numeric_limits<float>::quiet_NaN()), run(0.0f));
}

}  // namespace
}  // namespace pharos
