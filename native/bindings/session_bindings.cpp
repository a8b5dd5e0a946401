// Render sessions: start, poll, read, cancel.
#include <array>
#include <chrono>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bindings/bindings.h"
#include "image/image_io.h"
#include "session/render_session.h"

namespace py = pybind11;

namespace pharos {
namespace {

bool read_pass(const RenderSession& session,
               FilmPass pass,
               py::array_t<float, py::array::c_style>& out) {
    const std::span<float> pixels(out.mutable_data(), static_cast<std::size_t>(out.size()));
    const py::gil_scoped_release release;
    return session.read(pass, pixels);
}

bool read_aov(const RenderSession& session,
              std::size_t index,
              py::array_t<float, py::array::c_style>& out) {
    const std::span<float> pixels(out.mutable_data(), static_cast<std::size_t>(out.size()));
    const py::gil_scoped_release release;
    return session.read_aov(index, pixels);
}

void bind_guide_status(py::module_& m) {
    py::class_<GuideStatus>(m, "GuideStatus", py::module_local())
        .def_readonly("enabled", &GuideStatus::enabled)
        .def_readonly("guided_share", &GuideStatus::guided_share)
        .def_readonly("moment_ratio", &GuideStatus::moment_ratio)
        .def_readonly("loss", &GuideStatus::loss)
        .def_readonly("held_out_loss", &GuideStatus::held_out_loss)
        .def_readonly("snapshots", &GuideStatus::snapshots)
        .def_readonly("records", &GuideStatus::records)
        .def_readonly("skipped_steps", &GuideStatus::skipped_steps)
        .def_readonly("fitting", &GuideStatus::fitting)
        .def_property_readonly("state", &guide_state)
        .def_property_readonly("why_unguided",
                               [](const GuideStatus& s) { return why_unguided(guide_state(s)); });
}

void bind_results(py::module_& m) {
    bind_guide_status(m);
    py::class_<SessionProgress>(m, "SessionProgress", py::module_local())
        .def_readonly("state", &SessionProgress::state)
        .def_readonly("error", &SessionProgress::error)
        .def_readonly("out_of_memory", &SessionProgress::out_of_memory)
        .def_readonly("samples", &SessionProgress::samples)
        .def_readonly("total_samples", &SessionProgress::total_samples)
        .def_readonly("serial", &SessionProgress::serial)
        .def_readonly("fraction", &SessionProgress::fraction)
        .def_readonly("elapsed", &SessionProgress::elapsed)
        .def_readonly("remaining", &SessionProgress::remaining)
        .def_readonly("noise", &SessionProgress::noise)
        .def_readonly("memory_bytes", &SessionProgress::memory_bytes)
        .def_readonly("nonfinite_samples", &SessionProgress::nonfinite_samples)
        .def_readonly("guiding", &SessionProgress::guiding);
    py::class_<StageStatistics>(m, "StageStatistics", py::module_local())
        .def_readonly("name", &StageStatistics::name)
        .def_readonly("items", &StageStatistics::items)
        .def_readonly("seconds", &StageStatistics::seconds);
    py::class_<SessionStatistics>(m, "SessionStatistics", py::module_local())
        .def_readonly("stages", &SessionStatistics::stages)
        .def_readonly("camera_samples", &SessionStatistics::camera_samples)
        .def_readonly("vertices", &SessionStatistics::vertices)
        .def_readonly("rays", &SessionStatistics::rays)
        .def_readonly("build_seconds", &SessionStatistics::build_seconds)
        .def_readonly("render_cpu_seconds", &SessionStatistics::render_cpu_seconds);
    py::class_<ReportEntry>(m, "ReportEntry", py::module_local())
        .def_readonly("severity", &ReportEntry::severity)
        .def_readonly("object", &ReportEntry::object)
        .def_readonly("message", &ReportEntry::message)
        .def_readonly("missing", &ReportEntry::missing);
}

using PixelArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using PassTuple = std::tuple<std::string, std::string, PixelArray>;  // name, channels, pixels

void write_passes(const std::string& path,
                  std::uint32_t width,
                  std::uint32_t height,
                  const std::vector<PassTuple>& arrays) {
    std::vector<ExrPass> passes;
    passes.reserve(arrays.size());
    for (const auto& [name, channels, pixels] : arrays) {
        passes.push_back(
            {name, channels, std::span(pixels.data(), static_cast<std::size_t>(pixels.size()))});
    }
    std::string error;
    {
        const py::gil_scoped_release release;
        error = write_exr(path, width, height, passes);
    }
    if (!error.empty()) {
        throw std::runtime_error(path + ": " + error);
    }
}

py::list effort_rows(const RenderSession& session) {
    constexpr std::array<const char*, 3> kKinds{"OBJECT", "LIGHT", "WORLD"};  // EffortKind
    py::list rows;
    for (const EffortShare& row : session.effort()) {
        rows.append(
            py::make_tuple(kKinds[static_cast<std::size_t>(row.kind)], row.name, row.share));
    }
    return rows;
}

py::bytes field_bytes(const RenderSession& session) {
    const std::vector<std::byte> field = session.field();
    return py::bytes(reinterpret_cast<const char*>(field.data()), field.size());
}

// The destructor cancels and joins: other Python threads must be able to run meanwhile.
struct FreeDelete {
    void operator()(RenderSession* session) const {
        const py::gil_scoped_release release;
        delete session;
    }
};

}  // namespace

void bind_session(py::module_& m) {
    bind_results(m);
    m.def("write_exr",
          &write_passes,
          FloatGuard(),
          py::arg("path"),
          py::arg("width"),
          py::arg("height"),
          py::arg("passes"),
          "Passes are (name, channel letters, pixels with the bottom row first).");
    using Holder = std::unique_ptr<RenderSession, FreeDelete>;
    py::class_<RenderSession, Holder>(m, "RenderSession", py::module_local())
        .def(
            py::init([](SceneDescription& description,
                        unsigned threads,
                        const std::string& checkpoint,
                        double interval,
                        const py::bytes& field,
                        bool keeps_field) {
                SessionOptions options;
                const auto bytes = std::as_bytes(std::span<const char>(std::string_view(field)));
                options.field.assign(bytes.begin(), bytes.end());
                options.field_learns = true;
                options.least_guided_samples = keeps_field ? 0 : kLeastGuidedSamples;
                const py::gil_scoped_release release;
                options.threads = threads;
                options.checkpoint = {checkpoint, interval, Resume::IfItFits};
                return Holder(new RenderSession(std::move(description), std::move(options)));
            }),
            FloatGuard(),
            py::arg("description"),
            py::arg("threads") = 0,
            py::arg("checkpoint") = "",
            py::arg("checkpoint_interval") = 300.0,
            py::arg("field") = py::bytes(),
            py::arg("keeps_field") = false,
            "Takes the description over: it is empty afterwards. Goes on from the checkpoint where "
            "it is one of this render. The guide learns on from `field`, if it fits. Where another "
            "picture is to go on from this one (`keeps_field`) it learns from few samples, too.")
        .def("cancel", &RenderSession::cancel, FreeGuard())
        .def(
            "wait",
            [](const RenderSession& session, double seconds) {
                return session.wait(std::chrono::milliseconds(static_cast<long>(seconds * 1e3)));
            },
            FreeGuard(),
            py::arg("seconds"))
        .def("progress", &RenderSession::progress, FreeGuard())
        .def("statistics", &RenderSession::statistics, FreeGuard())
        .def("report", &RenderSession::report, FreeGuard())
        .def("effort",
             &effort_rows,
             FloatGuard(),
             "(kind, name, share) of what made the picture slow: OBJECT by what the camera sees, "
             "LIGHT and WORLD by where it is lit from; the largest first. Empty before the end and "
             "without the pass Effort.")
        .def("field",
             &field_bytes,
             FloatGuard(),
             "What the guide has learned, for another render; empty before the end and without a "
             "guide.")
        .def_property_readonly("width", &RenderSession::width)
        .def_property_readonly("height", &RenderSession::height)
        .def("read",
             &read_pass,
             FloatGuard(),
             py::arg("film_pass"),
             py::arg("out").noconvert(),
             "Fills `out` (float32, C order, bottom row first); False while there is no picture.")
        .def("read_aov",
             &read_aov,
             FloatGuard(),
             py::arg("index"),
             py::arg("out").noconvert(),
             "The same of a pass that materials write, by its place in the description's AOVs.");
}

}  // namespace pharos
