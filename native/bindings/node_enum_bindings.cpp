// Operations of node programs and their modes as dictionaries from name to number, so that Python
// holds no numbers of ours.
#include <initializer_list>
#include <utility>

#include <pybind11/pybind11.h>

#include "bindings/bindings.h"
#include "materials/node_program.h"

namespace py = pybind11;

namespace pharos {
namespace {

template <class Enum>
py::dict numbers(std::initializer_list<std::pair<const char*, Enum>> names) {
    py::dict out;
    for (const auto& [name, value] : names) {
        out[name] = static_cast<int>(value);
    }
    return out;
}

void bind_codes(py::module_& m) {
    {
        using E = NodeOpCode;
        m.attr("NodeOpCode") = numbers<E>({{"Copy", E::Copy},
                                           {"Uv", E::Uv},
                                           {"Geometry", E::Geometry},
                                           {"Coordinate", E::Coordinate},
                                           {"Image", E::Image},
                                           {"EnvironmentImage", E::EnvironmentImage},
                                           {"ScalarToVector", E::ScalarToVector},
                                           {"Luminance", E::Luminance},
                                           {"VectorAverage", E::VectorAverage},
                                           {"Math", E::Math},
                                           {"VectorMath", E::VectorMath},
                                           {"MixColor", E::MixColor},
                                           {"MixFloat", E::MixFloat},
                                           {"Mapping", E::Mapping},
                                           {"Ramp", E::Ramp},
                                           {"Combine", E::Combine},
                                           {"Fresnel", E::Fresnel},
                                           {"LayerWeight", E::LayerWeight},
                                           {"NormalMap", E::NormalMap},
                                           {"ObjectInfo", E::ObjectInfo},
                                           {"CameraData", E::CameraData},
                                           {"LightPath", E::LightPath},
                                           {"MapRange", E::MapRange},
                                           {"VectorMapRange", E::VectorMapRange},
                                           {"Clamp", E::Clamp},
                                           {"Invert", E::Invert},
                                           {"Gamma", E::Gamma},
                                           {"BrightContrast", E::BrightContrast},
                                           {"HueSaturation", E::HueSaturation},
                                           {"Curves", E::Curves},
                                           {"SeparateColor", E::SeparateColor},
                                           {"CombineColor", E::CombineColor},
                                           {"Checker", E::Checker},
                                           {"Gradient", E::Gradient},
                                           {"VectorTransform", E::VectorTransform},
                                           {"VectorRotate", E::VectorRotate},
                                           {"Blackbody", E::Blackbody},
                                           {"Noise", E::Noise},
                                           {"Musgrave", E::Musgrave},
                                           {"WhiteNoise", E::WhiteNoise},
                                           {"Voronoi", E::Voronoi},
                                           {"Wave", E::Wave},
                                           {"Magic", E::Magic},
                                           {"Brick", E::Brick},
                                           {"Bump", E::Bump},
                                           {"Attribute", E::Attribute},
                                           {"InstanceAttribute", E::InstanceAttribute},
                                           {"Tangent", E::Tangent},
                                           {"Sky", E::Sky},
                                           {"Diffuse", E::Diffuse},
                                           {"Glossy", E::Glossy},
                                           {"Glass", E::Glass},
                                           {"Refraction", E::Refraction},
                                           {"Transparent", E::Transparent},
                                           {"Translucent", E::Translucent},
                                           {"Emission", E::Emission},
                                           {"Background", E::Background},
                                           {"PrincipledV1", E::PrincipledV1},
                                           {"PrincipledV2", E::PrincipledV2},
                                           {"Anisotropic", E::Anisotropic},
                                           {"Metallic", E::Metallic},
                                           {"Toon", E::Toon},
                                           {"Velvet", E::Velvet},
                                           {"Sheen", E::Sheen},
                                           {"AovColor", E::AovColor},
                                           {"AovValue", E::AovValue}});
    }
}

void bind_outputs(py::module_& m) {
    {
        using E = GeometryOutput;
        m.attr("GeometryOutput") = numbers<E>({{"Position", E::Position},
                                               {"Normal", E::Normal},
                                               {"TrueNormal", E::TrueNormal},
                                               {"Incoming", E::Incoming},
                                               {"Backfacing", E::Backfacing},
                                               {"Parametric", E::Parametric},
                                               {"Tangent", E::Tangent}});
    }
    {
        using E = CoordinateOutput;
        m.attr("CoordinateOutput") = numbers<E>({{"Generated", E::Generated},
                                                 {"Normal", E::Normal},
                                                 {"Uv", E::Uv},
                                                 {"Object", E::Object},
                                                 {"Camera", E::Camera},
                                                 {"Window", E::Window},
                                                 {"Reflection", E::Reflection}});
    }
    {
        using E = ObjectInfoOutput;
        m.attr("ObjectInfoOutput") = numbers<E>({{"Location", E::Location}, {"Random", E::Random}});
    }
    {
        using E = CameraDataOutput;
        m.attr("CameraDataOutput") = numbers<E>({{"ViewVector", E::ViewVector},
                                                 {"ViewZDepth", E::ViewZDepth},
                                                 {"ViewDistance", E::ViewDistance}});
    }
    {
        using E = LightPathOutput;
        m.attr("LightPathOutput") = numbers<E>({{"IsCameraRay", E::IsCameraRay},
                                                {"IsShadowRay", E::IsShadowRay},
                                                {"IsDiffuseRay", E::IsDiffuseRay},
                                                {"IsGlossyRay", E::IsGlossyRay},
                                                {"IsSingularRay", E::IsSingularRay},
                                                {"IsReflectionRay", E::IsReflectionRay},
                                                {"IsTransmissionRay", E::IsTransmissionRay},
                                                {"RayLength", E::RayLength},
                                                {"RayDepth", E::RayDepth},
                                                {"DiffuseDepth", E::DiffuseDepth},
                                                {"GlossyDepth", E::GlossyDepth},
                                                {"TransparentDepth", E::TransparentDepth},
                                                {"TransmissionDepth", E::TransmissionDepth}});
    }
}

void bind_node_modes(py::module_& m) {
    {
        using E = Distribution;
        m.attr("Distribution") = numbers<E>({{"Sharp", E::Sharp},
                                             {"Beckmann", E::Beckmann},
                                             {"Ggx", E::Ggx},
                                             {"MultiGgx", E::MultiGgx},
                                             {"AshikhminShirley", E::AshikhminShirley}});
    }
    {
        using E = MappingMode;
        m.attr("MappingMode") = numbers<E>({{"Point", E::Point},
                                            {"Texture", E::Texture},
                                            {"Vector", E::Vector},
                                            {"Normal", E::Normal}});
    }
    {
        using E = NormalMapSpace;
        m.attr("NormalMapSpace") =
            numbers<E>({{"Tangent", E::Tangent}, {"Object", E::Object}, {"World", E::World}});
    }
    {
        using E = ColorModel;
        m.attr("ColorModel") =
            numbers<E>({{"Rgb", E::RedGreenBlue}, {"Hsv", E::Hsv}, {"Hsl", E::Hsl}});
    }
    {
        using E = MapRangeMode;
        m.attr("MapRangeMode") = numbers<E>({{"Linear", E::Linear},
                                             {"Stepped", E::Stepped},
                                             {"SmoothStep", E::SmoothStep},
                                             {"SmootherStep", E::SmootherStep}});
    }
    {
        using E = VectorRotateMode;
        m.attr("VectorRotateMode") = numbers<E>({{"AxisAngle", E::AxisAngle},
                                                 {"XAxis", E::XAxis},
                                                 {"YAxis", E::YAxis},
                                                 {"ZAxis", E::ZAxis},
                                                 {"EulerXyz", E::EulerXyz}});
    }
    {
        using E = GradientMode;
        m.attr("GradientMode") = numbers<E>({{"Linear", E::Linear},
                                             {"Quadratic", E::Quadratic},
                                             {"Easing", E::Easing},
                                             {"Diagonal", E::Diagonal},
                                             {"Radial", E::Radial},
                                             {"QuadraticSphere", E::QuadraticSphere},
                                             {"Spherical", E::Spherical}});
    }
}

void bind_operations(py::module_& m) {
    {
        using E = MathMode;
        m.attr("MathMode") = numbers<E>({{"Add", E::Add},
                                         {"Subtract", E::Subtract},
                                         {"Multiply", E::Multiply},
                                         {"Divide", E::Divide},
                                         {"Sine", E::Sine},
                                         {"Cosine", E::Cosine},
                                         {"Tangent", E::Tangent},
                                         {"Arcsine", E::Arcsine},
                                         {"Arccosine", E::Arccosine},
                                         {"Arctangent", E::Arctangent},
                                         {"Power", E::Power},
                                         {"Logarithm", E::Logarithm},
                                         {"Minimum", E::Minimum},
                                         {"Maximum", E::Maximum},
                                         {"Round", E::Round},
                                         {"LessThan", E::LessThan},
                                         {"GreaterThan", E::GreaterThan},
                                         {"Modulo", E::Modulo},
                                         {"Absolute", E::Absolute},
                                         {"Arctan2", E::Arctan2},
                                         {"Floor", E::Floor},
                                         {"Ceil", E::Ceil},
                                         {"Fract", E::Fract},
                                         {"Sqrt", E::Sqrt},
                                         {"InverseSqrt", E::InverseSqrt},
                                         {"Sign", E::Sign},
                                         {"Exponent", E::Exponent},
                                         {"Radians", E::Radians},
                                         {"Degrees", E::Degrees},
                                         {"Sinh", E::Sinh},
                                         {"Cosh", E::Cosh},
                                         {"Tanh", E::Tanh},
                                         {"Trunc", E::Trunc},
                                         {"Snap", E::Snap},
                                         {"Wrap", E::Wrap},
                                         {"Compare", E::Compare},
                                         {"MultiplyAdd", E::MultiplyAdd},
                                         {"Pingpong", E::Pingpong},
                                         {"SmoothMin", E::SmoothMin},
                                         {"SmoothMax", E::SmoothMax},
                                         {"FlooredModulo", E::FlooredModulo}});
    }
    {
        using E = VectorMathMode;
        m.attr("VectorMathMode") = numbers<E>({{"Add", E::Add},
                                               {"Subtract", E::Subtract},
                                               {"Multiply", E::Multiply},
                                               {"Divide", E::Divide},
                                               {"CrossProduct", E::CrossProduct},
                                               {"Project", E::Project},
                                               {"Reflect", E::Reflect},
                                               {"DotProduct", E::DotProduct},
                                               {"Distance", E::Distance},
                                               {"Length", E::Length},
                                               {"Scale", E::Scale},
                                               {"Normalize", E::Normalize},
                                               {"Snap", E::Snap},
                                               {"Floor", E::Floor},
                                               {"Ceil", E::Ceil},
                                               {"Modulo", E::Modulo},
                                               {"Fraction", E::Fraction},
                                               {"Absolute", E::Absolute},
                                               {"Minimum", E::Minimum},
                                               {"Maximum", E::Maximum},
                                               {"Wrap", E::Wrap},
                                               {"Sine", E::Sine},
                                               {"Cosine", E::Cosine},
                                               {"Tangent", E::Tangent},
                                               {"Refract", E::Refract},
                                               {"Faceforward", E::Faceforward},
                                               {"MultiplyAdd", E::MultiplyAdd},
                                               {"Power", E::Power},
                                               {"Sign", E::Sign}});
    }
}

void bind_texture_modes(py::module_& m) {
    {
        using E = FractalType;
        m.attr("FractalType") = numbers<E>({{"Multifractal", E::Multifractal},
                                            {"Fbm", E::Fbm},
                                            {"HybridMultifractal", E::HybridMultifractal},
                                            {"RidgedMultifractal", E::RidgedMultifractal},
                                            {"HeteroTerrain", E::HeteroTerrain}});
    }
    {
        using E = CellFeature;
        m.attr("CellFeature") = numbers<E>({{"F1", E::F1},
                                            {"F2", E::F2},
                                            {"SmoothF1", E::SmoothF1},
                                            {"DistanceToEdge", E::DistanceToEdge},
                                            {"NSphereRadius", E::NSphereRadius}});
    }
    {
        using E = CellMetric;
        m.attr("CellMetric") = numbers<E>({{"Euclidean", E::Euclidean},
                                           {"Manhattan", E::Manhattan},
                                           {"Chebychev", E::Chebychev},
                                           {"Minkowski", E::Minkowski}});
    }
    {
        using E = WaveProfile;
        m.attr("WaveProfile") = numbers<E>({{"Sin", E::Sin}, {"Saw", E::Saw}, {"Tri", E::Tri}});
    }
    {
        using E = BlendMode;
        m.attr("BlendMode") = numbers<E>({{"Mix", E::Mix},
                                          {"Add", E::Add},
                                          {"Multiply", E::Multiply},
                                          {"Subtract", E::Subtract},
                                          {"Screen", E::Screen},
                                          {"Divide", E::Divide},
                                          {"Difference", E::Difference},
                                          {"Darken", E::Darken},
                                          {"Lighten", E::Lighten},
                                          {"Overlay", E::Overlay},
                                          {"Dodge", E::Dodge},
                                          {"Burn", E::Burn},
                                          {"Hue", E::Hue},
                                          {"Saturation", E::Saturation},
                                          {"Value", E::Value},
                                          {"Color", E::Color},
                                          {"SoftLight", E::SoftLight},
                                          {"LinearLight", E::LinearLight},
                                          {"Exclusion", E::Exclusion}});
    }
}

}  // namespace

void bind_node_enums(py::module_& m) {
    bind_codes(m);
    bind_outputs(m);
    bind_node_modes(m);
    bind_operations(m);
    bind_texture_modes(m);
    m.attr("CLAMP_BIT") = static_cast<int>(kClampBit);
    m.attr("CLAMP_FACTOR_BIT") = static_cast<int>(kClampFactorBit);
    m.attr("STEP_BIT") = static_cast<int>(kStepBit);
    m.attr("EXTRAPOLATE_BIT") = static_cast<int>(kExtrapolateBit);
    m.attr("INVERT_BIT") = static_cast<int>(kInvertBit);
    m.attr("PHYSICAL_BIT") = static_cast<int>(kPhysicalBit);
    m.attr("NORMALIZE_NOISE_BIT") = static_cast<int>(kNormalizeNoiseBit);
    m.attr("COLOR_NOISE_BIT") = static_cast<int>(kColorNoiseBit);
    m.attr("LEGACY_NOISE_BIT") = static_cast<int>(kLegacyNoiseBit);
    m.attr("NORMALIZE_CELLS_BIT") = static_cast<int>(kNormalizeCellsBit);
    m.attr("DEFAULT_NAME") = static_cast<int>(kDefaultName);
    m.attr("DEFAULT_OPERAND") = kDefaultOperand;
    m.attr("PRINCIPLED_V1_OPERANDS") = kPrincipledV1Operands;
    m.attr("PRINCIPLED_V2_OPERANDS") = kPrincipledV2Operands;
}

}  // namespace pharos
