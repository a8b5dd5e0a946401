// The enumerations of descriptions and sessions, by name.
#include <pybind11/pybind11.h>

#include "bindings/bindings.h"
#include "core/visibility.h"
#include "film/film.h"
#include "film/film_description.h"
#include "geometry/mesh.h"
#include "image/image_description.h"
#include "lights/light_description.h"
#include "materials/node_program.h"
#include "scene/scene_description.h"
#include "session/render_session.h"

namespace py = pybind11;

namespace pharos {
namespace {

template <class Enum>
py::enum_<Enum> enumeration(py::module_& m, const char* name) {
    return py::enum_<Enum>(m, name, py::module_local());
}

void bind_image_enums(py::module_& m) {
    enumeration<ImageInterpolation>(m, "ImageInterpolation")
        .value("Linear", ImageInterpolation::Linear)
        .value("Closest", ImageInterpolation::Closest)
        .value("Cubic", ImageInterpolation::Cubic)
        .value("Smart", ImageInterpolation::Smart);
    enumeration<ImageExtension>(m, "ImageExtension")
        .value("Repeat", ImageExtension::Repeat)
        .value("Extend", ImageExtension::Extend)
        .value("Clip", ImageExtension::Clip)
        .value("Mirror", ImageExtension::Mirror);
    enumeration<ImageProjection>(m, "ImageProjection")
        .value("Flat", ImageProjection::Flat)
        .value("Box", ImageProjection::Box)
        .value("Sphere", ImageProjection::Sphere)
        .value("Tube", ImageProjection::Tube)
        .value("Equirectangular", ImageProjection::Equirectangular)
        .value("MirrorBall", ImageProjection::MirrorBall);
    enumeration<ImageColorSpace>(m, "ImageColorSpace")
        .value("Srgb", ImageColorSpace::Srgb)
        .value("Linear", ImageColorSpace::Linear)
        .value("Data", ImageColorSpace::Data);
    enumeration<ImageAlpha>(m, "ImageAlpha")
        .value("Straight", ImageAlpha::Straight)
        .value("Premultiplied", ImageAlpha::Premultiplied)
        .value("ChannelPacked", ImageAlpha::ChannelPacked)
        .value("None_", ImageAlpha::None);
}

void bind_scene_enums(py::module_& m) {
    enumeration<NormalDomain>(m, "NormalDomain")
        .value("Face", NormalDomain::Face)
        .value("Vertex", NormalDomain::Vertex)
        .value("Corner", NormalDomain::Corner);
    enumeration<LightType>(m, "LightType")
        .value("Point", LightType::Point)
        .value("Spot", LightType::Spot)
        .value("Area", LightType::Area)
        .value("Sun", LightType::Sun);
    enumeration<AreaShape>(m, "AreaShape")
        .value("Rectangle", AreaShape::Rectangle)
        .value("Ellipse", AreaShape::Ellipse);
    enumeration<CameraType>(m, "CameraType")
        .value("Perspective", CameraType::Perspective)
        .value("Orthographic", CameraType::Orthographic);
    enumeration<PixelFilter>(m, "PixelFilter")
        .value("Box", PixelFilter::Box)
        .value("Gaussian", PixelFilter::Gaussian)
        .value("BlackmanHarris", PixelFilter::BlackmanHarris);
    enumeration<GuidingMode>(m, "GuidingMode")
        .value("Off", GuidingMode::Off)
        .value("Neural", GuidingMode::Neural)
        .value("Slides", GuidingMode::Slides);
    m.attr("VISIBLE_CAMERA") = static_cast<unsigned>(kVisibleCamera);
    m.attr("VISIBLE_DIFFUSE") = static_cast<unsigned>(kVisibleDiffuse);
    m.attr("VISIBLE_GLOSSY") = static_cast<unsigned>(kVisibleGlossy);
    m.attr("VISIBLE_TRANSMISSION") = static_cast<unsigned>(kVisibleTransmission);
    m.attr("VISIBLE_SHADOW") = static_cast<unsigned>(kVisibleShadow);
    m.attr("NONE") = kNone;
}

void bind_session_enums(py::module_& m) {
    enumeration<FilmPass>(m, "FilmPass")
        .value("Combined", FilmPass::Combined)
        .value("Depth", FilmPass::Depth)
        .value("Normal", FilmPass::Normal)
        .value("DenoisingNormal", FilmPass::DenoisingNormal)
        .value("DenoisingAlbedo", FilmPass::DenoisingAlbedo)
        .value("SampleCount", FilmPass::SampleCount);
    enumeration<SessionState>(m, "SessionState")
        .value("Building", SessionState::Building)
        .value("Rendering", SessionState::Rendering)
        .value("Finished", SessionState::Finished)
        .value("Cancelled", SessionState::Cancelled)
        .value("Failed", SessionState::Failed);
    enumeration<Severity>(m, "Severity")
        .value("Info", Severity::Info)
        .value("Warning", Severity::Warning)
        .value("Error", Severity::Error);
    m.def("film_pass_channels", &film_pass_channels, FloatGuard(), py::arg("film_pass"));
}

}  // namespace

void bind_enums(py::module_& m) {
    bind_image_enums(m);
    bind_scene_enums(m);
    bind_session_enums(m);
}

}  // namespace pharos
