// Arithmetic on scalars and vectors. What has no value (a division by zero, the logarithm of a
// negative number) is zero, as in Blender.
#include <algorithm>
#include <cfloat>

#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

[[nodiscard]] float safe_divide(float a, float b) {
    return b != 0.0f ? a / b : 0.0f;
}

[[nodiscard]] Vec3 safe_divide(const Vec3& a, const Vec3& b) {
    return Vec3(safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z));
}

[[nodiscard]] float safe_pow(float a, float b) {
    return a < 0.0f && b != std::trunc(b) ? 0.0f : std::pow(a, b);
}

[[nodiscard]] float safe_log(float a, float base) {
    return a > 0.0f && base > 0.0f ? safe_divide(std::log(a), std::log(base)) : 0.0f;
}

[[nodiscard]] float safe_modulo(float a, float b) {
    return b != 0.0f ? std::fmod(a, b) : 0.0f;
}

[[nodiscard]] float floored_modulo(float a, float b) {
    return b != 0.0f ? a - std::floor(a / b) * b : 0.0f;
}

[[nodiscard]] float fraction(float a) {
    return a - std::floor(a);
}

[[nodiscard]] float wrap(float a, float upper, float lower) {
    const float range = upper - lower;
    return range != 0.0f ? a - range * std::floor((a - lower) / range) : lower;
}

[[nodiscard]] float pingpong(float a, float b) {
    return b != 0.0f ? std::abs(fraction((a - b) / (b * 2.0f)) * b * 2.0f - b) : 0.0f;
}

[[nodiscard]] float sign(float a) {
    return a > 0.0f ? 1.0f : a < 0.0f ? -1.0f : 0.0f;
}

// Polynomial smooth minimum over the distance k.
[[nodiscard]] float smooth_minimum(float a, float b, float k) {
    if (k == 0.0f) {
        return std::fmin(a, b);
    }
    const float h = std::fmax(k - std::abs(a - b), 0.0f) / k;
    return std::fmin(a, b) - h * h * h * k * (1.0f / 6.0f);
}

[[nodiscard]] float compute_angle(MathMode mode, float a, float b) {
    switch (mode) {
        case MathMode::Sine:
            return std::sin(a);
        case MathMode::Cosine:
            return std::cos(a);
        case MathMode::Tangent:
            return std::tan(a);
        case MathMode::Arcsine:
            return std::asin(std::clamp(a, -1.0f, 1.0f));
        case MathMode::Arccosine:
            return std::acos(std::clamp(a, -1.0f, 1.0f));
        case MathMode::Arctangent:
            return std::atan(a);
        case MathMode::Arctan2:
            return std::atan2(a, b);
        case MathMode::Radians:
            return a * (kPi / 180.0f);
        case MathMode::Degrees:
            return a * (180.0f / kPi);
        case MathMode::Sinh:
            return std::sinh(a);
        case MathMode::Cosh:
            return std::cosh(a);
        case MathMode::Tanh:
            return std::tanh(a);
        default:
            return 0.0f;
    }
}

[[nodiscard]] float compute(MathMode mode, float a, float b, float c) {
    switch (mode) {
        case MathMode::Add:
            return a + b;
        case MathMode::Subtract:
            return a - b;
        case MathMode::Multiply:
            return a * b;
        case MathMode::Divide:
            return safe_divide(a, b);
        case MathMode::Power:
            return safe_pow(a, b);
        case MathMode::Logarithm:
            return safe_log(a, b);
        case MathMode::Minimum:
            return std::fmin(a, b);
        case MathMode::Maximum:
            return std::fmax(a, b);
        case MathMode::Round:
            return std::floor(a + 0.5f);
        case MathMode::LessThan:
            return a < b ? 1.0f : 0.0f;
        case MathMode::GreaterThan:
            return a > b ? 1.0f : 0.0f;
        case MathMode::Modulo:
            return safe_modulo(a, b);
        case MathMode::Absolute:
            return std::abs(a);
        case MathMode::Floor:
            return std::floor(a);
        case MathMode::Ceil:
            return std::ceil(a);
        case MathMode::Fract:
            return fraction(a);
        case MathMode::Sqrt:
            return safe_sqrt(a);
        case MathMode::InverseSqrt:
            return a > 0.0f ? 1.0f / std::sqrt(a) : 0.0f;
        case MathMode::Sign:
            return sign(a);
        case MathMode::Exponent:
            return std::exp(a);
        case MathMode::Trunc:
            return std::trunc(a);
        case MathMode::Snap:
            return std::floor(safe_divide(a, b)) * b;
        case MathMode::Wrap:
            return wrap(a, b, c);
        case MathMode::Compare:
            return a == b || std::abs(a - b) <= std::fmax(c, FLT_EPSILON) ? 1.0f : 0.0f;
        case MathMode::MultiplyAdd:
            return a * b + c;
        case MathMode::Pingpong:
            return pingpong(a, b);
        case MathMode::SmoothMin:
            return smooth_minimum(a, b, c);
        case MathMode::SmoothMax:
            return -smooth_minimum(-a, -b, c);
        case MathMode::FlooredModulo:
            return floored_modulo(a, b);
        default:
            return compute_angle(mode, a, b);
    }
}

template <class Function>
[[nodiscard]] Vec3 each(const Vec3& a, const Function& function) {
    return Vec3(function(a.x), function(a.y), function(a.z));
}

template <class Function>
[[nodiscard]] Vec3 each(const Vec3& a, const Vec3& b, const Function& function) {
    return Vec3(function(a.x, b.x), function(a.y, b.y), function(a.z, b.z));
}

// In double, so that neither tiny nor huge vectors lose their direction; zero stays zero.
[[nodiscard]] Vec3 normalize(const Vec3& v) {
    const glm::dvec3 exact(v);
    const double length = std::sqrt(glm::dot(exact, exact));
    return length > 0.0 ? Vec3(exact / length) : v;
}

[[nodiscard]] Vec3 project(const Vec3& a, const Vec3& b) {
    const float squared = length_squared(b);
    return squared != 0.0f ? b * (glm::dot(a, b) / squared) : Vec3(0.0f);
}

[[nodiscard]] Vec3 refract(const Vec3& a, const Vec3& n, float eta) {
    const float cosine = glm::dot(n, a);
    const float k = 1.0f - eta * eta * (1.0f - cosine * cosine);
    return k < 0.0f ? Vec3(0.0f) : a * eta - n * (eta * cosine + std::sqrt(k));
}

[[nodiscard]] Vec3 compute(
    VectorMathMode mode, const Vec3& a, const Vec3& b, const Vec3& c, float scale) {
    switch (mode) {
        case VectorMathMode::Add:
            return a + b;
        case VectorMathMode::Subtract:
            return a - b;
        case VectorMathMode::Multiply:
            return a * b;
        case VectorMathMode::Divide:
            return safe_divide(a, b);
        case VectorMathMode::CrossProduct:
            return glm::cross(a, b);
        case VectorMathMode::Project:
            return project(a, b);
        case VectorMathMode::Reflect: {
            const Vec3 n = normalize(b);
            return a - n * (2.0f * glm::dot(a, n));
        }
        case VectorMathMode::DotProduct:
            return Vec3(glm::dot(a, b));
        case VectorMathMode::Distance:
            return Vec3(glm::length(a - b));
        case VectorMathMode::Length:
            return Vec3(glm::length(a));
        case VectorMathMode::Scale:
            return a * scale;
        case VectorMathMode::Normalize:
            return normalize(a);
        case VectorMathMode::Snap:
            return glm::floor(safe_divide(a, b)) * b;
        case VectorMathMode::Floor:
            return glm::floor(a);
        case VectorMathMode::Ceil:
            return glm::ceil(a);
        case VectorMathMode::Modulo:
            return each(a, b, safe_modulo);
        case VectorMathMode::Fraction:
            return a - glm::floor(a);
        case VectorMathMode::Absolute:
            return glm::abs(a);
        case VectorMathMode::Minimum:
            return glm::min(a, b);
        case VectorMathMode::Maximum:
            return glm::max(a, b);
        case VectorMathMode::Wrap:
            return Vec3(wrap(a.x, b.x, c.x), wrap(a.y, b.y, c.y), wrap(a.z, b.z, c.z));
        case VectorMathMode::Sine:
            return each(a, [](float x) { return std::sin(x); });
        case VectorMathMode::Cosine:
            return each(a, [](float x) { return std::cos(x); });
        case VectorMathMode::Tangent:
            return each(a, [](float x) { return std::tan(x); });
        case VectorMathMode::Refract:
            return refract(a, normalize(b), scale);
        case VectorMathMode::Faceforward:
            return glm::dot(c, b) < 0.0f ? a : -a;
        case VectorMathMode::MultiplyAdd:
            return a * b + c;
        case VectorMathMode::Power:
            return each(a, b, safe_pow);
        case VectorMathMode::Sign:
            return each(a, sign);
    }
    return Vec3(0.0f);
}

// Rotation by Blender's XYZ Euler angles: about x first, then y, then z.
[[nodiscard]] Mat3 euler_matrix(const Vec3& angles) {
    const Vec3 s(std::sin(angles.x), std::sin(angles.y), std::sin(angles.z));
    const Vec3 c(std::cos(angles.x), std::cos(angles.y), std::cos(angles.z));
    return Mat3(Vec3(c.y * c.z, c.y * s.z, -s.y),
                Vec3(s.x * s.y * c.z - c.x * s.z, s.x * s.y * s.z + c.x * c.z, s.x * c.y),
                Vec3(c.x * s.y * c.z + s.x * s.z, c.x * s.y * s.z - s.x * c.z, c.x * c.y));
}

// Smooth steps of a fraction already in [0, 1].
[[nodiscard]] float ease(MapRangeMode mode, float t) {
    return mode == MapRangeMode::SmoothStep ? t * t * (3.0f - 2.0f * t)
                                            : t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
}

struct RangeMap {
    float from_min;
    float from_max;
    float to_min;
    float to_max;
    float steps;
    MapRangeMode mode;
    bool clamp;

    [[nodiscard]] float operator()(float x) const {
        float factor = safe_divide(x - from_min, from_max - from_min);
        if (mode == MapRangeMode::Stepped) {
            factor = steps > 0.0f ? std::floor(factor * (steps + 1.0f)) / steps : 0.0f;
        } else if (mode != MapRangeMode::Linear) {
            factor = ease(mode, saturate(factor));
        }
        return clamped(to_min + factor * (to_max - to_min));
    }

    [[nodiscard]] float clamped(float x) const {
        const float lower = std::fmin(to_min, to_max);
        return clamp ? std::fmin(std::fmax(x, lower), std::fmax(to_min, to_max)) : x;
    }
};

}  // namespace

void run_scalar_to_vector(const Evaluation& e, const NodeOp& op) {
    const Operand x = e.operand(op, 0);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, Vec3(x.scalar(i)));
    }
}

void run_luminance(const Evaluation& e, const NodeOp& op) {
    const Operand color = e.operand(op, 0);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = color.vector(i);
        out[i] = 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
    }
}

void run_vector_average(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 v = vector.vector(i);
        out[i] = (v.x + v.y + v.z) * (1.0f / 3.0f);
    }
}

void run_math(const Evaluation& e, const NodeOp& op) {
    const Operand a = e.operand(op, 0);
    const Operand b = e.operand(op, 1);
    const Operand c = e.operand(op, 2);
    const auto mode = static_cast<MathMode>(op.mode & static_cast<std::uint16_t>(~kClampBit));
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        out[i] = compute(mode, a.scalar(i), b.scalar(i), c.scalar(i));
    }
    if ((op.mode & kClampBit) != 0) {
        for (std::size_t i = 0; i < e.lanes; ++i) {
            out[i] = saturate(out[i]);
        }
    }
}

void run_vector_math(const Evaluation& e, const NodeOp& op) {
    const Operand a = e.operand(op, 0);
    const Operand b = e.operand(op, 1);
    const Operand c = e.operand(op, 2);
    const Operand scale = e.operand(op, 3);
    const auto mode = static_cast<VectorMathMode>(op.mode);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, compute(mode, a.vector(i), b.vector(i), c.vector(i), scale.scalar(i)));
    }
}

void run_mix_float(const Evaluation& e, const NodeOp& op) {
    const Operand factor = e.operand(op, 0);
    const Operand a = e.operand(op, 1);
    const Operand b = e.operand(op, 2);
    const bool clamp_factor = (op.mode & kClampFactorBit) != 0;
    const bool clamp = (op.mode & kClampBit) != 0;
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const float t = clamp_factor ? saturate(factor.scalar(i)) : factor.scalar(i);
        const float mixed = a.scalar(i) * (1.0f - t) + b.scalar(i) * t;
        out[i] = clamp ? saturate(mixed) : mixed;
    }
}

void run_mapping(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand location = e.operand(op, 1);
    const Operand rotation = e.operand(op, 2);
    const Operand scale = e.operand(op, 3);
    const auto mode = static_cast<MappingMode>(op.mode);
    Mat3 matrix = euler_matrix(rotation.vector(0));
    for (std::size_t i = 0; i < e.lanes; ++i) {
        if (!rotation.is_constant()) {
            matrix = euler_matrix(rotation.vector(i));
        }
        const Vec3 v = vector.vector(i);
        const Vec3 s = scale.vector(i);
        Vec3 result;
        switch (mode) {
            case MappingMode::Point:
                result = matrix * (v * s) + location.vector(i);
                break;
            case MappingMode::Texture:
                result = safe_divide(glm::transpose(matrix) * (v - location.vector(i)), s);
                break;
            case MappingMode::Vector:
                result = matrix * (v * s);
                break;
            case MappingMode::Normal:
                result = normalize(matrix * safe_divide(v, s));
                break;
        }
        e.store(op, i, result);
    }
}

void run_combine(const Evaluation& e, const NodeOp& op) {
    const Operand x = e.operand(op, 0);
    const Operand y = e.operand(op, 1);
    const Operand z = e.operand(op, 2);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, Vec3(x.scalar(i), y.scalar(i), z.scalar(i)));
    }
}

void run_map_range(const Evaluation& e, const NodeOp& op) {
    Operand in[6];
    for (std::uint32_t k = 0; k < 6; ++k) {
        in[k] = e.operand(op, k);
    }
    const auto mode = static_cast<MapRangeMode>(op.mode & 3);
    const bool clamp = (op.mode & kClampBit) != 0;
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const RangeMap map{in[1].scalar(i),
                           in[2].scalar(i),
                           in[3].scalar(i),
                           in[4].scalar(i),
                           in[5].scalar(i),
                           mode,
                           clamp};
        // An empty source range gives zero here, and the target's minimum for vectors.
        out[i] = map.from_min != map.from_max ? map(in[0].scalar(i)) : map.clamped(0.0f);
    }
}

void run_vector_map_range(const Evaluation& e, const NodeOp& op) {
    Operand in[6];
    for (std::uint32_t k = 0; k < 6; ++k) {
        in[k] = e.operand(op, k);
    }
    const auto mode = static_cast<MapRangeMode>(op.mode & 3);
    const bool clamp = (op.mode & kClampBit) != 0;
    for (std::size_t i = 0; i < e.lanes; ++i) {
        Vec3 v[6];
        for (std::size_t k = 0; k < 6; ++k) {
            v[k] = in[k].vector(i);
        }
        Vec3 result;
        for (int k = 0; k < 3; ++k) {
            const RangeMap map{v[1][k], v[2][k], v[3][k], v[4][k], v[5][k], mode, clamp};
            result[k] = map(v[0][k]);
        }
        e.store(op, i, result);
    }
}

void run_clamp(const Evaluation& e, const NodeOp& op) {
    const Operand x = e.operand(op, 0);
    const Operand lower = e.operand(op, 1);
    const Operand upper = e.operand(op, 2);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        float a = lower.scalar(i);
        float b = upper.scalar(i);
        if (op.mode == 1 && a > b) {
            std::swap(a, b);
        }
        out[i] = std::fmin(std::fmax(x.scalar(i), a), b);
    }
}

namespace {

// Rodrigues' formula; a zero axis turns nothing.
[[nodiscard]] Vec3 rotate_about(const Vec3& v, const Vec3& axis, float angle) {
    const Vec3 k = normalize(axis);
    if (is_zero(k)) {
        return v;
    }
    const float c = std::cos(angle);
    return v * c + glm::cross(k, v) * std::sin(angle) + k * (glm::dot(k, v) * (1.0f - c));
}

}  // namespace

void run_vector_rotate(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand center = e.operand(op, 1);
    const Operand axis = e.operand(op, 2);
    const Operand angle = e.operand(op, 3);
    const Operand rotation = e.operand(op, 4);
    const bool invert = (op.mode & kInvertBit) != 0;
    const auto mode =
        static_cast<VectorRotateMode>(op.mode & static_cast<std::uint16_t>(~kInvertBit));
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = center.vector(i);
        const Vec3 v = vector.vector(i) - c;
        if (mode == VectorRotateMode::EulerXyz) {
            const Mat3 matrix = euler_matrix(rotation.vector(i));
            e.store(op, i, (invert ? glm::transpose(matrix) * v : matrix * v) + c);
            continue;
        }
        const Vec3 about = mode == VectorRotateMode::AxisAngle ? axis.vector(i)
                           : mode == VectorRotateMode::XAxis   ? Vec3(1.0f, 0.0f, 0.0f)
                           : mode == VectorRotateMode::YAxis   ? Vec3(0.0f, 1.0f, 0.0f)
                                                               : Vec3(0.0f, 0.0f, 1.0f);
        e.store(op, i, rotate_about(v, about, invert ? -angle.scalar(i) : angle.scalar(i)) + c);
    }
}

}  // namespace pharos::detail
