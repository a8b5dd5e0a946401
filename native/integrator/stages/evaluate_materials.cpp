#include <numeric>

#include "integrator/path_info.h"
#include "integrator/stages.h"
#include "integrator/surface_alpha.h"

namespace pharos {

namespace {

void collect_surfaces(const RenderContext& context, PathBatch& batch) {
    batch.surface_path.clear();
    batch.surfaces.clear();
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        if (batch.hits[i].instance != kNone) {
            batch.surface_path.push_back(batch.active[i]);
            batch.surfaces.push_back(context.scene.interaction(batch.rays[i], batch.hits[i]));
        }
    }
}

// Counting sort of the surfaces by material, stable.
void group_by_material(const RenderContext& context, PathBatch& batch) {
    const std::size_t materials = context.scene.materials.size();
    batch.material_count.assign(materials + 1, 0);
    for (const SurfaceInteraction& surface : batch.surfaces) {
        ++batch.material_count[surface.material + 1];
    }
    std::partial_sum(
        batch.material_count.begin(), batch.material_count.end(), batch.material_count.begin());
    batch.material_order.resize(batch.surfaces.size());
    for (std::uint32_t s = 0; s < batch.surfaces.size(); ++s) {
        batch.material_order[batch.material_count[batch.surfaces[s].material]++] = s;
    }
}

// Caustics switches: after a diffuse bounce, glossy closures are dropped (cycles-parity 2.4).
void drop_caustics(const RenderSettings& settings, PathBatch& batch) {
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        if (!batch.counters[batch.surface_path[s]].after_diffuse) {
            continue;
        }
        Closure* closures = &batch.closures.closures[batch.closures.first[s]];
        for (std::uint32_t c = 0; c < batch.closures.count[s]; ++c) {
            const ClosureType type = closures[c].type;
            const bool reflects = type == ClosureType::GgxReflection ||
                                  type == ClosureType::GgxGlass || type == ClosureType::Clearcoat;
            const bool refracts =
                type == ClosureType::GgxRefraction || type == ClosureType::GgxGlass;
            if ((reflects && !settings.caustics_reflective) ||
                (refracts && !settings.caustics_refractive)) {
                closures[c].weight = Rgb(0.0f);
                closures[c].sample_weight = 0.0f;
            }
        }
    }
}

void make_bsdfs(PathBatch& batch) {
    const std::size_t count = batch.surfaces.size();
    batch.bsdfs.resize(count);
    batch.traits.resize(count);
    for (std::size_t s = 0; s < count; ++s) {
        const std::span<const Closure> closures(
            batch.closures.closures.data() + batch.closures.first[s], batch.closures.count[s]);
        float total = 0.0f;
        for (const Closure& closure : closures) {
            total += closure.sample_weight;
        }
        batch.bsdfs[s] = {closures, batch.surfaces[s].wo, batch.surfaces[s].ng, total};
        batch.traits[s] = bsdf_traits(batch.bsdfs[s]);
    }
}

// First hits give depth and normal; the first vertex that is not a mirror or pane gives the
// features a denoiser wants.
void write_features(const RenderContext& context, PathBatch& batch) {
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const std::uint32_t path = batch.surface_path[s];
        PathCounters& counters = batch.counters[path];
        if (counters.features_done) {
            continue;
        }
        FilmSample& sample = batch.root_sample[batch.root[path]];
        const SurfaceInteraction& surface = batch.surfaces[s];
        const Material& material = context.scene.materials[surface.material];
        if (counters.from_camera && sample.depth == FilmSample{}.depth &&
            is_shown(surface_alpha(material, batch.bsdfs[s]))) {
            sample.depth = context.camera.depth(surface.p);
            sample.normal = surface.ns;
        }
        if (batch.traits[s].delta_probability < 0.5f) {
            sample.albedo = glm::clamp(batch.beta[path] * batch.traits[s].albedo, 0.0f, 1.0f);
            sample.guide_normal = surface.ns;
            counters.features_done = true;
        }
    }
}

}  // namespace

std::uint64_t evaluate_materials(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    collect_surfaces(context, batch);
    if (batch.surfaces.empty()) {
        return 0;
    }
    group_by_material(context, batch);
    batch.closures.reset(batch.surfaces.size());
    const ShadingContext shading =
        shading_with_paths(scene, batch.surfaces.size(), batch.path_infos, [&](std::size_t s) {
            return path_info(batch.counters[batch.surface_path[s]]);
        });
    std::uint32_t begin = 0;
    for (std::size_t m = 0; m < scene.materials.size(); ++m) {
        const std::uint32_t end = batch.material_count[m];  // after the sort: one past the group
        if (end > begin) {
            evaluate_surfaces(scene.materials[m],
                              shading,
                              batch.surfaces,
                              std::span(batch.material_order).subspan(begin, end - begin),
                              batch.scratch,
                              batch.closures);
        }
        begin = end;
    }
    const RenderSettings& settings = context.settings();
    if (!settings.caustics_reflective || !settings.caustics_refractive) {
        drop_caustics(settings, batch);
    }
    make_bsdfs(batch);
    write_features(context, batch);
    return batch.surfaces.size();
}

}  // namespace pharos
