#include <pybind11/pybind11.h>

#include "bindings/bindings.h"
#include "geometry/accelerator.h"

PYBIND11_MODULE(_native, m) {
    m.doc() = "Pharos: scene descriptions, dump files and render sessions.";
    m.attr("__version__") = PHAROS_VERSION;
    m.def("self_test",
          &pharos::accelerator_self_test,
          pharos::FreeGuard(),
          "False when this process makes ray tracing calls go to another library.");
    pharos::bind_enums(m);
    pharos::bind_node_enums(m);
    pharos::bind_programs(m);
    pharos::bind_scene(m);
    pharos::bind_session(m);
    pharos::bind_live(m);
}
