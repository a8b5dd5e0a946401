// Colour operations: blending, ramps and curves, HSV and HSL, adjustments.
#include <algorithm>
#include <array>

#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

[[nodiscard]] Vec3 rgb_to_hsv(const Vec3& c) {
    const float value = max_component(c);
    const float delta = value - std::min(c.x, std::min(c.y, c.z));
    const float saturation = value != 0.0f ? delta / value : 0.0f;
    if (saturation == 0.0f) {
        return Vec3(0.0f, 0.0f, value);
    }
    // The sextant of the largest component, and how far the others pull to a neighbour.
    float hue = 0.0f;
    if (c.x == value) {
        hue = (c.y - c.z) / delta;
    } else if (c.y == value) {
        hue = 2.0f + (c.z - c.x) / delta;
    } else {
        hue = 4.0f + (c.x - c.y) / delta;
    }
    hue *= 1.0f / 6.0f;
    return Vec3(hue < 0.0f ? hue + 1.0f : hue, saturation, value);
}

[[nodiscard]] Vec3 hsv_to_rgb(const Vec3& hsv) {
    const float v = hsv.z;
    if (hsv.y == 0.0f) {
        return Vec3(v);
    }
    const float h = hsv.x == 1.0f ? 0.0f : hsv.x * 6.0f;
    const float sextant = std::floor(h);
    const float f = h - sextant;
    const float p = v * (1.0f - hsv.y);
    const float q = v * (1.0f - hsv.y * f);
    const float t = v * (1.0f - hsv.y * (1.0f - f));
    if (sextant == 0.0f) {
        return Vec3(v, t, p);
    }
    if (sextant == 1.0f) {
        return Vec3(q, v, p);
    }
    if (sextant == 2.0f) {
        return Vec3(p, v, t);
    }
    if (sextant == 3.0f) {
        return Vec3(p, q, v);
    }
    return sextant == 4.0f ? Vec3(t, p, v) : Vec3(v, p, q);
}

[[nodiscard]] Vec3 rgb_to_hsl(const Vec3& c) {
    const float largest = max_component(c);
    const float smallest = std::min(c.x, std::min(c.y, c.z));
    const float delta = largest - smallest;
    const float lightness = std::min(1.0f, 0.5f * (largest + smallest));
    if (delta == 0.0f) {
        return Vec3(0.0f, 0.0f, lightness);
    }
    const float saturation =
        lightness > 0.5f ? delta / (2.0f - largest - smallest) : delta / (largest + smallest);
    return Vec3(rgb_to_hsv(c).x, saturation, lightness);
}

[[nodiscard]] Vec3 hsl_to_rgb(const Vec3& hsl) {
    const float h = hsl.x * 6.0f;
    const Vec3 hue(saturate(std::abs(h - 3.0f) - 1.0f),
                   saturate(2.0f - std::abs(h - 2.0f)),
                   saturate(2.0f - std::abs(h - 4.0f)));
    const float chroma = (1.0f - std::abs(2.0f * hsl.z - 1.0f)) * hsl.y;
    return (hue - 0.5f) * chroma + Vec3(hsl.z);
}

[[nodiscard]] Vec3 saturate(const Vec3& v) {
    return Vec3(pharos::saturate(v.x), pharos::saturate(v.y), pharos::saturate(v.z));
}

[[nodiscard]] float blend_divide(float a, float b, float t) {
    return b != 0.0f ? (1.0f - t) * a + t * a / b : a;
}

[[nodiscard]] float blend_overlay(float a, float b, float t) {
    return a < 0.5f ? a * ((1.0f - t) + 2.0f * t * b)
                    : 1.0f - ((1.0f - t) + 2.0f * t * (1.0f - b)) * (1.0f - a);
}

[[nodiscard]] float blend_dodge(float a, float b, float t) {
    if (a == 0.0f) {
        return a;
    }
    const float rest = 1.0f - t * b;
    return rest <= 0.0f ? 1.0f : std::min(a / rest, 1.0f);
}

[[nodiscard]] float blend_burn(float a, float b, float t) {
    const float rest = (1.0f - t) + t * b;
    return rest <= 0.0f ? 0.0f : std::clamp(1.0f - (1.0f - a) / rest, 0.0f, 1.0f);
}

template <class Function>
[[nodiscard]] Vec3 each(const Vec3& a, const Vec3& b, float t, const Function& function) {
    return Vec3(function(a.x, b.x, t), function(a.y, b.y, t), function(a.z, b.z, t));
}

// The modes that take parts of a colour from another; a grey one has no hue to give or take.
[[nodiscard]] Vec3 blend_hsv(BlendMode mode, const Vec3& a, const Vec3& b, float t) {
    Vec3 hsv = rgb_to_hsv(a);
    const Vec3 other = rgb_to_hsv(b);
    if (mode == BlendMode::Saturation) {
        if (hsv.y == 0.0f) {
            return a;
        }
        hsv.y = (1.0f - t) * hsv.y + t * other.y;
        return hsv_to_rgb(hsv);
    }
    if (mode == BlendMode::Value) {
        hsv.z = (1.0f - t) * hsv.z + t * other.z;
        return hsv_to_rgb(hsv);
    }
    if (other.y == 0.0f) {
        return a;
    }
    hsv.x = other.x;
    hsv.y = mode == BlendMode::Color ? other.y : hsv.y;
    return lerp(a, hsv_to_rgb(hsv), t);
}

[[nodiscard]] Vec3 blend(BlendMode mode, const Vec3& a, const Vec3& b, float t) {
    const Vec3 one(1.0f);
    switch (mode) {
        case BlendMode::Mix:
            return a * (1.0f - t) + b * t;
        case BlendMode::Add:
            return a + b * t;
        case BlendMode::Multiply:
            return lerp(a, a * b, t);
        case BlendMode::Subtract:
            return a - b * t;
        case BlendMode::Screen:
            return one - (Vec3(1.0f - t) + (one - b) * t) * (one - a);
        case BlendMode::Divide:
            return each(a, b, t, blend_divide);
        case BlendMode::Difference:
            return lerp(a, glm::abs(a - b), t);
        case BlendMode::Darken:
            return lerp(a, glm::min(a, b), t);
        case BlendMode::Lighten:
            return lerp(a, glm::max(a, b), t);
        case BlendMode::Overlay:
            return each(a, b, t, blend_overlay);
        case BlendMode::Dodge:
            return each(a, b, t, blend_dodge);
        case BlendMode::Burn:
            return each(a, b, t, blend_burn);
        case BlendMode::Hue:
        case BlendMode::Saturation:
        case BlendMode::Value:
        case BlendMode::Color:
            return blend_hsv(mode, a, b, t);
        case BlendMode::SoftLight: {
            const Vec3 screen = one - (one - b) * (one - a);
            return a * (1.0f - t) + ((one - a) * b * a + a * screen) * t;
        }
        case BlendMode::LinearLight:
            return a + (b * 2.0f - one) * t;
        case BlendMode::Exclusion:
            return glm::max(lerp(a, a + b - a * b * 2.0f, t), Vec3(0.0f));
    }
    return a;
}

// Rows of RGBA read at a fraction of the table.
class TableLookup {
  public:
    TableLookup(const std::vector<float>& table, bool step, bool extrapolate)
        : table_(table),
          last_(static_cast<int>(table.size() / 4) - 1),
          step_(step),
          extrapolate_(extrapolate) {}

    [[nodiscard]] float at(float x, int column) const {
        const float size = static_cast<float>(last_);
        if (extrapolate_ && x < 0.0f) {
            return row(0, column) + (row(0, column) - row(1, column)) * (-x * size);
        }
        if (extrapolate_ && x > 1.0f) {
            const float slope = row(last_, column) - row(last_ - 1, column);
            return row(last_, column) + slope * ((x - 1.0f) * size);
        }
        const float position = (x > 0.0f ? std::min(x, 1.0f) : 0.0f) * size;  // NaN: the first
        const int first = static_cast<int>(position);
        const float t = position - static_cast<float>(first);
        if (step_ || t == 0.0f) {
            return row(first, column);
        }
        return (1.0f - t) * row(first, column) + t * row(first + 1, column);
    }

  private:
    [[nodiscard]] float row(int index, int column) const {
        return table_[static_cast<std::size_t>(4 * index + column)];
    }

    const std::vector<float>& table_;
    int last_;
    bool step_;
    bool extrapolate_;
};

// Cycles fits Rec.709 of black bodies piece by piece: red and green as a/T + b T + c, blue as a
// cubic. These numbers are least squares through pictures of its node, the same in 3.4.1 and 4.5;
// the worst residual is 5e-7. Where a colour is below zero it shows as zero, and so it stands here.
struct BlackbodyPiece {
    float from;  // kelvin
    std::array<double, 3> red;
    std::array<double, 3> green;
    std::array<double, 4> blue;  // the highest power first
};

constexpr std::array<BlackbodyPiece, 7> kBlackbodyPieces = {{
    {800.0f,
     {1619.1889, -0.00205011168, 5.02996239},
     {-755.994154, 0.000316730184, 0.478305941},
     {}},
    {965.0f,
     {2488.45559, -0.00111330823, 3.22621353},
     {-755.994154, 0.000316730184, 0.478305941},
     {}},
    {1167.0f,
     {3341.43462, -0.000486549709, 1.76486362},
     {-1023.6399, 0.000120223387, 0.936662525},
     {}},
    {1449.0f,
     {4094.61875, -0.000127446036, 0.725729916},
     {-1265.7135, 4.87327671e-06, 1.27054545},
     {}},
    {1902.0f,
     {4670.28081, 2.91258561e-05, 0.126703157},
     {-1425.29308, -4.01150047e-05, 1.43972758},
     {-1.97075767e-11, 1.75359363e-07, -0.00025054286, -0.0222783081}},
    {3315.0f,
     {4595.09173, 2.87495605e-05, 0.150345057},
     {-1175.54827, -2.1637808e-05, 1.30408027},
     {-1.61997883e-13, -1.64216025e-08, 0.00038621629, -0.738077443}},
    {6365.0f,
     {3787.17434, 9.35907586e-06, 0.399075908},
     {-500.799601, -4.59832051e-06, 1.09098769},
     {6.72649037e-13, -2.73078453e-08, 0.000424097936, -0.752334739}},
}};
constexpr float kHottest = 12000.0f;
constexpr Vec3 kColdestColor(5.41329432f, 0.0f, 0.0f);
constexpr Vec3 kHottestColor(0.8262955f, 0.99450803f, 1.56630766f);

[[nodiscard]] Vec3 blackbody_color(float kelvin) {
    if (!(kelvin >= kBlackbodyPieces.front().from)) {
        return kColdestColor;
    }
    if (kelvin >= kHottest) {
        return kHottestColor;
    }
    const BlackbodyPiece* piece = &kBlackbodyPieces.back();
    while (kelvin < piece->from) {
        --piece;
    }
    const auto t = static_cast<double>(kelvin);
    const auto curve = [t](const std::array<double, 3>& c) { return c[0] / t + c[1] * t + c[2]; };
    const auto& b = piece->blue;
    const glm::dvec3 color(
        curve(piece->red), curve(piece->green), ((b[0] * t + b[1]) * t + b[2]) * t + b[3]);
    return Vec3(glm::max(color, 0.0));
}

}  // namespace

void run_mix_color(const Evaluation& e, const NodeOp& op) {
    const Operand factor = e.operand(op, 0);
    const Operand a = e.operand(op, 1);
    const Operand b = e.operand(op, 2);
    const bool clamp_factor = (op.mode & kClampFactorBit) != 0;
    const bool clamp = (op.mode & kClampBit) != 0;
    const auto mode = static_cast<BlendMode>(
        op.mode & static_cast<std::uint16_t>(~(kClampBit | kClampFactorBit)));
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const float raw = factor.scalar(i);
        const Vec3 c =
            blend(mode, a.vector(i), b.vector(i), clamp_factor ? pharos::saturate(raw) : raw);
        e.store(op, i, clamp ? saturate(c) : c);
    }
}

void run_ramp(const Evaluation& e, const NodeOp& op) {
    const Operand x = e.operand(op, 0);
    const TableLookup table(
        e.material.program.tables[op.mode & 0x7fffu], (op.mode & kStepBit) != 0, false);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        for (int k = 0; k < 4; ++k) {
            e.output(op, static_cast<std::size_t>(k))[i] = table.at(x.scalar(i), k);
        }
    }
}

void run_curves(const Evaluation& e, const NodeOp& op) {
    const Operand factor = e.operand(op, 0);
    const Operand value = e.operand(op, 1);
    const Operand lower = e.operand(op, 2);
    const Operand upper = e.operand(op, 3);
    const TableLookup table(
        e.material.program.tables[op.mode & 0x7fffu], false, (op.mode & kExtrapolateBit) != 0);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const float start = lower.scalar(i);
        const float range = upper.scalar(i) - start;
        const float t = factor.scalar(i);
        const Vec3 v = value.vector(i);
        Vec3 result;
        for (int k = 0; k < 3; ++k) {
            const float x = range != 0.0f ? (v[k] - start) / range : 0.0f;
            result[k] = (1.0f - t) * v[k] + t * table.at(x, k);
        }
        e.store(op, i, result);
    }
}

void run_invert(const Evaluation& e, const NodeOp& op) {
    const Operand factor = e.operand(op, 0);
    const Operand color = e.operand(op, 1);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = color.vector(i);
        const float t = factor.scalar(i);
        e.store(op, i, (Vec3(1.0f) - c) * t + c * (1.0f - t));
    }
}

void run_gamma(const Evaluation& e, const NodeOp& op) {
    const Operand color = e.operand(op, 0);
    const Operand gamma = e.operand(op, 1);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        Vec3 c = color.vector(i);
        const float power = gamma.scalar(i);
        for (int k = 0; k < 3; ++k) {
            c[k] = power == 0.0f ? 1.0f : c[k] > 0.0f ? std::pow(c[k], power) : c[k];
        }
        e.store(op, i, c);
    }
}

void run_bright_contrast(const Evaluation& e, const NodeOp& op) {
    const Operand color = e.operand(op, 0);
    const Operand bright = e.operand(op, 1);
    const Operand contrast = e.operand(op, 2);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const float slope = 1.0f + contrast.scalar(i);
        const float offset = bright.scalar(i) - 0.5f * contrast.scalar(i);
        e.store(op, i, glm::max(color.vector(i) * slope + Vec3(offset), Vec3(0.0f)));
    }
}

void run_hue_saturation(const Evaluation& e, const NodeOp& op) {
    const Operand hue = e.operand(op, 0);
    const Operand saturation = e.operand(op, 1);
    const Operand value = e.operand(op, 2);
    const Operand factor = e.operand(op, 3);
    const Operand color = e.operand(op, 4);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = color.vector(i);
        Vec3 hsv = rgb_to_hsv(c);
        const float turned = hsv.x + hue.scalar(i) + 0.5f;  // a hue of 0.5 turns nothing
        hsv.x = turned - std::floor(turned);
        hsv.y = pharos::saturate(hsv.y * saturation.scalar(i));
        hsv.z *= value.scalar(i);
        const float t = factor.scalar(i);
        e.store(op, i, glm::max(hsv_to_rgb(hsv) * t + c * (1.0f - t), Vec3(0.0f)));
    }
}

void run_separate_color(const Evaluation& e, const NodeOp& op) {
    const Operand color = e.operand(op, 0);
    const auto model = static_cast<ColorModel>(op.mode);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = color.vector(i);
        e.store(op,
                i,
                model == ColorModel::RedGreenBlue ? c
                : model == ColorModel::Hsv        ? rgb_to_hsv(c)
                                                  : rgb_to_hsl(c));
    }
}

void run_combine_color(const Evaluation& e, const NodeOp& op) {
    const Operand a = e.operand(op, 0);
    const Operand b = e.operand(op, 1);
    const Operand c = e.operand(op, 2);
    const auto model = static_cast<ColorModel>(op.mode);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 parts(a.scalar(i), b.scalar(i), c.scalar(i));
        e.store(op,
                i,
                model == ColorModel::RedGreenBlue ? parts
                : model == ColorModel::Hsv        ? hsv_to_rgb(parts)
                                                  : hsl_to_rgb(parts));
    }
}

void run_blackbody(const Evaluation& e, const NodeOp& op) {
    const Operand temperature = e.operand(op, 0);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, blackbody_color(temperature.scalar(i)));
    }
}

}  // namespace pharos::detail
