#include "core/color.h"
#include "geometry/ray_offset.h"
#include "integrator/mis.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

void add_contribution(PathBatch& batch, const ShadowRay& shadow) {
    add_radiance(batch, shadow.path, shadow.contribution);
    if (shadow.record != kNone) {
        VertexRecord& record = batch.records[shadow.record];
        record.selection.nee_radiance =
            record.nee_scale *
            luminance(divide_or_zero(shadow.contribution, batch.beta[shadow.path]));
    }
}

// Scenes without transparent materials: any hit blocks.
void trace_opaque(const RenderContext& context, PathBatch& batch) {
    batch.occluded.resize(batch.shadow_rays.size());
    context.scene.accelerator->occluded(batch.shadow_queries, batch.occluded);
    for (std::size_t i = 0; i < batch.shadow_rays.size(); ++i) {
        if (!batch.occluded[i]) {
            add_contribution(batch, batch.shadow_rays[i]);
        }
    }
}

// One surface along each remaining shadow ray: contributions are multiplied by its transmittance
// and the ray goes on behind it; opaque surfaces end it. Rays that leave add what they carry.
void pass_one_surface(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    const ShadingContext shading =
        shading_with_paths(scene, 1, batch.path_infos, [](std::size_t) { return PathInfo(); });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < batch.shadow_rays.size(); ++i) {
        const Hit& hit = batch.hits[i];
        if (hit.instance == kNone) {
            add_contribution(batch, batch.shadow_rays[i]);
            continue;
        }
        const Ray ray = batch.shadow_queries[i];
        const SurfaceInteraction surface = scene.interaction(ray, hit);
        const Material& material = scene.materials[surface.material];
        if (!material.transparent) {
            continue;
        }
        Rgb transmittance(0.0f);
        if (scene.needs.light_path) {
            batch.path_infos[0] = light_path_info(batch.counters[batch.shadow_rays[i].path], true);
        }
        evaluate_transparency(
            material, shading, std::span(&surface, 1), batch.scratch, std::span(&transmittance, 1));
        ShadowRay shadow = batch.shadow_rays[i];
        shadow.contribution *= transmittance;
        if (is_zero(shadow.contribution)) {
            continue;
        }
        Ray onward = ray;
        onward.origin = offset_ray_origin(surface.p, surface.ng, surface.p_error, ray.direction);
        onward.t_max = ray.t_max - surface.t;
        if (!(onward.t_max > 0.0f)) {
            add_contribution(batch, shadow);
            continue;
        }
        batch.shadow_rays[kept] = shadow;
        batch.shadow_queries[kept] = onward;
        ++kept;
    }
    batch.shadow_rays.resize(kept);
    batch.shadow_queries.resize(kept);
}

void trace_transparent(const RenderContext& context, PathBatch& batch) {
    const std::uint32_t limit = context.settings().transparent_bounces;
    for (std::uint32_t surface = 0; surface <= limit && !batch.shadow_rays.empty(); ++surface) {
        const std::size_t count = batch.shadow_rays.size();
        batch.visibility.assign(count, kVisibleShadow);
        context.scene.accelerator->intersect(
            batch.shadow_queries, batch.visibility, std::span(batch.hits).first(count));
        pass_one_surface(context, batch);
    }
}

}  // namespace

std::uint64_t trace_shadow_rays(const RenderContext& context, PathBatch& batch) {
    const std::size_t count = batch.shadow_rays.size();
    if (count == 0) {
        return 0;
    }
    if (context.scene.needs.transparency) {
        trace_transparent(context, batch);
    } else {
        trace_opaque(context, batch);
    }
    return count;
}

}  // namespace pharos
