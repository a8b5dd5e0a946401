// Weights between next-event estimation and chance hits, in one place for every stage.
#pragma once

#include "core/color.h"
#include "integrator/path_batch.h"
#include "integrator/path_info.h"
#include "integrator/render_context.h"
#include "sampling/mis.h"

namespace pharos {

// Weight of emission met by scattering with `scatter_pdf` that next-event estimation would have
// sampled with `light_pdf` (both per solid angle). Camera rays and delta scattering have no rival.
[[nodiscard]] inline float chance_hit_weight(const RenderContext& context,
                                             float scatter_pdf,
                                             float light_pdf) {
    if (scatter_pdf == 0.0f || !context.settings().use_nee) {
        return 1.0f;
    }
    return power_heuristic(scatter_pdf, light_pdf);
}

// The vertex a chance hit is weighed at, or null where next-event estimation had no part.
[[nodiscard]] inline const LightSampleContext* rival_context(const PathBatch& batch,
                                                             std::uint32_t path) {
    return batch.scatter_pdf[path] > 0.0f ? &batch.origin[path] : nullptr;
}

inline void add_radiance(PathBatch& batch,
                         std::uint32_t path,
                         const Rgb& contribution,
                         std::uint32_t emitter) {
    batch.radiance[path] += contribution;
    if (batch.notes_arrivals) {
        batch.arrivals.push_back({batch.root[path], emitter, luminance(contribution)});
    }
    if (batch.split_scale[path] > 0.0f) {
        batch.recorded_radiance[path] += contribution * batch.split_scale[path];
    }
}

// Emission met by chance, and the density next-event estimation would have had for it.
struct Emitted {
    Rgb L{0.0f};
    float light_pdf = 0.0f;  // solid angle
    std::uint32_t emitter = kNone;
};

// Adds emission met by chance to a path, and tells the record of the scattering that met it.
inline void add_chance_hit(const RenderContext& context,
                           PathBatch& batch,
                           std::uint32_t path,
                           const Emitted& light) {
    const auto& [L, light_pdf, emitter] = light;
    const float weight = chance_hit_weight(context, batch.scatter_pdf[path], light_pdf);
    const Rgb contribution = batch.beta[path] * L * weight;
    add_radiance(batch, path, contribution, emitter);
    if (batch.last_record[path] != kNone) {
        VertexRecord& record = batch.records[batch.last_record[path]];
        record.hit_weighted += contribution * batch.split_scale[path];
        record.selection.hit_radiance += luminance(record.f_cos * L);
        record.selection.hit_pdf_light = context.settings().use_nee ? light_pdf : 0.0f;
    }
}

// Whether a ray sees a lamp or the world: as in Cycles a ray through a translucent surface is one
// of transmission and a diffuse one, too.
[[nodiscard]] inline bool sees_light(const PathCounters& counters,
                                     std::uint32_t ray_bit,
                                     std::uint32_t visibility) {
    const bool diffuse = (counters.ray_kind & ray_kind_bit(LightPathOutput::IsDiffuseRay)) != 0;
    return (visibility & ray_bit) != 0 && (!diffuse || (visibility & kVisibleDiffuse) != 0);
}

// add_chance_hit() of a lamp, whose nodes may have a say.
inline void add_lamp_hit(const RenderContext& context,
                         PathBatch& batch,
                         std::uint32_t path,
                         const Ray& ray,
                         const LightHit& hit) {
    Rgb L = hit.L;
    if (hit.program != kNone) {
        const Scene& scene = context.scene;
        const LampPoint point =
            scene.lights->lamp_point(hit.lamp, ray.origin, ray.direction, hit.distance);
        const SurfaceInteraction at =
            lamp_interaction(scene, point, ray.direction, hit.distance, hit.program);
        const ShadingContext shading =
            shading_with_paths(scene, 1, batch.path_infos, [&](std::size_t) {
                PathInfo info = path_info(batch.counters[path]);
                info.kind = 0;
                return info;
            });
        Rgb emitted(0.0f);
        evaluate_emission(scene.lamp_materials[hit.program],
                          shading,
                          std::span(&at, 1),
                          batch.scratch,
                          std::span(&emitted, 1));
        L *= emitted;
    }
    add_chance_hit(context, batch, path, {L, hit.pdf, hit.light});
}

}  // namespace pharos
