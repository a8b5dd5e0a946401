#include <algorithm>
#include <numeric>

#include "core/color.h"
#include "geometry/ray_offset.h"
#include "integrator/mis.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

void add_contribution(PathBatch& batch, const ShadowRay& shadow) {
    add_radiance(batch, shadow.path, shadow.contribution, shadow.emitter);
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

// The surfaces that shadow rays have met, where something may come through; rays that left add what
// they carry.
void collect_transparent(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    batch.shadow_surfaces.clear();
    batch.shadow_places.clear();
    for (std::uint32_t i = 0; i < batch.shadow_rays.size(); ++i) {
        const Hit& hit = batch.hits[i];
        if (hit.instance == kNone) {
            add_contribution(batch, batch.shadow_rays[i]);
            continue;
        }
        const SurfaceInteraction surface = scene.interaction(batch.shadow_queries[i], hit);
        if (scene.materials[surface.material].transparent) {
            batch.shadow_surfaces.push_back(surface);
            batch.shadow_places.push_back(i);
        }
    }
}

// Transmittance of the collected surfaces, material by material.
void evaluate_transmittances(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    const std::size_t count = batch.shadow_surfaces.size();
    const auto material_of = [&](std::uint32_t k) { return batch.shadow_surfaces[k].material; };
    std::vector<std::uint32_t>& order = batch.shadow_order;
    order.resize(count);
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, material_of);
    batch.transmittances.resize(count);
    for (std::size_t begin = 0; begin < count;) {
        const std::uint32_t material = material_of(order[begin]);
        std::size_t end = begin;
        batch.pending_surfaces.clear();
        for (; end < count && material_of(order[end]) == material; ++end) {
            batch.pending_surfaces.push_back(batch.shadow_surfaces[order[end]]);
        }
        batch.pending_radiance.resize(end - begin);
        const ShadingContext shading =
            shading_with_paths(scene, end - begin, batch.path_infos, [&](std::size_t k) {
                const std::uint32_t ray = batch.shadow_places[order[begin + k]];
                return light_path_info(batch.counters[batch.shadow_rays[ray].path], true);
            });
        evaluate_transparency(scene.materials[material],
                              shading,
                              batch.pending_surfaces,
                              batch.scratch,
                              batch.pending_radiance);
        for (std::size_t k = begin; k < end; ++k) {
            batch.transmittances[order[k]] = batch.pending_radiance[k - begin];
        }
        begin = end;
    }
}

// One surface along each remaining shadow ray: contributions are multiplied by its transmittance
// and the ray goes on behind it; opaque surfaces end it.
void pass_one_surface(const RenderContext& context, PathBatch& batch) {
    collect_transparent(context, batch);
    evaluate_transmittances(context, batch);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < batch.shadow_places.size(); ++k) {
        const std::uint32_t i = batch.shadow_places[k];
        const SurfaceInteraction& surface = batch.shadow_surfaces[k];
        const Ray ray = batch.shadow_queries[i];
        ShadowRay shadow = batch.shadow_rays[i];
        shadow.contribution *= batch.transmittances[k];
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
        const std::uint64_t textures = batch.scratch.textures.nanoseconds;
        count_work(batch.transmission, [&] {
            pass_one_surface(context, batch);
            return batch.shadow_surfaces.size();
        });
        batch.transmission.nanoseconds -= batch.scratch.textures.nanoseconds - textures;
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
