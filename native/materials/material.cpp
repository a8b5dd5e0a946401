// Compiling node programs: every index is checked, constants are folded, registers are written
// once, and what no closure reads is dropped.
#include "materials/material.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <utility>

#include "core/visibility.h"
#include "materials/program_layout.h"
#include "materials/program_vm.h"

namespace pharos {

namespace {

using detail::Evaluation;
using detail::find_shape;
using detail::OpKind;
using detail::OpShape;

// Registers of the largest program taken: 16 MB a thread.
constexpr std::uint32_t kMaxRegisters = 16384;
constexpr std::size_t kMaxOutputs = 8;

// What is known of a source register.
struct Source {
    enum class Kind : std::uint8_t { Unwritten, Constant, Register } kind = Kind::Unwritten;
    float value = 0.0f;
    std::int32_t number = 0;
};

class Compiler {
  public:
    Compiler(const NodeProgram& source, Material& material)
        : source_(source), material_(material), out_(material.program) {}

    // Empty, or why the program is broken.
    [[nodiscard]] std::string run();

  private:
    [[nodiscard]] std::string compile_op(const NodeOp& op);
    [[nodiscard]] std::string resolve(std::int32_t code,
                                      std::uint32_t size,
                                      std::int32_t& resolved);
    [[nodiscard]] std::int32_t gather(std::span<const Source> parts);
    void name_tangent_map(NodeOp& op, std::vector<std::int32_t>& operands) const;
    void emit_value(NodeOp op, const OpShape& shape, std::int32_t first_target);
    void fold(NodeOp op, const OpShape& shape, std::int32_t first_target);
    void emit_closure(const NodeOp& op);

    // Whether operand `number` is constant and zero in all components.
    [[nodiscard]] bool is_zero_constant(const NodeOp& op, std::uint32_t number, int size) const;
    [[nodiscard]] std::optional<float> constant_of(const NodeOp& op, std::uint32_t number) const;

    void take_slices();
    void mark_operands(const NodeOp& op, std::vector<std::uint8_t>& live) const;
    [[nodiscard]] std::vector<NodeOp> live_values(std::span<const NodeOp> closures,
                                                  std::vector<std::uint8_t>& live) const;
    void renumber();

    const NodeProgram& source_;
    Material& material_;
    NodeProgram& out_;
    std::vector<Source> registers_;
    std::vector<NodeOp> values_;
    std::int32_t next_register_ = 0;
};

std::string Compiler::run() {
    if (source_.register_count > kMaxRegisters) {
        return "it needs too many registers";
    }
    registers_.assign(source_.register_count, Source());
    out_.constants = source_.constants;
    out_.names = source_.names;
    out_.tables = source_.tables;
    for (std::size_t i = 0; i < source_.ops.size(); ++i) {
        const std::string error = compile_op(source_.ops[i]);
        if (!error.empty()) {
            return "operation " + std::to_string(i) + " " + error;
        }
    }
    take_slices();
    renumber();
    return out_.register_count > kMaxRegisters ? "it needs too many registers" : std::string();
}

std::string Compiler::compile_op(const NodeOp& op) {
    OpShape shape;
    if (!find_shape(source_, op, shape)) {
        return "is unknown, or its mode or its number of operands is";
    }
    const std::uint64_t end = std::uint64_t{op.first_operand} + op.operand_count;
    if (end > source_.operands.size()) {
        return "has operands beyond the list";
    }
    if (shape.kind != OpKind::Closure &&
        (op.output < 0 || std::uint64_t{static_cast<std::uint32_t>(op.output)} + shape.outputs >
                              source_.register_count)) {
        return "writes a register that does not exist";
    }
    // Operands of the compiled operation, one after the other.
    NodeOp compiled = op;
    std::vector<std::int32_t> operands(op.operand_count);
    bool constant = true;
    for (std::uint32_t k = 0; k < op.operand_count; ++k) {
        const std::int32_t code = source_.operands[op.first_operand + k];
        if (code == kDefaultOperand) {
            if (!shape.may_default[k]) {
                return "leaves an operand open that has no default";
            }
            operands[k] = code;
            continue;
        }
        std::string error = resolve(code, shape.size[k], operands[k]);
        if (!error.empty()) {
            return error;
        }
        constant = constant && operands[k] < 0;
    }
    if (op.code == NodeOpCode::NormalMap) {
        name_tangent_map(compiled, operands);
    }
    compiled.first_operand = static_cast<std::uint32_t>(out_.operands.size());
    out_.operands.insert(out_.operands.end(), operands.begin(), operands.end());
    if (shape.kind == OpKind::Closure) {
        emit_closure(compiled);
    } else if (shape.kind == OpKind::Pure && constant) {
        fold(compiled, shape, op.output);
    } else {
        emit_value(compiled, shape, op.output);
    }
    return {};
}

std::string Compiler::resolve(std::int32_t code, std::uint32_t size, std::int32_t& resolved) {
    if (code < 0) {
        if (std::uint64_t{static_cast<std::uint32_t>(~code)} + size > source_.constants.size()) {
            return "reads a constant that does not exist";
        }
        resolved = code;
        return {};
    }
    const auto first = static_cast<std::uint32_t>(code);
    if (std::uint64_t{first} + size > registers_.size()) {
        return "reads a register that does not exist";
    }
    const std::span<const Source> parts = std::span(registers_).subspan(first, size);
    bool constant = true;
    bool consecutive = true;
    for (std::uint32_t k = 0; k < size; ++k) {
        if (parts[k].kind == Source::Kind::Unwritten) {
            return "reads a register before it is written";
        }
        constant = constant && parts[k].kind == Source::Kind::Constant;
        consecutive = consecutive && parts[k].kind == Source::Kind::Register &&
                      parts[k].number == parts[0].number + static_cast<std::int32_t>(k);
    }
    if (constant) {
        resolved = ~static_cast<std::int32_t>(out_.constants.size());
        for (const Source& part : parts) {
            out_.constants.push_back(part.value);
        }
    } else {
        resolved = consecutive ? parts[0].number : gather(parts);
    }
    return {};
}

// Copies registers and constants from various places into registers side by side.
std::int32_t Compiler::gather(std::span<const Source> parts) {
    const std::int32_t first = next_register_;
    for (const Source& part : parts) {
        NodeOp copy;
        copy.mode = 1;
        copy.output = next_register_++;
        copy.first_operand = static_cast<std::uint32_t>(out_.operands.size());
        copy.operand_count = 1;
        if (part.kind == Source::Kind::Constant) {
            out_.operands.push_back(~static_cast<std::int32_t>(out_.constants.size()));
            out_.constants.push_back(part.value);
        } else {
            out_.operands.push_back(part.number);
        }
        values_.push_back(copy);
    }
    return first;
}

// A tangent needs the map, not one point's coordinates: the uv operand becomes its name's index.
void Compiler::name_tangent_map(NodeOp& op, std::vector<std::int32_t>& operands) const {
    op.mode &= 3;
    if (operands.size() < 3) {
        return;
    }
    for (const NodeOp& value : values_) {
        if (value.code == NodeOpCode::Uv && value.output == operands[2] && value.mode < 0x3fff) {
            op.mode = static_cast<std::uint16_t>(op.mode | (value.mode + 1) << 2);
        }
    }
    operands.resize(2);
    op.operand_count = 2;
}

void Compiler::emit_value(NodeOp op, const OpShape& shape, std::int32_t first_target) {
    if (op.code == NodeOpCode::Image || op.code == NodeOpCode::EnvironmentImage) {
        // A use of its own, because whether alpha is read belongs to the operation.
        out_.images.push_back(source_.images[op.mode]);
        op.mode = static_cast<std::uint16_t>(out_.images.size() - 1);
    }
    if (op.code == NodeOpCode::Sky) {
        material_.skies.resize(source_.tables.size());
        material_.skies[op.mode].emplace(detail::read_sky(source_.tables[op.mode]));
    }
    op.output = next_register_;
    for (std::uint32_t k = 0; k < shape.outputs; ++k) {
        registers_[static_cast<std::size_t>(first_target) + k] = {
            Source::Kind::Register, 0.0f, next_register_++};
    }
    values_.push_back(op);
}

void Compiler::fold(NodeOp op, const OpShape& shape, std::int32_t first_target) {
    std::array<float, kMaxOutputs> result{};
    ShadingScratch scratch;
    const ShadingContext context;
    op.output = 0;
    Evaluation e{material_, context, scratch, {}, {}, {}, 1};
    e.registers = result.data();
    detail::run_values(e, std::span(&op, 1));
    for (std::uint32_t k = 0; k < shape.outputs; ++k) {
        registers_[static_cast<std::size_t>(first_target) + k] = {
            Source::Kind::Constant, result[k], 0};
    }
}

bool Compiler::is_zero_constant(const NodeOp& op, std::uint32_t number, int size) const {
    const std::int32_t code = out_.operands[op.first_operand + number];
    if (code >= 0 || code == kDefaultOperand) {
        return false;
    }
    const float* value = &out_.constants[static_cast<std::size_t>(~code)];
    return std::all_of(value, value + size, [](float x) { return x == 0.0f; });
}

std::optional<float> Compiler::constant_of(const NodeOp& op, std::uint32_t number) const {
    const std::int32_t code = out_.operands[op.first_operand + number];
    if (code >= 0 || code == kDefaultOperand) {
        return std::nullopt;
    }
    return out_.constants[static_cast<std::size_t>(~code)];
}

// Files a closure under the questions it answers, and sets the flags.
void Compiler::emit_closure(const NodeOp& op) {
    Material& m = material_;
    std::uint32_t most = 1;
    bool scatters = true;
    if (op.code == NodeOpCode::AovColor || op.code == NodeOpCode::AovValue) {
        m.aovs.closures.push_back(op);
        return;
    }
    if (is_zero_constant(op, 0, 3)) {
        return;
    }
    switch (op.code) {
        case NodeOpCode::Emission:
        case NodeOpCode::Background:
            if (is_zero_constant(op, 1, 3) || is_zero_constant(op, 2, 1)) {
                return;
            }
            m.emission.closures.push_back(op);
            most = 0;
            scatters = false;
            break;
        case NodeOpCode::Transparent:
            if (is_zero_constant(op, 1, 3)) {
                return;
            }
            m.transparency.closures.push_back(op);
            break;
        case NodeOpCode::Glass:
        case NodeOpCode::Refraction:
            most = 2;
            m.transmits = true;
            break;
        case NodeOpCode::Translucent:
            m.transmits = true;
            break;
        case NodeOpCode::PrincipledV1: {
            constexpr std::uint32_t kMetallic = 4;
            constexpr std::uint32_t kTransmission = 15;
            most = 8;
            m.transmits = m.transmits || (constant_of(op, kTransmission).value_or(1.0f) > 0.0f &&
                                          constant_of(op, kMetallic).value_or(0.0f) < 1.0f);
            break;
        }
        case NodeOpCode::PrincipledV2: {
            constexpr std::uint32_t kMetallic = 2;
            constexpr std::uint32_t kTransmission = 11;
            constexpr std::uint32_t kEmissionColor = 19;
            constexpr std::uint32_t kEmissionStrength = 20;
            constexpr std::uint32_t kAlpha = 23;
            most = 8;
            m.transmits = m.transmits || (constant_of(op, kTransmission).value_or(1.0f) > 0.0f &&
                                          constant_of(op, kMetallic).value_or(0.0f) < 1.0f);
            if (!is_zero_constant(op, kEmissionColor, 3) &&
                !is_zero_constant(op, kEmissionStrength, 1)) {
                m.emission.closures.push_back(op);
            }
            if (constant_of(op, kAlpha).value_or(0.0f) < 1.0f) {
                m.transparency.closures.push_back(op);
            }
            break;
        }
        default:
            break;
    }
    m.scatters = m.scatters || scatters;
    m.max_closures += most;
    m.surface.closures.push_back(op);
}

void Compiler::mark_operands(const NodeOp& op, std::vector<std::uint8_t>& live) const {
    OpShape shape;
    static_cast<void>(find_shape(out_, op, shape));
    for (std::uint32_t k = 0; k < op.operand_count; ++k) {
        const std::int32_t code = out_.operands[op.first_operand + k];
        for (std::uint32_t c = 0; code >= 0 && c < shape.size[k]; ++c) {
            live[static_cast<std::size_t>(code) + c] = 1;
        }
    }
}

std::vector<NodeOp> Compiler::live_values(std::span<const NodeOp> closures,
                                          std::vector<std::uint8_t>& live) const {
    live.assign(static_cast<std::size_t>(next_register_), 0);
    for (const NodeOp& op : closures) {
        mark_operands(op, live);
    }
    std::vector<NodeOp> kept;
    for (auto op = values_.rbegin(); op != values_.rend(); ++op) {
        OpShape shape;
        static_cast<void>(find_shape(out_, *op, shape));
        const auto first = live.begin() + op->output;
        if (std::any_of(first, first + shape.outputs, [](std::uint8_t l) { return l != 0; })) {
            mark_operands(*op, live);
            kept.push_back(*op);
        }
    }
    std::reverse(kept.begin(), kept.end());
    return kept;
}

void Compiler::take_slices() {
    Material& m = material_;
    std::vector<std::uint8_t> live;
    m.emission.values = live_values(m.emission.closures, live);
    m.transparency.values = live_values(m.transparency.closures, live);
    m.straight_alpha.assign(out_.images.size(), 0);
    for (ProgramSlice* slice : {&m.surface, &m.aovs}) {
        slice->values = live_values(slice->closures, live);
        for (const NodeOp& op : slice->values) {
            if (op.code == NodeOpCode::Image || op.code == NodeOpCode::EnvironmentImage) {
                m.straight_alpha[op.mode] |= live[static_cast<std::size_t>(op.output) + 3];
                m.textured = true;
            }
            m.asks_path = m.asks_path || op.code == NodeOpCode::LightPath;
        }
    }
    m.max_closures = std::min(m.max_closures, static_cast<std::uint32_t>(kMaxClosures));
    m.constant = m.surface.values.empty();
    m.emits = !m.emission.closures.empty();
    m.transparent = !m.transparency.closures.empty();
}

// Leaves no gaps where operations went. The slices of surface and AOVs hold those of the others
// too.
void Compiler::renumber() {
    constexpr std::int32_t kNowhere = -1;
    std::vector<std::int32_t> place(static_cast<std::size_t>(next_register_), kNowhere);
    std::int32_t next = 0;
    for (const ProgramSlice* slice : {&material_.surface, &material_.aovs}) {
        for (const NodeOp& op : slice->values) {
            OpShape shape;
            static_cast<void>(find_shape(out_, op, shape));
            const auto first = place.begin() + op.output;
            if (*first == kNowhere) {
                std::iota(first, first + shape.outputs, next);
                next += static_cast<std::int32_t>(shape.outputs);
            }
        }
    }
    ProgramSlice* slices[] = {
        &material_.surface, &material_.emission, &material_.transparency, &material_.aovs};
    for (ProgramSlice* slice : slices) {
        for (NodeOp& op : slice->values) {
            op.output = place[static_cast<std::size_t>(op.output)];
        }
    }
    for (std::int32_t& operand : out_.operands) {
        operand = operand >= 0 ? std::max(place[static_cast<std::size_t>(operand)], 0) : operand;
    }
    out_.register_count = static_cast<std::uint32_t>(next);
    out_.ops = material_.surface.values;
    out_.ops.insert(
        out_.ops.end(), material_.surface.closures.begin(), material_.surface.closures.end());
}

[[nodiscard]] NodeProgram grey_diffuse() {
    NodeProgram program;
    program.constants = {1.0f, 1.0f, 1.0f, 0.8f, 0.8f, 0.8f, 0.0f};
    program.operands = {~0, ~3, ~6, kDefaultOperand};
    NodeOp op;
    op.code = NodeOpCode::Diffuse;
    op.operand_count = 4;
    program.ops = {op};
    return program;
}

// Mean emission over made-up hits of a unit cube; images count with their mean.
[[nodiscard]] Rgb estimate_emission(const Material& material, std::span<const Texture> textures) {
    if (!material.emits) {
        return Rgb(0.0f);
    }
    constexpr int kSide = 4;
    std::vector<SurfaceInteraction> hits;
    for (int i = 0; i < (material.constant ? 1 : kSide * kSide * kSide); ++i) {
        SurfaceInteraction hit;
        const glm::ivec3 cell(i % kSide, i / kSide % kSide, i / (kSide * kSide));
        hit.p = (Vec3(cell) + Vec3(0.5f)) / static_cast<float>(kSide);
        hit.ng = hit.ns = hit.wo = Vec3(0.0f, 0.0f, 1.0f);
        hit.instance = hit.triangle = kNone;
        hits.push_back(hit);
    }
    ShadingScratch scratch;
    ShadingContext context;
    context.textures = textures;
    scratch.registers.resize(material.program.register_count * hits.size());
    // As light sees it: no ray of the camera's.
    PathInfo light_ray;
    light_ray.kind = 0;
    const std::vector<PathInfo> paths(hits.size(), light_ray);
    Evaluation e{material, context, scratch, hits, paths, {}, hits.size()};
    e.registers = scratch.registers.data();
    e.estimate = true;
    std::vector<Rgb> values(hits.size());
    detail::run_values(e, material.emission.values);
    detail::run_emission(e, material.emission.closures, values);
    Rgb sum(0.0f);
    for (const Rgb& value : values) {
        sum += glm::max(value, Rgb(0.0f)) / static_cast<float>(values.size());
    }
    return sum;
}

// Of positive constants alone, and not through the layers of a Principled.
[[nodiscard]] bool emits_constantly(const Material& material) {
    const auto plain = [&](const NodeOp& op) { return op.code != NodeOpCode::PrincipledV2; };
    return material.emits && material.constant &&
           std::ranges::all_of(material.emission.closures, plain) &&
           glm::all(glm::greaterThan(material.emission_estimate, Rgb(0.0f)));
}

}  // namespace

Material compile_material(std::string name,
                          const NodeProgram& program,
                          SceneReport& report,
                          std::span<const Texture> textures) {
    Material material;
    const std::string error = Compiler(program, material).run();
    if (!error.empty()) {
        report.add(
            Severity::Error, name, "The node program is broken: " + error + "; grey is shown");
        material = Material();
        static_cast<void>(Compiler(grey_diffuse(), material).run());
    }
    material.name = std::move(name);
    material.emission_estimate = estimate_emission(material, textures);
    material.emission_constant = emits_constantly(material);
    return material;
}

MeanEmission mean_emission(const NodeProgram& program) {
    SceneReport report;
    const Material material = compile_material("", program, report);
    return {material.emission_estimate, material.emission.values.empty()};
}

}  // namespace pharos
