// The live session of a viewport: scenes and views in, the newest picture out.
#include <chrono>
#include <memory>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bindings/bindings.h"
#include "session/live_session.h"

namespace py = pybind11;

namespace pharos {
namespace {

// The destructor cancels and joins: other Python threads must be able to run meanwhile.
struct FreeDelete {
    void operator()(LiveSession* session) const {
        const py::gil_scoped_release release;
        delete session;
    }
};

void bind_lobes(py::module_& m) {
    py::class_<GuideLobe>(m, "GuideLobe", py::module_local())
        .def_property_readonly("direction",
                               [](const GuideLobe& lobe) {
                                   return py::make_tuple(
                                       lobe.direction.x, lobe.direction.y, lobe.direction.z);
                               })
        .def_readonly("kappa", &GuideLobe::kappa)
        .def_readonly("weight", &GuideLobe::weight);
    py::class_<LobeProbe>(m, "LobeProbe", py::module_local())
        .def_readonly("question", &LobeProbe::question)
        .def_readonly("hit", &LobeProbe::hit)
        .def_property_readonly("position",
                               [](const LobeProbe& probe) {
                                   const Vec3& p = probe.position;
                                   return py::make_tuple(p.x, p.y, p.z);
                               })
        .def_readonly("irradiance", &LobeProbe::irradiance)
        .def_readonly("diffuse_share", &LobeProbe::diffuse_share)
        .def_readonly("glossy_share", &LobeProbe::glossy_share)
        .def_property_readonly("why_unguided",
                               [](const LobeProbe& probe) { return why_unguided(probe.state); })
        .def_readonly("lobes", &LobeProbe::lobes);
}

// (pixels of height x width x 4 with the bottom row first, serial), or None while there is nothing.
py::object picture(const LiveSession& session) {
    auto picture = std::make_unique<LivePicture>();
    {
        const py::gil_scoped_release release;
        *picture = session.picture();
    }
    if (picture->pixels.empty()) {
        return py::none();
    }
    // The array owns the picture: a copy would take milliseconds.
    LivePicture* owned = picture.release();
    const py::capsule owner(owned, [](void* held) { delete static_cast<LivePicture*>(held); });
    const py::array_t<float> pixels(
        {py::ssize_t{owned->height}, py::ssize_t{owned->width}, py::ssize_t{4}},
        owned->pixels.data(),
        owner);
    return py::make_tuple(pixels, owned->serial);
}

}  // namespace

void bind_live(py::module_& m) {
    bind_lobes(m);
    py::class_<LiveProgress>(m, "LiveProgress", py::module_local())
        .def_readonly("render", &LiveProgress::render)
        .def_readonly("pictures", &LiveProgress::pictures)
        .def_readonly("guide_kept", &LiveProgress::guide_kept)
        .def_readonly("lost_scene", &LiveProgress::lost_scene)
        .def_readonly("has_picture", &LiveProgress::has_picture);
    using Holder = std::unique_ptr<LiveSession, FreeDelete>;
    py::class_<LiveSession, Holder>(m, "LiveSession", py::module_local())
        .def(py::init([](unsigned threads) { return Holder(new LiveSession(threads)); }),
             FloatGuard(),
             py::arg("threads") = 0)
        .def(
            "set_scene",
            [](LiveSession& session, SceneDescription& description) {
                session.set_scene(std::move(description));
            },
            FreeGuard(),
            py::arg("description"),
            "Takes the description over: it is empty afterwards.")
        .def(
            "set_view",
            [](LiveSession& session, const SceneDescription& description) {
                return session.set_view(view_of(description));
            },
            FreeGuard(),
            py::arg("description"),
            "Camera, film and samples of a description that may hold nothing else; True: another "
            "view.")
        .def("set_paused", &LiveSession::set_paused, FreeGuard(), py::arg("paused"))
        .def("forget_guide", &LiveSession::forget_guide, FreeGuard())
        .def("progress", &LiveSession::progress, FreeGuard())
        .def("statistics", &LiveSession::statistics, FreeGuard())
        .def("report", &LiveSession::report, FreeGuard())
        .def("picture", &picture, FloatGuard())
        .def(
            "ask_lobes",
            [](LiveSession& session, float x, float y) { return session.ask_lobes(Vec2(x, y)); },
            FreeGuard(),
            py::arg("x"),
            py::arg("y"),
            "At a place in fractions of the view, from its bottom left.")
        .def("lobes", &LiveSession::lobes, FreeGuard())
        .def(
            "wait",
            [](const LiveSession& session, double seconds) {
                return session.wait(std::chrono::milliseconds(static_cast<long>(seconds * 1e3)));
            },
            FreeGuard(),
            py::arg("seconds"))
        .def(
            "wait_picture",
            [](const LiveSession& session, double seconds) {
                const auto time = std::chrono::milliseconds(static_cast<long>(seconds * 1e3));
                return session.wait_picture(time);
            },
            FreeGuard(),
            py::arg("seconds"),
            "Until there is something to show of the newest view and scene: whether there is.");
}

}  // namespace pharos
