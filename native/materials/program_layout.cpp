#include "materials/program_layout.h"

#include <algorithm>
#include <iterator>

namespace pharos::detail {

namespace {

constexpr std::uint16_t kFractalTypes = 5;
constexpr std::uint16_t kCellFeatures = 5;

constexpr OpLayout kLayouts[] = {
    {NodeOpCode::Copy, OpKind::Pure, "", 0},  // by mode
    {NodeOpCode::Uv, OpKind::Hit, "", 3},
    {NodeOpCode::Geometry, OpKind::Hit, "", 3},
    {NodeOpCode::Coordinate, OpKind::Hit, "", 3},
    {NodeOpCode::Image, OpKind::Hit, "3*", 4},
    {NodeOpCode::EnvironmentImage, OpKind::Hit, "3*", 4},
    {NodeOpCode::ScalarToVector, OpKind::Pure, "1", 3},
    {NodeOpCode::Luminance, OpKind::Pure, "3", 1},
    {NodeOpCode::VectorAverage, OpKind::Pure, "3", 1},
    {NodeOpCode::Math, OpKind::Pure, "111", 1},
    {NodeOpCode::VectorMath, OpKind::Pure, "3331", 3},
    {NodeOpCode::MixColor, OpKind::Pure, "133", 3},
    {NodeOpCode::MixFloat, OpKind::Pure, "111", 1},
    {NodeOpCode::Mapping, OpKind::Pure, "3333", 3},
    {NodeOpCode::Ramp, OpKind::Pure, "1", 4},
    {NodeOpCode::Combine, OpKind::Pure, "111", 3},
    {NodeOpCode::Fresnel, OpKind::Hit, "13*", 1},
    {NodeOpCode::LayerWeight, OpKind::Hit, "13*", 2},
    {NodeOpCode::NormalMap, OpKind::Hit, "13", 3},
    {NodeOpCode::ObjectInfo, OpKind::Hit, "", 3},
    {NodeOpCode::CameraData, OpKind::Hit, "", 3},
    {NodeOpCode::LightPath, OpKind::Hit, "", 1},
    {NodeOpCode::MapRange, OpKind::Pure, "111111", 1},
    {NodeOpCode::VectorMapRange, OpKind::Pure, "333333", 3},
    {NodeOpCode::Clamp, OpKind::Pure, "111", 1},
    {NodeOpCode::Invert, OpKind::Pure, "13", 3},
    {NodeOpCode::Gamma, OpKind::Pure, "31", 3},
    {NodeOpCode::BrightContrast, OpKind::Pure, "311", 3},
    {NodeOpCode::HueSaturation, OpKind::Pure, "11113", 3},
    {NodeOpCode::Curves, OpKind::Pure, "1311", 3},
    {NodeOpCode::SeparateColor, OpKind::Pure, "3", 3},
    {NodeOpCode::CombineColor, OpKind::Pure, "111", 3},
    {NodeOpCode::Checker, OpKind::Hit, "3*331", 4},
    {NodeOpCode::Gradient, OpKind::Hit, "3*", 1},
    {NodeOpCode::VectorTransform, OpKind::Hit, "3", 3},
    {NodeOpCode::VectorRotate, OpKind::Pure, "33313", 3},
    {NodeOpCode::Blackbody, OpKind::Pure, "1", 3},
    {NodeOpCode::Noise, OpKind::Pure, "311111111", 1},
    {NodeOpCode::Musgrave, OpKind::Pure, "31111111", 1},
    {NodeOpCode::WhiteNoise, OpKind::Pure, "31", 4},
    {NodeOpCode::Voronoi, OpKind::Pure, "311111111", 8},
    {NodeOpCode::Wave, OpKind::Pure, "3111111", 1},
    {NodeOpCode::Magic, OpKind::Pure, "311", 4},
    {NodeOpCode::Brick, OpKind::Pure, "33331111111111", 4},
    {NodeOpCode::Bump, OpKind::Hit, "1111113*", 3},
    {NodeOpCode::Attribute, OpKind::Hit, "", 5},
    {NodeOpCode::InstanceAttribute, OpKind::Hit, "", 5},
    {NodeOpCode::Sky, OpKind::Hit, "3", 3},
    {NodeOpCode::Tangent, OpKind::Hit, "", 3},
    {NodeOpCode::Diffuse, OpKind::Closure, "3313*", 0},
    {NodeOpCode::Glossy, OpKind::Closure, "3313*", 0},
    {NodeOpCode::Glass, OpKind::Closure, "33113*", 0},
    {NodeOpCode::Refraction, OpKind::Closure, "33113*", 0},
    {NodeOpCode::Transparent, OpKind::Closure, "33", 0},
    {NodeOpCode::Translucent, OpKind::Closure, "333*", 0},
    {NodeOpCode::Emission, OpKind::Closure, "331", 0},
    {NodeOpCode::Background, OpKind::Closure, "331", 0},
    {NodeOpCode::PrincipledV1, OpKind::Closure, "331311111111111113*3*3*", 0},
    {NodeOpCode::PrincipledV2, OpKind::Closure, "3311111131111113113311113*3*3*", 0},
    {NodeOpCode::Anisotropic, OpKind::Closure, "331113*3*", 0},
    {NodeOpCode::Metallic, OpKind::Closure, "3331113*3*", 0},
    {NodeOpCode::Toon, OpKind::Closure, "33113*", 0},
    {NodeOpCode::Velvet, OpKind::Closure, "3313*", 0},
    {NodeOpCode::Sheen, OpKind::Closure, "3313*", 0},
    {NodeOpCode::AovColor, OpKind::Closure, "3", 0},
    {NodeOpCode::AovValue, OpKind::Closure, "1", 0},
};

[[nodiscard]] bool below(std::uint16_t mode, std::uint16_t flags, std::size_t count) {
    return static_cast<std::size_t>(mode & static_cast<std::uint16_t>(~flags)) < count;
}

[[nodiscard]] bool table_exists(const NodeProgram& program, std::uint16_t mode) {
    const std::size_t index = mode & 0x7fffu;
    // Two rows of RGBA at least: a curve has two ends.
    return index < program.tables.size() && program.tables[index].size() >= 8 &&
           program.tables[index].size() % 4 == 0;
}

[[nodiscard]] bool texture_mode_exists(const NodeOp& op) {
    switch (op.code) {
        case NodeOpCode::Gradient:
            return op.mode <= static_cast<std::uint16_t>(GradientMode::Spherical);
        case NodeOpCode::Noise:
            return op.mode <= 0xff && (op.mode >> 2 & 7) < kFractalTypes;
        case NodeOpCode::Musgrave:
            return op.mode < 4 * kFractalTypes;
        case NodeOpCode::WhiteNoise:
            return op.mode < 4;
        case NodeOpCode::Voronoi:
            return op.mode <= 0xff && (op.mode >> 2 & 7) < kCellFeatures;
        case NodeOpCode::Wave:
            return (op.mode & ~(kLegacyNoiseBit | 7)) <= 8 * static_cast<int>(WaveProfile::Tri);
        case NodeOpCode::Magic:
            return op.mode <= 10;
        default:
            return true;  // the mode is not looked at
    }
}

[[nodiscard]] bool mode_exists(const NodeProgram& program, const NodeOp& op) {
    switch (op.code) {
        case NodeOpCode::Copy:
            return op.mode == 1 || op.mode == 3;
        case NodeOpCode::Uv:
            return op.mode == kDefaultName || op.mode < program.names.size();
        case NodeOpCode::Attribute:
        case NodeOpCode::InstanceAttribute:
            return op.mode < program.names.size();
        case NodeOpCode::Geometry:
            return op.mode <= static_cast<std::uint16_t>(GeometryOutput::Tangent);
        case NodeOpCode::Coordinate:
            return op.mode <= static_cast<std::uint16_t>(CoordinateOutput::Reflection);
        case NodeOpCode::Image:
        case NodeOpCode::EnvironmentImage:
            return op.mode < program.images.size();
        case NodeOpCode::Math:
            return below(op.mode, kClampBit, kMathModes);
        case NodeOpCode::VectorMath:
            return op.mode < kVectorMathModes;
        case NodeOpCode::MixColor:
            return below(op.mode, kClampBit | kClampFactorBit, kBlendModes);
        case NodeOpCode::Mapping:
            return op.mode <= static_cast<std::uint16_t>(MappingMode::Normal);
        case NodeOpCode::Sky:
            return op.mode < program.tables.size() &&
                   program.tables[op.mode].size() >= kSkyParameters;
        case NodeOpCode::Ramp:
        case NodeOpCode::Curves:
            return table_exists(program, op.mode);
        case NodeOpCode::NormalMap:
            return (op.mode & 3) <= static_cast<int>(NormalMapSpace::World) &&
                   op.mode >> 2 <=
                       static_cast<int>(std::min<std::size_t>(program.names.size(), 0x3fff));
        case NodeOpCode::ObjectInfo:
            return op.mode <= static_cast<std::uint16_t>(ObjectInfoOutput::Random);
        case NodeOpCode::CameraData:
            return op.mode <= static_cast<std::uint16_t>(CameraDataOutput::ViewDistance);
        case NodeOpCode::LightPath:
            return op.mode <= static_cast<std::uint16_t>(LightPathOutput::TransmissionDepth);
        case NodeOpCode::MapRange:
        case NodeOpCode::VectorMapRange:
            return below(op.mode, kClampBit, 4);
        case NodeOpCode::SeparateColor:
        case NodeOpCode::CombineColor:
            return op.mode <= static_cast<std::uint16_t>(ColorModel::Hsl);
        case NodeOpCode::VectorTransform:
            return op.mode < 27;
        case NodeOpCode::VectorRotate:
            return below(op.mode, kInvertBit, 5);
        case NodeOpCode::Tangent:
            return op.mode < 3 ||
                   ((op.mode & 3) == 3 && std::size_t{op.mode} >> 2 <= program.names.size());
        case NodeOpCode::Toon:
            return op.mode <= 1;
        case NodeOpCode::Metallic:
            return below(op.mode, kPhysicalBit, 5);
        case NodeOpCode::Anisotropic:
        case NodeOpCode::Glossy:
        case NodeOpCode::Glass:
        case NodeOpCode::Refraction:
        case NodeOpCode::PrincipledV1:
        case NodeOpCode::PrincipledV2:
            return op.mode <= static_cast<std::uint16_t>(Distribution::AshikhminShirley);
        default:
            return texture_mode_exists(op);
    }
}

// Operations whose number of results depends on the mode.
[[nodiscard]] std::uint32_t output_count(const NodeOp& op, const OpLayout& layout) {
    const bool scalar = (op.code == NodeOpCode::Geometry &&
                         op.mode == static_cast<std::uint16_t>(GeometryOutput::Backfacing)) ||
                        (op.code == NodeOpCode::ObjectInfo &&
                         op.mode == static_cast<std::uint16_t>(ObjectInfoOutput::Random)) ||
                        (op.code == NodeOpCode::CameraData &&
                         op.mode != static_cast<std::uint16_t>(CameraDataOutput::ViewVector));
    if (op.code == NodeOpCode::Noise && (op.mode & kColorNoiseBit) != 0) {
        return 3;
    }
    return scalar ? 1 : op.code == NodeOpCode::Copy ? op.mode : layout.outputs;
}

}  // namespace

bool find_shape(const NodeProgram& program, const NodeOp& op, OpShape& shape) {
    const auto* layout =
        std::find_if(std::begin(kLayouts), std::end(kLayouts), [&](const OpLayout& candidate) {
            return candidate.code == op.code;
        });
    if (layout == std::end(kLayouts) || !mode_exists(program, op)) {
        return false;
    }
    shape = OpShape();
    shape.kind = layout->kind;
    shape.outputs = output_count(op, *layout);
    if (op.code == NodeOpCode::Copy) {
        shape.operand_count = 1;
        shape.size[0] = static_cast<std::uint8_t>(op.mode);
        return op.operand_count == 1;
    }
    for (const char c : layout->operands) {
        if (c == '*') {
            shape.may_default[shape.operand_count - 1] = true;
        } else {
            shape.size[shape.operand_count++] = static_cast<std::uint8_t>(c - '0');
        }
    }
    // A normal map may name its uv map by an operand, too: compiling turns it into a mode.
    if (op.code == NodeOpCode::NormalMap && op.operand_count == 3) {
        shape.size[shape.operand_count++] = 3;
    }
    return shape.operand_count == op.operand_count;
}

}  // namespace pharos::detail
