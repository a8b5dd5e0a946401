// The enumerations of descriptions and sessions, by name.
#include <initializer_list>
#include <utility>

#include <pybind11/pybind11.h>

#include "bindings/bindings.h"
#include "core/visibility.h"
#include "film/film.h"
#include "film/film_description.h"
#include "geometry/mesh.h"
#include "image/image_description.h"
#include "lights/light_description.h"
#include "scene/scene_description.h"
#include "session/render_session.h"

namespace py = pybind11;

namespace pharos {
namespace {

template <class Enum>
void enumeration(py::module_& m,
                 const char* name,
                 std::initializer_list<std::pair<const char*, Enum>> values) {
    py::enum_<Enum> bound(m, name, py::module_local());
    for (const auto& [value_name, value] : values) {
        bound.value(value_name, value);
    }
}

void bind_image_enums(py::module_& m) {
    using Interpolation = ImageInterpolation;
    enumeration<Interpolation>(m,
                               "ImageInterpolation",
                               {{"Linear", Interpolation::Linear},
                                {"Closest", Interpolation::Closest},
                                {"Cubic", Interpolation::Cubic},
                                {"Smart", Interpolation::Smart}});
    using Extension = ImageExtension;
    enumeration<Extension>(m,
                           "ImageExtension",
                           {{"Repeat", Extension::Repeat},
                            {"Extend", Extension::Extend},
                            {"Clip", Extension::Clip},
                            {"Mirror", Extension::Mirror}});
    using Projection = ImageProjection;
    enumeration<Projection>(m,
                            "ImageProjection",
                            {{"Flat", Projection::Flat},
                             {"Box", Projection::Box},
                             {"Sphere", Projection::Sphere},
                             {"Tube", Projection::Tube},
                             {"Equirectangular", Projection::Equirectangular},
                             {"MirrorBall", Projection::MirrorBall}});
    using Space = ImageColorSpace;
    enumeration<Space>(m,
                       "ImageColorSpace",
                       {{"Srgb", Space::Srgb}, {"Linear", Space::Linear}, {"Data", Space::Data}});
    enumeration<ImageAlpha>(m,
                            "ImageAlpha",
                            {{"Straight", ImageAlpha::Straight},
                             {"Premultiplied", ImageAlpha::Premultiplied},
                             {"ChannelPacked", ImageAlpha::ChannelPacked},
                             {"None_", ImageAlpha::None}});
}

void bind_scene_enums(py::module_& m) {
    enumeration<NormalDomain>(m,
                              "NormalDomain",
                              {{"Face", NormalDomain::Face},
                               {"Vertex", NormalDomain::Vertex},
                               {"Corner", NormalDomain::Corner}});
    enumeration<LightType>(m,
                           "LightType",
                           {{"Point", LightType::Point},
                            {"Spot", LightType::Spot},
                            {"Area", LightType::Area},
                            {"Sun", LightType::Sun}});
    enumeration<AreaShape>(
        m, "AreaShape", {{"Rectangle", AreaShape::Rectangle}, {"Ellipse", AreaShape::Ellipse}});
    enumeration<CameraType>(
        m,
        "CameraType",
        {{"Perspective", CameraType::Perspective}, {"Orthographic", CameraType::Orthographic}});
    enumeration<PixelFilter>(m,
                             "PixelFilter",
                             {{"Box", PixelFilter::Box},
                              {"Gaussian", PixelFilter::Gaussian},
                              {"BlackmanHarris", PixelFilter::BlackmanHarris}});
    enumeration<GuidingMode>(m,
                             "GuidingMode",
                             {{"Off", GuidingMode::Off},
                              {"Neural", GuidingMode::Neural},
                              {"Slides", GuidingMode::Slides},
                              {"SlidesPosition", GuidingMode::SlidesPosition},
                              {"SlidesMixture", GuidingMode::SlidesMixture},
                              {"NeuralReflection", GuidingMode::NeuralReflection},
                              {"NeuralRadiance", GuidingMode::NeuralRadiance}});
    m.attr("VISIBLE_CAMERA") = static_cast<unsigned>(kVisibleCamera);
    m.attr("VISIBLE_DIFFUSE") = static_cast<unsigned>(kVisibleDiffuse);
    m.attr("VISIBLE_GLOSSY") = static_cast<unsigned>(kVisibleGlossy);
    m.attr("VISIBLE_TRANSMISSION") = static_cast<unsigned>(kVisibleTransmission);
    m.attr("VISIBLE_SHADOW") = static_cast<unsigned>(kVisibleShadow);
    m.attr("NONE") = kNone;
}

void bind_session_enums(py::module_& m) {
    enumeration<SessionState>(m,
                              "SessionState",
                              {{"Building", SessionState::Building},
                               {"Rendering", SessionState::Rendering},
                               {"Finished", SessionState::Finished},
                               {"Cancelled", SessionState::Cancelled},
                               {"Failed", SessionState::Failed}});
    enumeration<GuideState>(m,
                            "GuideState",
                            {{"Off", GuideState::Off},
                             {"Learning", GuideState::Learning},
                             {"Unproven", GuideState::Unproven},
                             {"Guiding", GuideState::Guiding},
                             {"Closed", GuideState::Closed},
                             {"Brief", GuideState::Brief}});
    enumeration<Severity>(
        m,
        "Severity",
        {{"Info", Severity::Info}, {"Warning", Severity::Warning}, {"Error", Severity::Error}});
}

void bind_passes(py::module_& m) {
    enumeration<FilmPass>(m,
                          "FilmPass",
                          {{"Combined", FilmPass::Combined},
                           {"Depth", FilmPass::Depth},
                           {"Normal", FilmPass::Normal},
                           {"DenoisingNormal", FilmPass::DenoisingNormal},
                           {"DenoisingAlbedo", FilmPass::DenoisingAlbedo},
                           {"SampleCount", FilmPass::SampleCount},
                           {"Position", FilmPass::Position},
                           {"Uv", FilmPass::Uv},
                           {"Mist", FilmPass::Mist},
                           {"ObjectIndex", FilmPass::ObjectIndex},
                           {"MaterialIndex", FilmPass::MaterialIndex},
                           {"Emission", FilmPass::Emission},
                           {"Environment", FilmPass::Environment},
                           {"GuideDirection", FilmPass::GuideDirection},
                           {"GuideKappa", FilmPass::GuideKappa},
                           {"GuideIrradiance", FilmPass::GuideIrradiance},
                           {"GuideShare", FilmPass::GuideShare},
                           {"DiffuseDirect", FilmPass::DiffuseDirect},
                           {"DiffuseIndirect", FilmPass::DiffuseIndirect},
                           {"DiffuseColor", FilmPass::DiffuseColor},
                           {"GlossyDirect", FilmPass::GlossyDirect},
                           {"GlossyIndirect", FilmPass::GlossyIndirect},
                           {"GlossyColor", FilmPass::GlossyColor},
                           {"TransmissionDirect", FilmPass::TransmissionDirect},
                           {"TransmissionIndirect", FilmPass::TransmissionIndirect},
                           {"TransmissionColor", FilmPass::TransmissionColor},
                           {"Effort", FilmPass::Effort}});
    m.def("film_pass_channels", &film_pass_channels, FloatGuard(), py::arg("film_pass"));
    m.def("pass_bit", &pass_bit, FloatGuard(), py::arg("film_pass"));
}

}  // namespace

void bind_enums(py::module_& m) {
    bind_image_enums(m);
    bind_scene_enums(m);
    bind_session_enums(m);
    bind_passes(m);
}

}  // namespace pharos
