#include "core/color.h"
#include "integrator/mis.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

void add_world(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    const std::size_t count = batch.escaped.size();
    batch.escaped_radiance.resize(count);
    if (scene.needs.constant_environment) {
        std::ranges::fill(batch.escaped_radiance, scene.constant_world);
    } else {
        batch.escaped_directions.clear();
        for (const std::uint32_t i : batch.escaped) {
            batch.escaped_directions.push_back(batch.rays[i].direction);
        }
        const ShadingContext shading =
            shading_with_paths(scene, count, batch.path_infos, [&](std::size_t k) {
                return world_path_info(batch.counters[batch.active[batch.escaped[k]]]);
            });
        evaluate_world(
            scene.world, shading, batch.escaped_directions, batch.scratch, batch.escaped_radiance);
    }
    const bool sampled = scene.environment != nullptr && !scene.lights->empty();
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t i = batch.escaped[k];
        const std::uint32_t path = batch.active[i];
        if (!sees_light(
                batch.counters[path], batch.visibility[i], scene.description.world.visibility) ||
            (batch.counters[path].from_camera && scene.description.film.transparent)) {
            continue;
        }
        const LightSampleContext* rival = rival_context(batch, path);
        const float light_pdf = sampled && rival
                                    ? scene.lights->pdf_environment(*rival, batch.rays[i].direction)
                                    : 0.0f;
        add_chance_hit(context, batch, path, {batch.escaped_radiance[k], light_pdf, kWorldEmitter});
    }
}

void add_suns(const RenderContext& context, PathBatch& batch) {
    const LightSampler& lights = *context.scene.lights;
    for (const std::uint32_t i : batch.escaped) {
        const std::uint32_t path = batch.active[i];
        if (batch.counters[path].from_camera) {
            continue;  // as in Cycles, the camera itself sees no lamp
        }
        for (std::uint32_t sun = 0; sun < lights.sun_count(); ++sun) {
            const auto hit =
                lights.sun_hit(sun, batch.rays[i].direction, rival_context(batch, path));
            if (hit && sees_light(batch.counters[path], batch.visibility[i], hit->visibility)) {
                add_lamp_hit(context, batch, path, batch.rays[i], *hit);
            }
        }
    }
}

}  // namespace

std::uint64_t add_escaped_radiance(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    batch.escaped.clear();
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        if (batch.hits[i].instance == kNone) {
            batch.escaped.push_back(static_cast<std::uint32_t>(i));
        }
    }
    if (scene.description.film.transparent) {
        for (const std::uint32_t i : batch.escaped) {
            const std::uint32_t path = batch.active[i];
            if (batch.counters[path].from_camera) {
                float& alpha = batch.root_sample[batch.root[path]].alpha;
                alpha = std::max(0.0f, alpha - average(batch.beta[path]));
            }
        }
    }
    if (batch.escaped.empty()) {
        return 0;
    }
    std::uint64_t items = 0;
    if (scene.needs.environment) {
        add_world(context, batch);
        items += batch.escaped.size();
    }
    if (scene.lights->sun_count() > 0) {
        add_suns(context, batch);
        items += batch.escaped.size();
    }
    return items;
}

}  // namespace pharos
