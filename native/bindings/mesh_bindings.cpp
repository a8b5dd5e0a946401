// Meshes: gathered from the host's arrays where they lie, then moved into a description.
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/casters.h"
#include "geometry/gather_mesh.h"
#include "scene/scene_description.h"

namespace py = pybind11;

namespace pharos {
namespace {

// Rows that may lie apart from each other.
template <class T>
using Strided = py::array_t<T, py::array::forcecast>;

using NamedUv = std::pair<std::string, Strided<float>>;

// (name, domain, rows of 1 to 4 numbers)
using NamedValues = std::tuple<std::string, NormalDomain, Strided<float>>;

struct PolygonArrays {
    Strided<float> positions;
    Strided<std::uint32_t> corner_vertices;
    Strided<std::uint32_t> triangle_corners;
    std::optional<Strided<std::uint32_t>> triangle_polygons;
    NormalDomain normal_domain = NormalDomain::Face;
    std::optional<Strided<float>> normals;
    std::optional<Strided<bool>> smooth;
    std::optional<Strided<std::int32_t>> material_slot;
    std::uint16_t last_slot = 0;
    std::vector<NamedUv> uv_maps;
    std::vector<NamedValues> attributes;
};

// Rows of so many numbers side by side; `array` becomes a copy where it does not lie like that.
template <class T, class Scalar>
Column<T> rows_of(Strided<Scalar>& array, py::ssize_t components) {
    const py::ssize_t ndim = array.ndim();
    if ((ndim != 1 && ndim != 2) || (ndim == 1 && components != 1) ||
        (ndim == 2 && array.shape(1) != components)) {
        throw std::invalid_argument("rows of " + std::to_string(components) + " were expected");
    }
    constexpr auto kSize = static_cast<py::ssize_t>(sizeof(Scalar));
    if (array.strides(0) < kSize * components || (ndim == 2 && array.strides(1) != kSize)) {
        array = Array<Scalar>::ensure(array.attr("copy")());
    }
    return {reinterpret_cast<const std::byte*>(array.data()),
            static_cast<std::size_t>(array.shape(0)),
            static_cast<std::size_t>(array.strides(0))};
}

template <class T, class Scalar>
Column<T> column_of(Strided<Scalar>& array) {
    constexpr std::size_t kComponents = components_of<T>();
    static_assert(sizeof(T) == kComponents * sizeof(Scalar));
    return rows_of<T>(array, static_cast<py::ssize_t>(kComponents));
}

template <class T, class Scalar>
Column<T> column_of(std::optional<Strided<Scalar>>& array) {
    return array ? column_of<T>(*array) : Column<T>();
}

// The columns are those of `arrays`, which must outlive them.
PolygonMesh polygon_mesh(PolygonArrays& arrays) {
    PolygonMesh out;
    out.positions = column_of<Vec3>(arrays.positions);
    out.corner_vertices = column_of<std::uint32_t>(arrays.corner_vertices);
    out.triangle_corners = column_of<UVec3>(arrays.triangle_corners);
    out.triangle_polygons = column_of<std::uint32_t>(arrays.triangle_polygons);
    out.normal_domain = arrays.normal_domain;
    out.normals = column_of<Vec3>(arrays.normals);
    out.smooth = column_of<std::uint8_t>(arrays.smooth);
    out.material_slot = column_of<std::int32_t>(arrays.material_slot);
    out.last_slot = arrays.last_slot;
    for (auto& [name, uv] : arrays.uv_maps) {
        out.uv_maps.push_back({name, column_of<Vec2>(uv)});
    }
    for (auto& [name, domain, values] : arrays.attributes) {
        const py::ssize_t components = values.ndim() == 2 ? values.shape(1) : 1;
        out.attributes.push_back({name,
                                  domain,
                                  static_cast<std::uint32_t>(components),
                                  rows_of<float>(values, components)});
    }
    return out;
}

Mesh gather(const std::string& name, const py::kwargs& fields) {
    PolygonArrays arrays;
    assign_fields(arrays, fields);
    PolygonMesh source;
    try {
        source = polygon_mesh(arrays);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(name + ": " + error.what());
    }
    const py::gil_scoped_release release;
    return gather_mesh(name, source);
}

// A table whose memory `owner` keeps.
template <class Scalar, class T>
py::array_t<Scalar> view_of(const std::vector<T>& rows, const py::object& owner) {
    return py::array_t<Scalar>(
        {rows.size(), components_of<T>()}, reinterpret_cast<const Scalar*>(rows.data()), owner);
}

// All that tells one mesh from another, without a copy.
py::list content_of(const py::object& self) {
    const auto& mesh = self.cast<const Mesh&>();
    py::list out;
    out.append(py::make_tuple(mesh.normal_domain,
                              view_of<float>(mesh.positions, self),
                              view_of<std::uint32_t>(mesh.triangles, self),
                              view_of<float>(mesh.normals, self),
                              view_of<std::uint16_t>(mesh.material_indices, self)));
    for (const UvMap& map : mesh.uv_maps) {
        out.append(py::make_tuple(map.name, view_of<float>(map.uv, self)));
    }
    for (const MeshAttribute& attribute : mesh.attributes) {
        out.append(py::make_tuple(attribute.name,
                                  attribute.domain,
                                  attribute.components,
                                  view_of<float>(attribute.values, self)));
    }
    return out;
}

py::dict mesh_as_dict(const SceneDescription& scene, std::size_t index) {
    const Mesh& mesh = scene.meshes.at(index);
    py::dict uv_maps;
    for (const UvMap& map : mesh.uv_maps) {
        uv_maps[py::str(map.name)] = to_array<float>(map.uv);
    }
    py::dict out;
    out["name"] = mesh.name;
    out["positions"] = to_array<float>(mesh.positions);
    out["triangles"] = to_array<std::uint32_t>(mesh.triangles);
    out["normal_domain"] = mesh.normal_domain;
    out["normals"] = to_array<float>(mesh.normals);
    out["material_indices"] = to_array<std::uint16_t>(mesh.material_indices);
    out["uv_maps"] = uv_maps;
    py::dict attributes;
    for (const MeshAttribute& attribute : mesh.attributes) {
        attributes[py::str(attribute.name)] =
            py::make_tuple(attribute.domain, to_array<float>(attribute.values));
    }
    out["attributes"] = attributes;
    return out;
}

void bind_gathering(py::module_& m) {
    py::class_<PolygonArrays>(m, "PolygonArrays", py::module_local())
        .def_readwrite("positions", &PolygonArrays::positions)
        .def_readwrite("corner_vertices", &PolygonArrays::corner_vertices)
        .def_readwrite("triangle_corners", &PolygonArrays::triangle_corners)
        .def_readwrite("triangle_polygons", &PolygonArrays::triangle_polygons)
        .def_readwrite("normal_domain", &PolygonArrays::normal_domain)
        .def_readwrite("normals", &PolygonArrays::normals)
        .def_readwrite("smooth", &PolygonArrays::smooth)
        .def_readwrite("material_slot", &PolygonArrays::material_slot)
        .def_readwrite("last_slot", &PolygonArrays::last_slot)
        .def_readwrite("uv_maps", &PolygonArrays::uv_maps)
        .def_readwrite("attributes", &PolygonArrays::attributes);
    py::class_<Mesh>(m, "Mesh", py::module_local())
        .def_readonly("name", &Mesh::name)
        .def_property_readonly("content",
                               &content_of,
                               "Views of everything but the name, valid until the mesh is added.");
    m.def(
        "gather_mesh",
        &gather,
        FloatGuard(),
        py::arg("name"),
        "A mesh from the fields of PolygonArrays, which are read where they lie. ValueError names "
        "the mesh where sizes do not fit or an index is beyond the end.");
}

}  // namespace

void bind_meshes(py::module_& m, py::class_<SceneDescription>& scene) {
    bind_gathering(m);
    scene
        .def(
            "add_mesh",
            [](SceneDescription& s, Mesh& mesh, std::uint64_t version) {
                mesh.version = version;
                s.meshes.push_back(std::move(mesh));
                return index_of_last(s.meshes.size());
            },
            FloatGuard(),
            py::arg("mesh"),
            py::arg("version") = 0,
            "Takes what is in the mesh, which is empty afterwards.")
        .def(
            "add_kept_mesh",
            [](SceneDescription& s, const std::string& name, std::uint64_t version) {
                return add_kept(s.meshes, name, version);
            },
            FloatGuard(),
            py::arg("name"),
            py::arg("version"))
        .def(
            "add_instance_attribute",
            [](SceneDescription& s, std::string name, const Array<float>& values) {
                auto rows = copy_rows<Vec4>(values, name, "values are not rows of four");
                s.instance_attributes.push_back({std::move(name), std::move(rows)});
            },
            FloatGuard(),
            py::arg("name"),
            py::arg("values"))
        .def_property_readonly(
            "instance_attributes",
            [](const SceneDescription& s) {
                py::dict out;
                for (const InstanceAttribute& attribute : s.instance_attributes) {
                    out[py::str(attribute.name)] = to_array<float>(attribute.values);
                }
                return out;
            })
        .def("mesh", &mesh_as_dict, FloatGuard(), py::arg("index"));
}

}  // namespace pharos
