// The four questions asked of a material, and the order of operations.
#include "materials/program_vm.h"

#include <algorithm>

#include "core/check.h"

namespace pharos {

namespace detail {

namespace {

using RunFunction = void (*)(const Evaluation&, const NodeOp&);

// By NodeOpCode.
constexpr RunFunction kRun[] = {
    run_copy,
    run_uv,
    run_geometry,
    run_coordinate,
    run_image,
    run_environment_image,
    run_scalar_to_vector,
    run_luminance,
    run_vector_average,
    run_math,
    run_vector_math,
    run_mix_color,
    run_mix_float,
    run_mapping,
    run_ramp,
    run_combine,
    run_fresnel,
    run_layer_weight,
    run_normal_map,
    run_object_info,
    run_camera_data,
    run_light_path,
    run_map_range,
    run_vector_map_range,
    run_clamp,
    run_invert,
    run_gamma,
    run_bright_contrast,
    run_hue_saturation,
    run_curves,
    run_separate_color,
    run_combine_color,
    run_checker,
    run_gradient,
    run_vector_transform,
    run_vector_rotate,
    run_blackbody,
    run_noise,
    run_musgrave,
    run_white_noise,
    run_voronoi,
    run_wave,
    run_magic,
    run_brick,
    run_bump,
    run_attribute,
    run_instance_attribute,
    run_tangent,
    run_sky,
};

}  // namespace

void run_values(const Evaluation& e, std::span<const NodeOp> ops) {
    Vec2 shifted(0.0f);
    for (const NodeOp& op : ops) {
        if (op.step.x == 0.0f && op.step.y == 0.0f) {
            kRun[static_cast<std::size_t>(op.code)](e, op);
            continue;
        }
        // Bump mapping: the same operation a little beside every hit.
        if (op.step != shifted) {
            shift_hits(e, op.step);
            shifted = op.step;
        }
        Evaluation beside = e;
        beside.hits = std::span<const SurfaceInteraction>(e.scratch.shifted).first(e.lanes);
        beside.paths = {};
        beside.index = {};
        kRun[static_cast<std::size_t>(op.code)](beside, op);
    }
}

}  // namespace detail

namespace {

using detail::Evaluation;
using detail::kMaxLanes;

// Calls function(evaluation) for runs of at most kMaxLanes hits.
template <class Function>
void for_each_run(const Material& material,
                  const ShadingContext& context,
                  ShadingScratch& scratch,
                  std::span<const SurfaceInteraction> hits,
                  std::span<const std::uint32_t> index,
                  std::span<const NodeOp> values,
                  const Function& function) {
    const std::size_t total = index.empty() ? hits.size() : index.size();
    if (!values.empty()) {
        scratch.registers.resize(
            std::max(scratch.registers.size(),
                     std::size_t{material.program.register_count} * std::min(total, kMaxLanes)));
    }
    for (std::size_t first = 0; first < total; first += kMaxLanes) {
        const std::size_t lanes = std::min(kMaxLanes, total - first);
        Evaluation e{material, context, scratch, hits, context.paths, {}, lanes};
        if (index.empty()) {
            e.hits = hits.subspan(first, lanes);
            e.paths = context.paths.empty() ? context.paths : context.paths.subspan(first, lanes);
        } else {
            e.index = index.subspan(first, lanes);
        }
        e.registers = scratch.registers.data();
        detail::run_values(e, values);
        function(e, first);
    }
}

}  // namespace

void ClosureBatch::reset(std::size_t hits) {
    closures.clear();
    first.assign(hits, 0);
    count.assign(hits, 0);
    emission.assign(hits, Rgb(0.0f));
}

void evaluate_surfaces(const Material& material,
                       const ShadingContext& context,
                       std::span<const SurfaceInteraction> hits,
                       std::span<const std::uint32_t> index,
                       ShadingScratch& scratch,
                       ClosureBatch& out) {
    CHECK_EQ(out.first.size(), hits.size());
    CHECK(context.paths.empty() || context.paths.size() == hits.size());
    if (index.empty()) {
        return;
    }
    for_each_run(material,
                 context,
                 scratch,
                 hits,
                 index,
                 material.surface.values,
                 [&](const Evaluation& e, std::size_t) {
                     detail::run_closures(e, material.surface.closures, out);
                 });
}

void evaluate_emission(const Material& material,
                       const ShadingContext& context,
                       std::span<const SurfaceInteraction> hits,
                       ShadingScratch& scratch,
                       std::span<Rgb> emission) {
    CHECK_EQ(emission.size(), hits.size());
    for_each_run(material,
                 context,
                 scratch,
                 hits,
                 {},
                 material.emission.values,
                 [&](const Evaluation& e, std::size_t first) {
                     detail::run_emission(
                         e, material.emission.closures, emission.subspan(first, e.lanes));
                 });
}

void evaluate_transparency(const Material& material,
                           const ShadingContext& context,
                           std::span<const SurfaceInteraction> hits,
                           ShadingScratch& scratch,
                           std::span<Rgb> transmittance) {
    CHECK_EQ(transmittance.size(), hits.size());
    for_each_run(material,
                 context,
                 scratch,
                 hits,
                 {},
                 material.transparency.values,
                 [&](const Evaluation& e, std::size_t first) {
                     detail::run_transparency(
                         e, material.transparency.closures, transmittance.subspan(first, e.lanes));
                 });
}

void evaluate_aovs(const Material& material,
                   const ShadingContext& context,
                   std::span<const SurfaceInteraction> hits,
                   ShadingScratch& scratch,
                   std::span<Vec3> values) {
    CHECK_EQ(values.size(), hits.size() * material.aovs.closures.size());
    for_each_run(material,
                 context,
                 scratch,
                 hits,
                 {},
                 material.aovs.values,
                 [&](const Evaluation& e, std::size_t first) {
                     Vec3* out = values.data() + first;
                     for (const NodeOp& op : material.aovs.closures) {
                         const detail::Operand value = e.operand(op, 0);
                         for (std::size_t lane = 0; lane < e.lanes; ++lane) {
                             out[lane] = op.code == NodeOpCode::AovColor ? value.vector(lane)
                                                                         : Vec3(value.scalar(lane));
                         }
                         out += hits.size();
                     }
                 });
}

SurfaceInteraction world_hit(const Vec3& direction) {
    SurfaceInteraction hit;
    hit.p = direction;
    hit.wo = hit.ns = hit.ng = -direction;  // normals face us
    hit.instance = kNone;
    hit.triangle = kNone;
    return hit;
}

void evaluate_world(const Material& world,
                    const ShadingContext& context,
                    std::span<const Vec3> directions,
                    ShadingScratch& scratch,
                    std::span<Rgb> radiance) {
    CHECK_EQ(radiance.size(), directions.size());
    std::vector<SurfaceInteraction>& hits = scratch.hits;
    hits.resize(std::max(hits.size(), std::min(directions.size(), kMaxLanes)));
    ShadingContext part = context;
    for (std::size_t first = 0; first < directions.size(); first += kMaxLanes) {
        const std::size_t lanes = std::min(kMaxLanes, directions.size() - first);
        for (std::size_t i = 0; i < lanes; ++i) {
            hits[i] = world_hit(directions[first + i]);
        }
        if (!context.paths.empty()) {
            part.paths = context.paths.subspan(first, lanes);
        }
        evaluate_emission(world,
                          part,
                          std::span<const SurfaceInteraction>(hits).first(lanes),
                          scratch,
                          radiance.subspan(first, lanes));
    }
}

}  // namespace pharos
