// A material's or world's node tree as a linear list of operations, evaluated over batches of hits.
//
// The add-on flattens a tree into this list in dependency order. An operation reads operands and
// writes one or more consecutive float registers; a colour or vector takes three registers, a
// scalar one. A closure operation writes no register: it appends a scattering closure (or emission)
// with a weight. Mix and Add Shader disappear: the flattener multiplies their factors into the
// weights.
//
// Operand encoding: >= 0: register index of the first component; < 0: ~operand is an index into
// `constants`; kDefaultOperand: the socket is unconnected and has the node's own default (a
// normal).
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/math.h"
#include "image/image_sampling.h"

namespace pharos {

inline constexpr std::int32_t kDefaultOperand = std::numeric_limits<std::int32_t>::min();

// Operands are listed as name:size. "-> n" is the number of registers written.
enum class NodeOpCode : std::uint16_t {
    // --- values ---
    Copy = 0,              // a:mode -> mode (mode = 1 or 3 components)
    Uv = 1,                // mode = name index (names[mode]) of a mesh's uv map, kDefaultName: its
                           // first -> 3 (0 where there is no such map)
    Geometry = 2,          // mode = GeometryOutput -> 1 or 3
    Coordinate = 3,        // mode = CoordinateOutput -> 3
    Image = 4,             // vector:3 (default: the first uv map); mode = image use index
                           // (images[mode]) -> 4 (rgb, alpha)
    EnvironmentImage = 5,  // direction:3 (default: Position); mode = image use index -> 4
    ScalarToVector = 6,    // x:1 -> 3
    Luminance = 7,         // color:3 -> 1
    VectorAverage = 8,     // vector:3 -> 1
    Math = 9,              // a:1 b:1 c:1; mode = MathMode (| kClampBit) -> 1
    VectorMath = 10,   // a:3 b:3 c:3 scale:1; mode = VectorMathMode -> 3 (a value: in the first)
    MixColor = 11,     // factor:1 a:3 b:3; mode = BlendMode (| kClampBit | kClampFactorBit) -> 3
    MixFloat = 12,     // factor:1 a:1 b:1; mode = clamp bits -> 1
    Mapping = 13,      // vector:3 location:3 rotation:3 scale:3; mode = MappingMode -> 3
    Ramp = 14,         // x:1; mode = table index, RGBA rows over [0, 1] (| kStepBit: no
                       // interpolation between rows) -> 4
    Combine = 15,      // x:1 y:1 z:1 -> 3 (separating: name the component's register or constant)
    Fresnel = 16,      // ior:1 normal:3 -> 1
    LayerWeight = 17,  // blend:1 normal:3; -> 2 (fresnel, facing)
    NormalMap = 18,  // strength:1 color:3 (| uv:3, an output of Uv: its map gives the tangent, else
                     // the first map does); mode = NormalMapSpace -> 3
    ObjectInfo = 19,  // mode = ObjectInfoOutput -> 1 or 3
    CameraData = 20,  // mode = CameraDataOutput -> 1 or 3
    LightPath = 21,   // mode = LightPathOutput -> 1
    MapRange = 22,    // x:1 from_min:1 from_max:1 to_min:1 to_max:1 steps:1; mode = MapRangeMode
                      // (| kClampBit) -> 1
    VectorMapRange = 23,  // the same with :3 for every operand -> 3
    Clamp = 24,           // x:1 min:1 max:1; mode = 0 min/max, 1 range (swaps if min > max) -> 1
    Invert = 25,          // factor:1 color:3 -> 3
    Gamma = 26,           // color:3 gamma:1 -> 3
    BrightContrast = 27,  // color:3 bright:1 contrast:1 -> 3
    HueSaturation = 28,   // hue:1 saturation:1 value:1 factor:1 color:3 -> 3
    Curves = 29,         // factor:1 value:3 minimum:1 maximum:1; mode = table index: the rows' r, g
                         // and b are the three curves over [minimum, maximum] (| kExtrapolateBit)
                         // -> 3. RGB, vector and float curves (float: ScalarToVector before)
    SeparateColor = 30,  // color:3; mode = ColorModel -> 3
    CombineColor = 31,   // a:1 b:1 c:1; mode = ColorModel -> 3
    Checker = 32,        // vector:3 (default: Generated) color1:3 color2:3 scale:1 -> 4
                         // (color, factor)
    Gradient = 33,       // vector:3 (default: Generated); mode = GradientMode -> 1
    VectorTransform = 34,  // vector:3; mode = from + 3 * to + 9 * type; spaces 0 world 1 object
                           // 2 camera; type 0 vector 1 point 2 normal -> 3
    VectorRotate = 35,     // vector:3 center:3 axis:3 angle:1 rotation:3; mode = VectorRotateMode
                           // (| kInvertBit) -> 3
    Blackbody = 36,        // temperature:1 -> 3 (Rec.709 of luminance 1)
    Noise = 37,            // vector:3 w:1 scale:1 detail:1 roughness:1 lacunarity:1 offset:1 gain:1
    // distortion:1; mode = dimensions - 1 + 4 x FractalType | kNormalizeNoiseBit |
    // kColorNoiseBit | kLegacyNoiseBit -> 1, with kColorNoiseBit 3 (its red)
    Musgrave = 38,    // vector:3 w:1 scale:1 detail:1 dimension:1 lacunarity:1 offset:1 gain:1;
                      // mode = dimensions - 1 + 4 x FractalType -> 1
    WhiteNoise = 39,  // vector:3 w:1; mode = dimensions - 1 -> 4 (color, value)
    Voronoi = 40,  // vector:3 w:1 scale:1 detail:1 roughness:1 lacunarity:1 smoothness:1 exponent:1
                   // randomness:1; mode = dimensions - 1 + 4 x CellFeature + 32 x CellMetric |
                   // kNormalizeCellsBit -> 8 (distance or radius, color, position, w)
    Wave = 41,     // vector:3 scale:1 distortion:1 detail:1 detail_scale:1 detail_roughness:1
                   // phase:1; mode = rings + 2 x direction + 8 x WaveProfile | kLegacyNoiseBit -> 1
    Magic = 42,    // vector:3 scale:1 distortion:1; mode = depth -> 4 (color, factor)
    Brick = 43,    // vector:3 color1:3 color2:3 mortar:3 scale:1 mortar_size:1 mortar_smooth:1
                   // bias:1 width:1 height:1 offset:1 squash:1 offset_frequency:1
                   // squash_frequency:1 -> 4 (color, factor)
    Bump = 44,     // strength:1 distance:1 filter_width:1 height:1 height_x:1 height_y:1
                   // normal:3 (default: the surface's); the heights here and filter_width steps
                   // beside (NodeOp::step); mode = kInvertBit or 0 -> 3
    Attribute = 45,          // mode = name index of a mesh's attribute or uv map
                             // -> 5 (color or vector, alpha, mean); 0 where there is none
    InstanceAttribute = 46,  // mode = name index of an attribute of instances -> 5 likewise
    Tangent = 47,  // mode = axis of the object it turns around, or 3 + 4 x (name index + 1): along
                   // growing u of that uv map, 3: of the first -> 3
    Sky = 48,  // direction:3; mode = table index: a sky's parameters in rows of four, read_sky()
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
    Anisotropic = 110,   // weight:3 color:3 roughness:1 anisotropy:1 rotation:1 tangent:3 normal:3;
                         // mode = Distribution
    Metallic = 111,      // weight:3 base:3 edge:3 roughness:1 anisotropy:1 rotation:1 tangent:3
                         // normal:3; mode = Distribution | kPhysicalBit: base and edge are the
                         // complex index of refraction
    Toon = 112,          // weight:3 color:3 size:1 smooth:1 normal:3; mode = 0 diffuse, 1 glossy
    Velvet = 113,        // weight:3 color:3 sigma:1 normal:3
    Sheen = 114,         // weight:3 color:3 roughness:1 normal:3
    // --- passes of materials; mode = index of the AOV ---
    AovColor = 115,  // color:3
    AovValue = 116,  // value:1
};

enum class GeometryOutput : std::uint16_t {
    Position,
    Normal,
    TrueNormal,
    Incoming,
    Backfacing,
    Parametric,  // weights of the triangle's first two vertices
    Tangent,
};
enum class CoordinateOutput : std::uint16_t {
    Generated,
    Normal,
    Uv,
    Object,
    Camera,
    Window,
    Reflection,
};
enum class ObjectInfoOutput : std::uint16_t { Location, Random };
enum class CameraDataOutput : std::uint16_t { ViewVector, ViewZDepth, ViewDistance };
enum class LightPathOutput : std::uint16_t {
    IsCameraRay,
    IsShadowRay,
    IsDiffuseRay,
    IsGlossyRay,
    IsSingularRay,
    IsReflectionRay,
    IsTransmissionRay,
    RayLength,
    RayDepth,
    DiffuseDepth,
    GlossyDepth,
    TransparentDepth,
    TransmissionDepth,
};
enum class Distribution : std::uint16_t { Sharp, Beckmann, Ggx, MultiGgx, AshikhminShirley };
enum class MappingMode : std::uint16_t { Point, Texture, Vector, Normal };
enum class NormalMapSpace : std::uint16_t { Tangent, Object, World };
enum class ColorModel : std::uint16_t { RedGreenBlue, Hsv, Hsl };
enum class MapRangeMode : std::uint16_t { Linear, Stepped, SmoothStep, SmootherStep };
enum class VectorRotateMode : std::uint16_t { AxisAngle, XAxis, YAxis, ZAxis, EulerXyz };
enum class GradientMode : std::uint16_t {
    Linear,
    Quadratic,
    Easing,
    Diagonal,
    Radial,
    QuadraticSphere,
    Spherical,
};

enum class WaveProfile : std::uint16_t { Sin, Saw, Tri };
enum class FractalType : std::uint16_t {
    Multifractal,
    Fbm,
    HybridMultifractal,
    RidgedMultifractal,
    HeteroTerrain,
};
enum class CellFeature : std::uint16_t { F1, F2, SmoothF1, DistanceToEdge, NSphereRadius };
enum class CellMetric : std::uint16_t { Euclidean, Manhattan, Chebychev, Minkowski };

// Blender's operations under their names (MULTIPLY_ADD is MultiplyAdd) and numbers.
enum class MathMode : std::uint16_t {
    Add = 0,
    Subtract = 1,
    Multiply = 2,
    Divide = 3,
    Sine = 4,
    Cosine = 5,
    Tangent = 6,
    Arcsine = 7,
    Arccosine = 8,
    Arctangent = 9,
    Power = 10,
    Logarithm = 11,
    Minimum = 12,
    Maximum = 13,
    Round = 14,
    LessThan = 15,
    GreaterThan = 16,
    Modulo = 17,  // truncated
    Absolute = 18,
    Arctan2 = 19,
    Floor = 20,
    Ceil = 21,
    Fract = 22,
    Sqrt = 23,
    InverseSqrt = 24,
    Sign = 25,
    Exponent = 26,
    Radians = 27,
    Degrees = 28,
    Sinh = 29,
    Cosh = 30,
    Tanh = 31,
    Trunc = 32,
    Snap = 33,
    Wrap = 34,
    Compare = 35,
    MultiplyAdd = 36,
    Pingpong = 37,
    SmoothMin = 38,
    SmoothMax = 39,
    FlooredModulo = 40,
};
inline constexpr std::uint16_t kMathModes = 41;

enum class VectorMathMode : std::uint16_t {
    Add = 0,
    Subtract = 1,
    Multiply = 2,
    Divide = 3,
    CrossProduct = 4,
    Project = 5,
    Reflect = 6,
    DotProduct = 7,
    Distance = 8,
    Length = 9,
    Scale = 10,
    Normalize = 11,
    Snap = 12,
    Floor = 13,
    Ceil = 14,
    Modulo = 15,
    Fraction = 16,
    Absolute = 17,
    Minimum = 18,
    Maximum = 19,
    Wrap = 20,
    Sine = 21,
    Cosine = 22,
    Tangent = 23,
    Refract = 24,
    Faceforward = 25,
    MultiplyAdd = 26,
    Power = 27,
    Sign = 28,
};
inline constexpr std::uint16_t kVectorMathModes = 29;

enum class BlendMode : std::uint16_t {
    Mix = 0,
    Add = 1,
    Multiply = 2,
    Subtract = 3,
    Screen = 4,
    Divide = 5,
    Difference = 6,
    Darken = 7,
    Lighten = 8,
    Overlay = 9,
    Dodge = 10,
    Burn = 11,
    Hue = 12,
    Saturation = 13,
    Value = 14,
    Color = 15,
    SoftLight = 16,
    LinearLight = 17,
    Exclusion = 18,
};
inline constexpr std::uint16_t kBlendModes = 19;

// Mode bits beside an operation's number or index.
inline constexpr std::uint16_t kClampBit = 0x8000;
inline constexpr std::uint16_t kClampFactorBit = 0x4000;
inline constexpr std::uint16_t kStepBit = 0x8000;
inline constexpr std::uint16_t kExtrapolateBit = 0x8000;
inline constexpr std::uint16_t kInvertBit = 0x8000;
inline constexpr std::uint16_t kPhysicalBit = 0x8000;
inline constexpr std::uint16_t kNormalizeNoiseBit = 0x20;
inline constexpr std::uint16_t kColorNoiseBit = 0x40;
inline constexpr std::uint16_t kLegacyNoiseBit = 0x80;  // Blender 3.x
inline constexpr std::uint16_t kNormalizeCellsBit = 0x80;
inline constexpr std::size_t kSkyParameters = 16;
inline constexpr std::uint16_t kDefaultName = 0xffff;

struct NodeOp {
    NodeOpCode code = NodeOpCode::Copy;
    std::uint16_t mode = 0;
    std::int32_t output = -1;  // first register written
    std::uint32_t first_operand = 0;
    std::uint32_t operand_count = 0;
    // Operations that say where the hit is may look this many pixels' footprints beside it, along
    // two axes in the surface: bump mapping compares heights.
    Vec2 step{0.0f};

    bool operator==(const NodeOp&) const = default;
};

enum class ImageProjection : std::uint32_t { Flat, Box, Sphere, Tube, Equirectangular, MirrorBall };

// A part of an image that covers [u, u + 1) x [v, v + 1): number = 10 v + u, u below 10.
struct ImageTile {
    std::uint32_t number = 0;
    std::uint32_t image = 0xffffffffu;

    bool operator==(const ImageTile&) const = default;
};

struct ImageUse {
    std::uint32_t image = 0xffffffffu;  // into SceneDescription::images; none: magenta
    ImageInterpolation interpolation = ImageInterpolation::Linear;
    ImageExtension extension = ImageExtension::Repeat;
    ImageProjection projection = ImageProjection::Flat;
    float projection_blend = 0.0f;
    std::vector<ImageTile> tiles{};  // of a tiled image; elsewhere there is nothing

    bool operator==(const ImageUse&) const = default;
};

struct NodeProgram {
    std::vector<NodeOp> ops;
    std::vector<std::int32_t> operands;
    std::vector<float> constants;
    std::vector<ImageUse> images;
    std::vector<std::string> names;          // UV maps and attributes referred to by ops
    std::vector<std::vector<float>> tables;  // RGBA rows
    std::uint32_t register_count = 0;

    bool operator==(const NodeProgram&) const = default;
};

// Operand order of the two Principled versions after weight:3 (name:size in one place for both
// sides). V1 (Blender 3.x): base_color:3 subsurface:1 subsurface_color:3 metallic:1 specular:1
// specular_tint:1
//   roughness:1 anisotropic:1 anisotropic_rotation:1 sheen:1 sheen_tint:1 clearcoat:1
//   clearcoat_roughness:1 ior:1 transmission:1 transmission_roughness:1 normal:3 clearcoat_normal:3
//   tangent:3                                                    (emission and alpha are ops of
//   their own)
// V2 (Blender 4.x): base_color:3 metallic:1 roughness:1 ior:1 diffuse_roughness:1
// subsurface_weight:1
//   specular_ior_level:1 specular_tint:3 anisotropic:1 anisotropic_rotation:1 transmission_weight:1
//   coat_weight:1 coat_roughness:1 coat_ior:1 coat_tint:3 sheen_weight:1 sheen_roughness:1
//   sheen_tint:3 emission_color:3 emission_strength:1 thin_film_thickness:1 thin_film_ior:1 alpha:1
//   normal:3 coat_normal:3 tangent:3
inline constexpr std::uint32_t kPrincipledV1Operands = 19;
inline constexpr std::uint32_t kPrincipledV2Operands = 26;

}  // namespace pharos
