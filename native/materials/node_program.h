// A material's or world's node tree as a linear list of operations, evaluated over batches of hits.
//
// The add-on flattens a tree into this list in dependency order. An operation reads operands and
// writes one or more consecutive float registers; a colour or vector takes three registers, a scalar
// one. A closure operation writes no register: it appends a scattering closure (or emission) with a
// weight. Mix and Add Shader disappear: the flattener multiplies their factors into the weights.
//
// Operand encoding: >= 0: register index of the first component; < 0: ~operand is an index into
// `constants`; kDefaultOperand: the socket is unconnected and has the node's own default (a normal).
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "image/image_sampling.h"

namespace pharos {

inline constexpr std::int32_t kDefaultOperand = std::numeric_limits<std::int32_t>::min();

// Operands are listed as name:size. "-> n" is the number of registers written.
enum class NodeOpCode : std::uint16_t {
    // --- values ---
    Copy = 0,            // a:mode -> mode (mode = 1 or 3 components)
    Uv = 1,              // mode = uv map of the mesh by program name index (names[mode]; 0xffff: default) -> 3
    Geometry = 2,        // mode = GeometryOutput -> 1 or 3
    Coordinate = 3,      // mode = CoordinateOutput -> 3
    Image = 4,           // vector:3; mode = image use index (images[mode]) -> 4 (rgb, alpha)
    EnvironmentImage = 5,// direction:3; mode = image use index -> 4
    ScalarToVector = 6,  // x:1 -> 3
    Luminance = 7,       // color:3 -> 1
    VectorAverage = 8,   // vector:3 -> 1
    Math = 9,            // a:1 b:1 c:1; mode = MathMode (| kClampBit) -> 1
    VectorMath = 10,     // a:3 b:3 c:3 scale:1; mode = VectorMathMode -> 3 (value results in the first)
    MixColor = 11,       // factor:1 a:3 b:3; mode = BlendMode (| kClampBit result | kClampFactorBit) -> 3
    MixFloat = 12,       // factor:1 a:1 b:1; mode = clamp bits -> 1
    Mapping = 13,        // vector:3 location:3 rotation:3 scale:3; mode = 0 point 1 texture 2 vector 3 normal -> 3
    Ramp = 14,           // x:1; mode = table index, linearly interpolated RGBA rows -> 4
    Combine = 15,        // x:1 y:1 z:1 -> 3
    Fresnel = 16,        // ior:1 normal:3 -> 1
    LayerWeight = 17,    // blend:1 normal:3; -> 2 (fresnel, facing)
    NormalMap = 18,      // strength:1 color:3; mode = 0 tangent 1 object 2 world -> 3
    // --- closures; weight:3 is always the first operand ---
    Diffuse = 100,       // weight:3 color:3 roughness:1 normal:3
    Glossy = 101,        // weight:3 color:3 roughness:1 normal:3; mode = Distribution
    Glass = 102,         // weight:3 color:3 roughness:1 ior:1 normal:3; mode = Distribution
    Refraction = 103,    // weight:3 color:3 roughness:1 ior:1 normal:3; mode = Distribution
    Transparent = 104,   // weight:3 color:3
    Translucent = 105,   // weight:3 color:3 normal:3
    Emission = 106,      // weight:3 color:3 strength:1
    Background = 107,    // weight:3 color:3 strength:1
    PrincipledV1 = 108,  // weight:3, then kPrincipledV1Operands; mode = Distribution
    PrincipledV2 = 109,  // weight:3, then kPrincipledV2Operands; mode = Distribution
};

enum class GeometryOutput : std::uint16_t { Position, Normal, TrueNormal, Incoming, Backfacing, Parametric, Tangent };
enum class CoordinateOutput : std::uint16_t { Generated, Normal, Uv, Object, Camera, Window, Reflection };
enum class Distribution : std::uint16_t { Sharp, Beckmann, Ggx, MultiGgx, AshikhminShirley };

// Mode bits of Math, MixColor and MixFloat.
inline constexpr std::uint16_t kClampBit = 0x8000;
inline constexpr std::uint16_t kClampFactorBit = 0x4000;

struct NodeOp {
    NodeOpCode code = NodeOpCode::Copy;
    std::uint16_t mode = 0;
    std::int32_t output = -1;  // first register written
    std::uint32_t first_operand = 0;
    std::uint32_t operand_count = 0;
};

enum class ImageProjection : std::uint32_t { Flat, Box, Sphere, Tube, Equirectangular, MirrorBall };

struct ImageUse {
    std::uint32_t image = 0xffffffffu;  // into SceneDescription::images; none: magenta
    ImageInterpolation interpolation = ImageInterpolation::Linear;
    ImageExtension extension = ImageExtension::Repeat;
    ImageProjection projection = ImageProjection::Flat;
    float projection_blend = 0.0f;
};

struct NodeProgram {
    std::vector<NodeOp> ops;
    std::vector<std::int32_t> operands;
    std::vector<float> constants;
    std::vector<ImageUse> images;
    std::vector<std::string> names;          // UV maps and attributes referred to by ops
    std::vector<std::vector<float>> tables;  // RGBA rows
    std::uint32_t register_count = 0;
};

// Operand order of the two Principled versions after weight:3 (name:size in one place for both sides).
// V1 (Blender 3.x): base_color:3 subsurface:1 subsurface_color:3 metallic:1 specular:1 specular_tint:1
//   roughness:1 anisotropic:1 anisotropic_rotation:1 sheen:1 sheen_tint:1 clearcoat:1
//   clearcoat_roughness:1 ior:1 transmission:1 transmission_roughness:1 normal:3 clearcoat_normal:3
//   tangent:3                                                    (emission and alpha are ops of their own)
// V2 (Blender 4.x): base_color:3 metallic:1 roughness:1 ior:1 diffuse_roughness:1 subsurface_weight:1
//   specular_ior_level:1 specular_tint:3 anisotropic:1 anisotropic_rotation:1 transmission_weight:1
//   coat_weight:1 coat_roughness:1 coat_ior:1 coat_tint:3 sheen_weight:1 sheen_roughness:1 sheen_tint:3
//   emission_color:3 emission_strength:1 thin_film_thickness:1 thin_film_ior:1 alpha:1 normal:3
//   coat_normal:3 tangent:3
inline constexpr std::uint32_t kPrincipledV1Operands = 19;
inline constexpr std::uint32_t kPrincipledV2Operands = 26;

}  // namespace pharos
