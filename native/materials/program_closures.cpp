// Closure operations: read their operands at one hit and set closures up.
#include <algorithm>

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

[[nodiscard]] ScatterInputs read_scatter(const Evaluation& e,
                                         const NodeOp& op,
                                         std::size_t lane,
                                         const Vec3& ns) {
    OperandReader in(e, op, lane);
    ScatterInputs inputs;
    inputs.weight = in.vector();
    inputs.color = in.vector();
    inputs.distribution = static_cast<Distribution>(op.mode);
    switch (op.code) {
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
    return inputs;
}

[[nodiscard]] PrincipledV1Inputs read_v1(const Evaluation& e,
                                         const NodeOp& op,
                                         std::size_t lane,
                                         const ClosureSetupContext& ctx) {
    OperandReader in(e, op, lane);
    PrincipledV1Inputs v;
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
    v.normal = in.normal_or(ctx.ns);
    v.clearcoat_normal = in.normal_or(ctx.ns);
    v.tangent = in.vector_or(Vec3(0.0f));
    v.distribution = static_cast<Distribution>(op.mode);
    return v;
}

[[nodiscard]] PrincipledV2Inputs read_v2(const Evaluation& e,
                                         const NodeOp& op,
                                         std::size_t lane,
                                         const ClosureSetupContext& ctx) {
    OperandReader in(e, op, lane);
    PrincipledV2Inputs v;
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
    v.normal = in.normal_or(ctx.ns);
    v.coat_normal = in.normal_or(ctx.ns);
    v.tangent = in.vector_or(Vec3(0.0f));
    v.distribution = static_cast<Distribution>(op.mode);
    return v;
}

[[nodiscard]] Rgb finite_or_black(const Rgb& c) {
    return is_finite(c) ? c : Rgb(0.0f);
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

// Appends one operation's closures; returns what it emits.
[[nodiscard]] Rgb add_closures(const Evaluation& e,
                               const NodeOp& op,
                               std::size_t lane,
                               ClosureSetupContext& ctx,
                               ClosureSink& sink) {
    switch (op.code) {
        case NodeOpCode::Diffuse:
            setup_diffuse(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Glossy:
            setup_glossy(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Glass:
            setup_glass(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Refraction:
            setup_refraction(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Transparent:
            setup_transparent(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Translucent:
            setup_translucent(read_scatter(e, op, lane, ctx.ns), ctx, sink);
            break;
        case NodeOpCode::Emission:
        case NodeOpCode::Background:
            return read_emission(e, op, lane);
        case NodeOpCode::PrincipledV1: {
            const PrincipledV1Inputs inputs = read_v1(e, op, lane, ctx);
            find_tangent(e, e.hit(lane), inputs, ctx);
            setup_principled_v1(inputs, ctx, sink);
            break;
        }
        case NodeOpCode::PrincipledV2: {
            const PrincipledV2Inputs inputs = read_v2(e, op, lane, ctx);
            find_tangent(e, e.hit(lane), inputs, ctx);
            const Rgb weight = setup_principled_v2(inputs, ctx, sink);
            return finite_or_black(weight * inputs.emission_color * inputs.emission_strength);
        }
        default:
            break;
    }
    return Rgb(0.0f);
}

}  // namespace

void run_closures(const Evaluation& e, std::span<const NodeOp> ops, ClosureBatch& out) {
    // Room for the most that every hit can have, cut back to what they had.
    const std::size_t most = e.material.max_closures;
    std::size_t used = out.closures.size();
    out.closures.resize(used + most * e.lanes);
    for (std::size_t lane = 0; lane < e.lanes; ++lane) {
        const SurfaceInteraction& hit = e.hit(lane);
        const std::size_t slot = e.hit_index(lane);
        ClosureSetupContext ctx = context_of(e, hit);
        ClosureSink sink(std::span<Closure>(out.closures).subspan(used, most));
        Rgb emission(0.0f);
        for (const NodeOp& op : ops) {
            emission += add_closures(e, op, lane, ctx, sink);
        }
        out.first[slot] = static_cast<std::uint32_t>(used);
        out.count[slot] = static_cast<std::uint32_t>(sink.count());
        out.emission[slot] = emission;
        out.dropped_closures += sink.dropped();
        used += sink.count();
    }
    out.closures.resize(used);
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
            const PrincipledV2Inputs inputs = read_v2(e, op, lane, ctx);
            const Rgb weight = principled_v2_emission_weight(inputs, ctx);
            sum += finite_or_black(weight * inputs.emission_color * inputs.emission_strength);
        }
        values[lane] = sum;
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
        values[lane] = sum;
    }
}

}  // namespace pharos::detail
