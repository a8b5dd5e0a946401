// The Python module `_native`, part by part. Nothing but conversions lives here.
//
// Every entry point restores the host's floating-point state; what takes over a millisecond runs
// without the GIL. Classes are local to this module: other extensions in the process may use
// pybind11 too.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "core/fp_state.h"

namespace pharos {

struct SceneDescription;

using FloatGuard = pybind11::call_guard<FloatStateGuard>;
using FreeGuard = pybind11::call_guard<FloatStateGuard, pybind11::gil_scoped_release>;

// Assigns keyword arguments to the attributes of the same names; unknown names raise
// AttributeError.
template <class T>
void assign_fields(T& target, const pybind11::kwargs& fields) {
    const pybind11::object view = pybind11::cast(&target, pybind11::return_value_policy::reference);
    for (const auto& [name, value] : fields) {
        pybind11::setattr(view, name, value);
    }
}

inline std::uint32_t index_of_last(std::size_t size) {
    return static_cast<std::uint32_t>(size - 1);
}

// A mesh or image that the receiver of the description knows by its version.
template <class Thing>
std::uint32_t add_kept(std::vector<Thing>& things, const std::string& name, std::uint64_t version) {
    Thing& kept = things.emplace_back();
    kept.name = name;
    kept.version = version;
    return index_of_last(things.size());
}

void bind_enums(pybind11::module_& m);
void bind_node_enums(pybind11::module_& m);
void bind_programs(pybind11::module_& m);
void bind_scene(pybind11::module_& m);
void bind_meshes(pybind11::module_& m, pybind11::class_<SceneDescription>& scene);
void bind_session(pybind11::module_& m);
void bind_live(pybind11::module_& m);

}  // namespace pharos
