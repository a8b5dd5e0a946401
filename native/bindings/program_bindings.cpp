// Node programs: built by Python in one call, read back by tests.
#include <stdexcept>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "bindings/bindings.h"
#include "materials/material.h"
#include "materials/node_program.h"
#include "materials/procedural_hash.h"

namespace py = pybind11;

namespace pharos {
namespace {

// One operation as Python writes it: (code, mode, output, [operands], (step, step)).
using OpTuple = std::tuple<std::uint16_t,
                           std::uint16_t,
                           std::int32_t,
                           std::vector<std::int32_t>,
                           std::pair<float, float>>;

NodeProgram make_program(const std::vector<OpTuple>& ops,
                         std::vector<float> constants,
                         std::uint32_t register_count) {
    NodeProgram program;
    program.constants = std::move(constants);
    program.register_count = register_count;
    for (const auto& [code, mode, output, operands, step] : ops) {
        NodeOp op;
        op.code = static_cast<NodeOpCode>(code);
        op.mode = mode;
        op.output = output;
        op.step = Vec2(step.first, step.second);
        op.first_operand = static_cast<std::uint32_t>(program.operands.size());
        op.operand_count = static_cast<std::uint32_t>(operands.size());
        program.operands.insert(program.operands.end(), operands.begin(), operands.end());
        program.ops.push_back(op);
    }
    return program;
}

py::list list_ops(const NodeProgram& program) {
    py::list out;
    for (const NodeOp& op : program.ops) {
        const auto first = program.operands.begin() + op.first_operand;
        out.append(py::make_tuple(static_cast<int>(op.code),
                                  op.mode,
                                  op.output,
                                  std::vector<std::int32_t>(first, first + op.operand_count),
                                  std::make_pair(op.step.x, op.step.y)));
    }
    return out;
}

// The number in [0, 1] that shader nodes know an object by: a polynomial of its name's bytes,
// mixed.
double random_of_name(const std::string& name) {
    std::uint32_t hash = 0;
    for (const char c : name) {
        hash = hash * 37u + static_cast<std::uint32_t>(static_cast<std::int32_t>(c));
    }
    return static_cast<double>(detail::hash_words<2>({hash, 0u})) / 4294967295.0;
}

}  // namespace

void bind_programs(py::module_& m) {
    m.def(
        "mean_emission",
        [](const NodeProgram& program) {
            const MeanEmission e = mean_emission(program);
            return std::make_tuple(e.mean.x, e.mean.y, e.mean.z, e.constant);
        },
        FloatGuard(),
        py::arg("program"));
    m.def("random_of_name", &random_of_name, FloatGuard(), py::arg("name"));

    py::class_<ImageTile>(m, "ImageTile", py::module_local())
        .def(py::init([](std::uint32_t number, std::uint32_t image) {
                 return ImageTile{number, image};
             }),
             py::arg("number"),
             py::arg("image"))
        .def_readonly("number", &ImageTile::number)
        .def_readonly("image", &ImageTile::image);
    py::class_<ImageUse>(m, "ImageUse", py::module_local())
        .def(py::init([](const py::kwargs& fields) {
                 ImageUse use;
                 assign_fields(use, fields);
                 return use;
             }),
             FloatGuard())
        .def_readwrite("image", &ImageUse::image)
        .def_readwrite("interpolation", &ImageUse::interpolation)
        .def_readwrite("extension", &ImageUse::extension)
        .def_readwrite("projection", &ImageUse::projection)
        .def_readwrite("projection_blend", &ImageUse::projection_blend)
        .def_readwrite("tiles", &ImageUse::tiles);

    py::class_<NodeProgram>(m, "NodeProgram", py::module_local())
        .def(py::init<>())
        .def(py::init(&make_program),
             FloatGuard(),
             py::arg("ops"),
             py::arg("constants"),
             py::arg("register_count"))
        .def_property_readonly("ops", &list_ops)
        .def_readonly("constants", &NodeProgram::constants)
        .def_readonly("register_count", &NodeProgram::register_count)
        .def_readwrite("images", &NodeProgram::images)
        .def_readwrite("names", &NodeProgram::names)
        .def_readwrite("tables", &NodeProgram::tables);
}

}  // namespace pharos
