// Closure operations: read their operands at one hit and set closures up.
#include <algorithm>

#include "materials/closure_builder.h"
#include "materials/closure_setup.h"
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

// Reads the operands of one operation at one lane, in order.
class OperandReader {
  public:
    OperandReader(const Evaluation& e, const NodeOp& op, std::size_t lane)
        : e_(e), op_(op), lane_(lane) {}

    [[nodiscard]] float scalar() { return e_.operand(op_, next_++).scalar(lane_); }

    [[nodiscard]] Vec3 vector() { return e_.operand(op_, next_++).vector(lane_); }

    // A socket that may be unconnected.
    [[nodiscard]] Vec3 vector_or(const Vec3& fallback) {
        const Operand operand = e_.operand(op_, next_++);
        return operand.is_default() ? fallback : operand.vector(lane_);
    }

    [[nodiscard]] Vec3 normal_or(const Vec3& fallback) {
        const Operand operand = e_.operand(op_, next_++);
        return operand.is_default() ? fallback : normalize_or(operand.vector(lane_), fallback);
    }

  private:
    const Evaluation& e_;
    const NodeOp& op_;
    std::size_t lane_;
    std::uint32_t next_ = 0;
};

void read_inputs(const Evaluation& e,
                 const NodeOp& op,
                 std::size_t lane,
                 const Vec3& ns,
                 ScatterInputs& inputs) {
    OperandReader in(e, op, lane);
    inputs.weight = in.vector();
    inputs.color = in.vector();
    inputs.distribution = static_cast<Distribution>(op.mode & 7);
    switch (op.code) {
        case NodeOpCode::Metallic:
            inputs.edge = in.vector();
            inputs.physical = (op.mode & kPhysicalBit) != 0;
            [[fallthrough]];
        case NodeOpCode::Anisotropic:
            inputs.roughness = in.scalar();
            inputs.anisotropy = in.scalar();
            inputs.rotation = in.scalar();
            inputs.tangent = in.vector_or(Vec3(0.0f));
            break;
        case NodeOpCode::Toon:
            inputs.roughness = in.scalar();
            inputs.smooth = in.scalar();
            inputs.glossy = op.mode != 0;
            break;
        case NodeOpCode::Velvet:
        case NodeOpCode::Sheen:
        case NodeOpCode::Diffuse:
        case NodeOpCode::Glossy:
            inputs.roughness = in.scalar();
            break;
        case NodeOpCode::Glass:
        case NodeOpCode::Refraction:
            inputs.roughness = in.scalar();
            inputs.ior = in.scalar();
            break;
        default:
            break;
    }
    inputs.normal = op.code == NodeOpCode::Transparent ? ns : in.normal_or(ns);
}

void read_inputs(const Evaluation& e,
                 const NodeOp& op,
                 std::size_t lane,
                 const Vec3& ns,
                 PrincipledV1Inputs& v) {
    OperandReader in(e, op, lane);
    v.weight = in.vector();
    v.base_color = in.vector();
    v.subsurface = in.scalar();
    v.subsurface_color = in.vector();
    v.metallic = in.scalar();
    v.specular = in.scalar();
    v.specular_tint = in.scalar();
    v.roughness = in.scalar();
    v.anisotropic = in.scalar();
    v.anisotropic_rotation = in.scalar();
    v.sheen = in.scalar();
    v.sheen_tint = in.scalar();
    v.clearcoat = in.scalar();
    v.clearcoat_roughness = in.scalar();
    v.ior = in.scalar();
    v.transmission = in.scalar();
    v.transmission_roughness = in.scalar();
    v.normal = in.normal_or(ns);
    v.clearcoat_normal = in.normal_or(ns);
    v.tangent = in.vector_or(Vec3(0.0f));
    v.distribution = static_cast<Distribution>(op.mode);
}

void read_inputs(const Evaluation& e,
                 const NodeOp& op,
                 std::size_t lane,
                 const Vec3& ns,
                 PrincipledV2Inputs& v) {
    OperandReader in(e, op, lane);
    v.weight = in.vector();
    v.base_color = in.vector();
    v.metallic = in.scalar();
    v.roughness = in.scalar();
    v.ior = in.scalar();
    v.diffuse_roughness = in.scalar();
    v.subsurface_weight = in.scalar();
    v.specular_ior_level = in.scalar();
    v.specular_tint = in.vector();
    v.anisotropic = in.scalar();
    v.anisotropic_rotation = in.scalar();
    v.transmission_weight = in.scalar();
    v.coat_weight = in.scalar();
    v.coat_roughness = in.scalar();
    v.coat_ior = in.scalar();
    v.coat_tint = in.vector();
    v.sheen_weight = in.scalar();
    v.sheen_roughness = in.scalar();
    v.sheen_tint = in.vector();
    v.emission_color = in.vector();
    v.emission_strength = in.scalar();
    v.thin_film_thickness = in.scalar();
    v.thin_film_ior = in.scalar();
    v.alpha = in.scalar();
    v.normal = in.normal_or(ns);
    v.coat_normal = in.normal_or(ns);
    v.tangent = in.vector_or(Vec3(0.0f));
    v.distribution = static_cast<Distribution>(op.mode);
}

[[nodiscard]] Rgb finite_or_black(const Rgb& c) {
    return Rgb(std::isfinite(c.x) ? c.x : 0.0f,
               std::isfinite(c.y) ? c.y : 0.0f,
               std::isfinite(c.z) ? c.z : 0.0f);
}

[[nodiscard]] ClosureSetupContext context_of(const Evaluation& e, const SurfaceInteraction& hit) {
    return {hit.wo, hit.ns, hit.ng, Vec3(0.0f), e.context.blender_version, hit.front_face};
}

// Radiance of an Emission or Background operation.
[[nodiscard]] Rgb read_emission(const Evaluation& e, const NodeOp& op, std::size_t lane) {
    OperandReader in(e, op, lane);
    const Rgb weight = in.vector();
    const Rgb color = in.vector();
    return finite_or_black(weight * color * in.scalar());
}

// Anisotropic lobes alone need a tangent, which costs more than all else.
template <class Inputs>
void find_tangent(const Evaluation& e,
                  const SurfaceInteraction& hit,
                  const Inputs& inputs,
                  ClosureSetupContext& ctx) {
    if (inputs.anisotropic != 0.0f && is_zero(inputs.tangent)) {
        ctx.tangent = default_tangent(e, hit);
    }
}

// The inputs of one closure operation. Constant ones are read once; only the normals of unconnected
// sockets change from hit to hit then.
template <class Inputs>
class InputSource {
  public:
    InputSource(const Evaluation& e, const NodeOp& op) : e_(e), op_(op), constant_(true) {
        for (std::uint32_t k = 0; k < op.operand_count; ++k) {
            constant_ = constant_ && e.material.program.operands[op.first_operand + k] < 0;
        }
        if (constant_ && e.lanes > 0) {
            read_inputs(e, op, 0, Vec3(0.0f), inputs_);
        }
    }

    [[nodiscard]] bool constant() const { return constant_; }

    [[nodiscard]] Vec3 default_tangent_at(std::size_t lane) const {
        return default_tangent(e_, e_.hit(lane));
    }

    [[nodiscard]] Inputs& at(std::size_t lane, const Vec3& ns) {
        if (!constant_) {
            read_inputs(e_, op_, lane, ns, inputs_);
        } else {
            set_open_normals(ns);
        }
        return inputs_;
    }

  private:
    void set_open_normals(const Vec3& ns);

    // The last operands: a normal, or a normal, the coat's and the tangent.
    [[nodiscard]] bool is_open(std::uint32_t from_end) const {
        const std::size_t number = op_.first_operand + op_.operand_count - from_end;
        return e_.material.program.operands[number] == kDefaultOperand;
    }

    const Evaluation& e_;
    const NodeOp& op_;
    bool constant_;
    Inputs inputs_;
};

template <>
void InputSource<ScatterInputs>::set_open_normals(const Vec3& ns) {
    inputs_.normal = op_.code == NodeOpCode::Transparent || is_open(1) ? ns : inputs_.normal;
}

template <>
void InputSource<PrincipledV1Inputs>::set_open_normals(const Vec3& ns) {
    inputs_.normal = is_open(3) ? ns : inputs_.normal;
    inputs_.clearcoat_normal = is_open(2) ? ns : inputs_.clearcoat_normal;
}

template <>
void InputSource<PrincipledV2Inputs>::set_open_normals(const Vec3& ns) {
    inputs_.normal = is_open(3) ? ns : inputs_.normal;
    inputs_.coat_normal = is_open(2) ? ns : inputs_.coat_normal;
}

using SetupFunction = void (*)(const ScatterInputs&, const ClosureSetupContext&, ClosureSink&);

[[nodiscard]] SetupFunction setup_of(NodeOpCode code) {
    switch (code) {
        case NodeOpCode::Diffuse:
            return setup_diffuse;
        case NodeOpCode::Glossy:
            return setup_glossy;
        case NodeOpCode::Glass:
            return setup_glass;
        case NodeOpCode::Refraction:
            return setup_refraction;
        case NodeOpCode::Translucent:
            return setup_translucent;
        case NodeOpCode::Anisotropic:
            return setup_anisotropic;
        case NodeOpCode::Metallic:
            return setup_metallic;
        case NodeOpCode::Toon:
            return setup_toon;
        case NodeOpCode::Velvet:
            return setup_velvet;
        case NodeOpCode::Sheen:
            return setup_sheen;
        default:
            return setup_transparent;
    }
}

// Where closures of a run of hits go: hit by hit, one operation after the other.
class ClosureWriter {
  public:
    ClosureWriter(const Evaluation& e, ClosureBatch& out)
        : e_(e), out_(out), start_(out.closures.size()), used_(start_) {
        // Room for the most that every hit can have, cut back to what they had.
        out_.closures.resize(used_ + e.material.max_closures * e.lanes);
    }

    ~ClosureWriter() { out_.closures.resize(used_); }

    ClosureWriter(const ClosureWriter&) = delete;
    ClosureWriter& operator=(const ClosureWriter&) = delete;

    // add(hit, context, sink) appends a hit's closures and returns its emission.
    template <class Function>
    void write_hit(std::size_t lane, const Function& add) {
        const SurfaceInteraction& hit = e_.hit(lane);
        const std::size_t slot = e_.hit_index(lane);
        ClosureSetupContext ctx = context_of(e_, hit);
        ClosureSink sink(
            std::span<Closure>(out_.closures).subspan(used_, e_.material.max_closures));
        out_.emission[slot] = add(hit, ctx, sink);
        out_.first[slot] = static_cast<std::uint32_t>(used_);
        out_.count[slot] = static_cast<std::uint32_t>(sink.count());
        out_.dropped_closures += sink.dropped();
        used_ += sink.count();
    }

    // The Lambert closure written last, again, with another normal.
    void repeat_last(std::size_t lane, const Vec3& normal, const ClosureSetupContext& ctx) {
        const std::size_t slot = e_.hit_index(lane);
        const Closure& last = out_.closures[used_ - 1];
        Closure& c = out_.closures[used_];
        c.weight = last.weight;
        c.sample_weight = last.sample_weight;
        c.type = last.type;
        c.n = normal;
        setup::set_bump_terminator(c, ctx);
        out_.first[slot] = static_cast<std::uint32_t>(used_++);
        out_.count[slot] = 1;
        out_.emission[slot] = Rgb(0.0f);
    }

    [[nodiscard]] bool last_is_lambert() const {
        return used_ > start_ && out_.closures[used_ - 1].type == ClosureType::Diffuse;
    }

  private:
    const Evaluation& e_;
    ClosureBatch& out_;
    std::size_t start_;
    std::size_t used_;
};

// Closures of one operation at one hit; returns what it emits.
[[nodiscard]] Rgb add_scatter(InputSource<ScatterInputs>& source,
                              SetupFunction setup,
                              std::size_t lane,
                              ClosureSetupContext& ctx,
                              ClosureSink& sink) {
    const ScatterInputs& inputs = source.at(lane, ctx.ns);
    if (inputs.anisotropy != 0.0f && is_zero(inputs.tangent)) {
        ctx.tangent = source.default_tangent_at(lane);
    }
    setup(inputs, ctx, sink);
    return Rgb(0.0f);
}

[[nodiscard]] Rgb add_principled(const Evaluation& e,
                                 InputSource<PrincipledV1Inputs>& source,
                                 std::size_t lane,
                                 ClosureSetupContext& ctx,
                                 ClosureSink& sink) {
    const PrincipledV1Inputs& inputs = source.at(lane, ctx.ns);
    find_tangent(e, e.hit(lane), inputs, ctx);
    setup_principled_v1(inputs, ctx, sink);
    return Rgb(0.0f);
}

[[nodiscard]] Rgb add_principled(const Evaluation& e,
                                 InputSource<PrincipledV2Inputs>& source,
                                 std::size_t lane,
                                 ClosureSetupContext& ctx,
                                 ClosureSink& sink) {
    const PrincipledV2Inputs& inputs = source.at(lane, ctx.ns);
    find_tangent(e, e.hit(lane), inputs, ctx);
    const Rgb weight = setup_principled_v2(inputs, ctx, sink);
    return finite_or_black(weight * inputs.emission_color * inputs.emission_strength);
}

[[nodiscard]] Rgb add_closures(const Evaluation& e,
                               const NodeOp& op,
                               std::size_t lane,
                               ClosureSetupContext& ctx,
                               ClosureSink& sink) {
    switch (op.code) {
        case NodeOpCode::Emission:
        case NodeOpCode::Background:
            return read_emission(e, op, lane);
        case NodeOpCode::PrincipledV1: {
            InputSource<PrincipledV1Inputs> source(e, op);
            return add_principled(e, source, lane, ctx, sink);
        }
        case NodeOpCode::PrincipledV2: {
            InputSource<PrincipledV2Inputs> source(e, op);
            return add_principled(e, source, lane, ctx, sink);
        }
        default: {
            InputSource<ScatterInputs> source(e, op);
            return add_scatter(source, setup_of(op.code), lane, ctx, sink);
        }
    }
}

// Materials of one closure operation, which most are: what is constant is read once.
template <class Inputs>
void run_principled(const Evaluation& e, const NodeOp& op, ClosureWriter& writer) {
    InputSource<Inputs> source(e, op);
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        writer.write_hit(lane, [&](const auto&, ClosureSetupContext& ctx, ClosureSink& sink) {
            return add_principled(e, source, lane, ctx, sink);
        });
    }
}

void run_scatter(const Evaluation& e, const NodeOp& op, ClosureWriter& writer) {
    InputSource<ScatterInputs> source(e, op);
    const SetupFunction setup = setup_of(op.code);
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        // A constant Lambert closure differs from hit to hit in its normal alone.
        if (lane > 0 && op.code == NodeOpCode::Diffuse && source.constant() &&
            writer.last_is_lambert()) {
            const SurfaceInteraction& hit = e.hit(lane);
            const ClosureSetupContext ctx = context_of(e, hit);
            const Vec3 normal = setup::diffuse_normal(source.at(lane, hit.ns).normal, ctx);
            writer.repeat_last(lane, normal, ctx);
            continue;
        }
        writer.write_hit(lane, [&](const auto&, ClosureSetupContext& ctx, ClosureSink& sink) {
            return add_scatter(source, setup, lane, ctx, sink);
        });
    }
}

}  // namespace

void run_closures(const Evaluation& e, std::span<const NodeOp> ops, ClosureBatch& out) {
    ClosureWriter writer(e, out);
    if (ops.size() == 1) {
        const NodeOp& op = ops.front();
        switch (op.code) {
            case NodeOpCode::Emission:
            case NodeOpCode::Background:
                break;
            case NodeOpCode::PrincipledV1:
                return run_principled<PrincipledV1Inputs>(e, op, writer);
            case NodeOpCode::PrincipledV2:
                return run_principled<PrincipledV2Inputs>(e, op, writer);
            default:
                return run_scatter(e, op, writer);
        }
    }
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        writer.write_hit(lane, [&](const auto&, ClosureSetupContext& ctx, ClosureSink& sink) {
            Rgb emission(0.0f);
            for (const NodeOp& op : ops) {
                emission += add_closures(e, op, lane, ctx, sink);
            }
            return finite_or_black(emission);  // finite ones may add up to what is not
        });
    }
}

void run_emission(const Evaluation& e, std::span<const NodeOp> ops, std::span<Rgb> values) {
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        Rgb sum(0.0f);
        for (const NodeOp& op : ops) {
            if (op.code != NodeOpCode::PrincipledV2) {
                sum += read_emission(e, op, lane);
                continue;
            }
            const SurfaceInteraction& hit = e.hit(lane);
            ClosureSetupContext ctx = context_of(e, hit);
            PrincipledV2Inputs inputs;
            read_inputs(e, op, lane, ctx.ns, inputs);
            const Rgb weight = principled_v2_emission_weight(inputs, ctx);
            sum += finite_or_black(weight * inputs.emission_color * inputs.emission_strength);
        }
        values[lane] = finite_or_black(sum);
    }
}

void run_transparency(const Evaluation& e, std::span<const NodeOp> ops, std::span<Rgb> values) {
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        Rgb sum(0.0f);
        for (const NodeOp& op : ops) {
            Rgb through(0.0f);
            if (op.code == NodeOpCode::Transparent) {
                OperandReader in(e, op, lane);
                const Rgb weight = in.vector();
                through = weight * in.vector();
            } else {
                constexpr std::uint32_t kAlpha = 23;
                const float alpha = e.operand(op, kAlpha).scalar(lane);
                through = e.operand(op, 0).vector(lane) * (1.0f - saturate(alpha));
            }
            sum += glm::max(finite_or_black(through), Rgb(0.0f));
        }
        values[lane] = finite_or_black(sum);
    }
}

}  // namespace pharos::detail
