#include <array>
#include <span>

#include "geometry/ray_offset.h"
#include "integrator/mis.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"
#include "sampling/alias_table.h"
#include "sampling/sampler.h"

namespace pharos {

namespace {

// Shadow rays end just before the light, so that an emissive surface does not shade itself.
constexpr float kShadowEnd = 1.0f - 1e-4f;

// Receivers whose lights are chosen at once.
constexpr std::size_t kTogether = 16;

SurfaceInteraction point_on_emitter(const Scene& scene,
                                    const LightSamplerSample& light,
                                    const Ray& ray) {
    Hit hit;
    hit.t = light.sample.distance;
    hit.u = light.u;
    hit.v = light.v;
    hit.instance = light.instance;
    hit.triangle = light.triangle;
    return scene.interaction(ray, hit);
}

// Densities at the light's direction, for judging what guiding would change (selection.h).
void note_light_sample(const Guide& guide,
                       const LightSample& sample,
                       float bsdf_pdf,
                       float mis_weight,
                       VertexRecord& record) {
    record.nee_scale = sample.pdf / mis_weight;
    record.selection.nee_pdf_light = sample.pdf;
    if (!sample.delta && bsdf_pdf > 0.0f && guide.mixture != nullptr) {
        record.selection.nee_pdf_bsdf = bsdf_pdf;
        record.selection.nee_pdf_guide =
            (1.0f - guide.delta_probability) * mixture_pdf(*guide.mixture, sample.wi);
    }
}

[[nodiscard]] std::uint32_t visibility_of(const Scene& scene, const LightSamplerSample& light) {
    if (light.environment) {
        return scene.description.world.visibility;
    }
    return light.instance != kNone ? scene.instances[light.instance].visibility
                                   : light.sample.visibility;
}

struct Receiver {
    std::size_t surface = 0;
    std::uint32_t path = 0;
};

[[nodiscard]] LightQuery query_of(const Receiver& receiver, const PathBatch& batch) {
    const SurfaceInteraction& surface = batch.surfaces[receiver.surface];
    const std::uint32_t set = 1u + 2u * batch.counters[receiver.path].depth;
    const Vec4 u =
        sobol_4d(batch.sampler_hash[receiver.path], batch.sample_index[receiver.path], set);
    const LightSampleContext receiving{
        surface.p, surface.ns, batch.traits[receiver.surface].transmission_probability > 0.0f};
    return {receiving, widen_random(u.x, Vec2(u.y, u.z)), Vec2(u.y, u.z), {}};
}

[[nodiscard]] std::uint32_t emitter_of(const LightSamplerSample& light) {
    if (light.environment) {
        return kWorldEmitter;
    }
    return light.instance != kNone ? kSurfaceEmitter | light.instance : light.light;
}

// Samples the light that was chosen for a vertex; queues a shadow ray when something may arrive.
void sample_light(const RenderContext& context,
                  const Receiver& receiver,
                  const LightQuery& query,
                  PathBatch& batch) {
    const Scene& scene = context.scene;
    const SurfaceInteraction& surface = batch.surfaces[receiver.surface];
    const Bsdf& bsdf = batch.bsdfs[receiver.surface];
    const PathCounters& counters = batch.counters[receiver.path];
    const auto light = scene.lights->sample(query);
    if (!light || counters.bounce > light->sample.max_bounces) {
        return;
    }
    const LightSample& sample = light->sample;
    const std::uint32_t visibility = visibility_of(scene, *light);
    const BsdfEval scattering = (visibility & kVisibleByLobe) == kVisibleByLobe
                                    ? eval_bsdf(bsdf, sample.wi)
                                    : eval_bsdf_seeing(bsdf, sample.wi, visibility);
    if (is_zero(scattering.f_cos)) {
        return;
    }
    const Guide guide = batch.guides.empty() ? Guide{} : batch.guides[receiver.surface];
    const float weight =
        sample.delta ? 1.0f
                     : power_heuristic(sample.pdf, guided_pdf(guide, scattering.pdf, sample.wi));
    const Rgb factor = batch.beta[receiver.path] * scattering.f_cos * (weight / sample.pdf);

    Ray ray;
    ray.origin = offset_ray_origin(surface.p, surface.ng, surface.p_error, sample.wi);
    ray.direction = sample.wi;
    ray.t_max = std::isfinite(sample.distance) ? sample.distance * kShadowEnd : kInfinity;

    const auto shadow = static_cast<std::uint32_t>(batch.shadow_rays.size());
    Rgb L = sample.L;
    if (light->environment) {
        if (scene.needs.constant_environment) {
            L = scene.constant_world;
        } else {
            L = Rgb(1.0f);
            batch.pending_worlds.push_back({{}, sample.wi, shadow});
        }
    } else if (light->instance != kNone && scene.materials[light->material].emission_constant) {
        L = scene.materials[light->material].emission_estimate;
    } else if (light->instance != kNone) {
        L = Rgb(1.0f);
        batch.pending_triangles.push_back(
            {point_on_emitter(scene, *light, ray), sample.wi, shadow});
    } else if (light->program != kNone) {
        const LampPoint point =
            scene.lights->lamp_point(light->lamp, surface.p, sample.wi, sample.distance);
        batch.pending_lamps.push_back(
            {lamp_interaction(scene, point, sample.wi, sample.distance, light->program),
             sample.wi,
             shadow});
    }
    const std::uint32_t record =
        batch.guides.empty() ? kNone : batch.vertex_record[receiver.surface];
    if (record != kNone) {
        note_light_sample(guide, sample, scattering.pdf, weight, batch.records[record]);
    }
    batch.shadow_rays.push_back({factor * L, receiver.path, record, emitter_of(*light)});
    if (!sample.cast_shadow) {
        ray.t_max = 0.0f;  // an empty interval is never occluded
    }
    batch.shadow_queries.push_back(ray);
}

[[nodiscard]] PathInfo asking_path(const PathBatch& batch, const PendingLight& pending) {
    return light_path_info(batch.counters[batch.shadow_rays[pending.shadow].path], false);
}

// Radiance of the sampled emissive triangles, or lamps with nodes, by material.
void evaluate_pending_emitters(const RenderContext& context,
                               std::span<const Material> materials,
                               std::vector<PendingLight>& pending,
                               PathBatch& batch) {
    const Scene& scene = context.scene;
    std::ranges::stable_sort(pending, {}, [](const PendingLight& p) { return p.emitter.material; });
    for (std::size_t begin = 0; begin < pending.size();) {
        const std::uint32_t material = pending[begin].emitter.material;
        std::size_t end = begin;
        batch.pending_surfaces.clear();
        for (; end < pending.size() && pending[end].emitter.material == material; ++end) {
            batch.pending_surfaces.push_back(pending[end].emitter);
        }
        batch.pending_radiance.resize(end - begin);
        const ShadingContext shading =
            shading_with_paths(scene, end - begin, batch.path_infos, [&](std::size_t i) {
                return asking_path(batch, pending[begin + i]);
            });
        evaluate_emission(materials[material],
                          shading,
                          batch.pending_surfaces,
                          batch.scratch,
                          batch.pending_radiance);
        for (std::size_t i = begin; i < end; ++i) {
            batch.shadow_rays[pending[i].shadow].contribution *= batch.pending_radiance[i - begin];
        }
        begin = end;
    }
}

void evaluate_pending_worlds(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    batch.pending_directions.clear();
    for (const PendingLight& pending : batch.pending_worlds) {
        batch.pending_directions.push_back(pending.direction);
    }
    batch.pending_radiance.resize(batch.pending_directions.size());
    const ShadingContext shading = shading_with_paths(
        scene, batch.pending_worlds.size(), batch.path_infos, [&](std::size_t i) {
            return asking_path(batch, batch.pending_worlds[i]);
        });
    evaluate_world(
        scene.world, shading, batch.pending_directions, batch.scratch, batch.pending_radiance);
    for (std::size_t i = 0; i < batch.pending_worlds.size(); ++i) {
        batch.shadow_rays[batch.pending_worlds[i].shadow].contribution *= batch.pending_radiance[i];
    }
}

}  // namespace

std::uint64_t sample_direct_light(const RenderContext& context, PathBatch& batch) {
    batch.shadow_rays.clear();
    batch.shadow_queries.clear();
    if (!context.scene.needs.nee || !context.settings().use_nee) {
        return 0;
    }
    batch.pending_triangles.clear();
    batch.pending_lamps.clear();
    batch.pending_worlds.clear();
    std::uint64_t items = 0;
    std::array<Receiver, kTogether> receivers;
    std::array<LightQuery, kTogether> queries;
    std::size_t count = 0;
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const std::uint32_t path = batch.surface_path[s];
        const bool smooth =
            batch.bsdfs[s].total_sample_weight > 0.0f && batch.traits[s].delta_probability < 1.0f;
        if (smooth && !batch.counters[path].terminate_at_surface) {
            receivers[count] = {s, path};
            queries[count] = query_of(receivers[count], batch);
            ++count;
            ++items;
        }
        if (count == kTogether || s + 1 == batch.surfaces.size()) {
            context.scene.lights->choose(std::span(queries).first(count));
            for (std::size_t k = 0; k < count; ++k) {
                sample_light(context, receivers[k], queries[k], batch);
            }
            count = 0;
        }
    }
    if (!batch.pending_triangles.empty()) {
        evaluate_pending_emitters(context, context.scene.materials, batch.pending_triangles, batch);
    }
    if (!batch.pending_lamps.empty()) {
        evaluate_pending_emitters(
            context, context.scene.lamp_materials, batch.pending_lamps, batch);
    }
    if (!batch.pending_worlds.empty()) {
        evaluate_pending_worlds(context, batch);
    }
    return items;
}

}  // namespace pharos
