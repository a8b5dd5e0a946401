// Node programs built by hand, and single operations run over many lanes.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <random>
#include <vector>

#include "core/scene_report.h"
#include "materials/material.h"

namespace pharos::test {

// Appends operations as the exporter does.
struct ProgramBuilder {
    NodeProgram program;

    std::int32_t constant(std::initializer_list<float> values) {
        return constant(std::vector<float>(values));
    }

    std::int32_t constant(const std::vector<float>& values) {
        const auto first = static_cast<std::int32_t>(program.constants.size());
        program.constants.insert(program.constants.end(), values.begin(), values.end());
        return ~first;
    }

    // Returns the first register written.
    std::int32_t add(NodeOpCode code,
                     std::uint16_t mode,
                     const std::vector<std::int32_t>& operands,
                     std::uint32_t outputs) {
        NodeOp op;
        op.code = code;
        op.mode = mode;
        op.first_operand = static_cast<std::uint32_t>(program.operands.size());
        op.operand_count = static_cast<std::uint32_t>(operands.size());
        program.operands.insert(program.operands.end(), operands.begin(), operands.end());
        if (outputs > 0) {
            op.output = static_cast<std::int32_t>(program.register_count);
            program.register_count += outputs;
        }
        program.ops.push_back(op);
        return op.output;
    }

    std::int32_t geometry(GeometryOutput output) {
        return add(NodeOpCode::Geometry, static_cast<std::uint16_t>(output), {}, 3);
    }

    // Emission of strength 1 that shows three registers or constants.
    void show(std::int32_t color) {
        add(NodeOpCode::Emission, 0, {constant({1, 1, 1}), color, constant({1})}, 0);
    }

    // Shows one scalar in all channels.
    void show_scalar(std::int32_t value) { show(add(NodeOpCode::ScalarToVector, 0, {value}, 3)); }
};

[[nodiscard]] inline Material compile(const NodeProgram& program,
                                      std::span<const Texture> textures = {}) {
    SceneReport report;
    Material material = compile_material("test", program, report, textures);
    EXPECT_TRUE(report.entries().empty())
        << (report.entries().empty() ? "" : report.entries()[0].message);
    return material;
}

[[nodiscard]] inline std::vector<Rgb> emission_of(const Material& material,
                                                  std::span<const SurfaceInteraction> hits,
                                                  const ShadingContext& context = {}) {
    ShadingScratch scratch;
    std::vector<Rgb> values(hits.size());
    evaluate_emission(material, context, hits, scratch, values);
    return values;
}

// An operation under test: `sizes` are its operands' components. Values of one lane are listed
// operand after operand.
struct OpCase {
    NodeOpCode code = NodeOpCode::Copy;
    std::uint16_t mode = 0;
    std::vector<std::uint32_t> sizes;
    std::uint32_t outputs = 1;
    std::vector<std::vector<float>> tables;
};

// The first three results of each lane. The first four operands come from registers (so that
// nothing is folded) unless `folded`; those after them are constants of lane 0.
[[nodiscard]] inline std::vector<Rgb> run_op(const OpCase& test,
                                             const std::vector<std::vector<float>>& lanes,
                                             bool folded) {
    constexpr GeometryOutput kInputs[] = {GeometryOutput::Position,
                                          GeometryOutput::Normal,
                                          GeometryOutput::TrueNormal,
                                          GeometryOutput::Incoming};
    ProgramBuilder b;
    b.program.tables = test.tables;
    std::vector<SurfaceInteraction> hits(lanes.size());
    std::vector<std::int32_t> operands;
    std::size_t offset = 0;
    for (std::size_t k = 0; k < test.sizes.size(); ++k) {
        if (folded || k >= 4) {
            const auto first = lanes[0].begin() + static_cast<long>(offset);
            operands.push_back(b.constant(std::vector<float>(first, first + test.sizes[k])));
        } else {
            operands.push_back(b.geometry(kInputs[k]));
            for (std::size_t i = 0; i < lanes.size(); ++i) {
                Vec3 v(0.0f);
                for (std::uint32_t c = 0; c < test.sizes[k]; ++c) {
                    v[static_cast<int>(c)] = lanes[i][offset + c];
                }
                Vec3* const targets[] = {&hits[i].p, &hits[i].ns, &hits[i].ng, &hits[i].wo};
                *targets[k] = v;
            }
        }
        offset += test.sizes[k];
    }
    const std::int32_t result = b.add(test.code, test.mode, operands, test.outputs);
    if (test.outputs >= 3) {
        b.show(result);
    } else {
        b.show_scalar(result);
    }
    const Material material = compile(b.program);
    EXPECT_EQ(material.constant, folded);
    return emission_of(material, hits);
}

[[nodiscard]] inline std::vector<std::vector<float>> random_lanes(std::size_t lanes,
                                                                  std::size_t values,
                                                                  float lower,
                                                                  float upper) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> value(lower, upper);
    std::vector<std::vector<float>> result(lanes, std::vector<float>(values));
    for (auto& lane : result) {
        for (float& v : lane) {
            v = value(random);
        }
    }
    return result;
}

}  // namespace pharos::test
