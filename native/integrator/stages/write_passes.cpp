#include "core/color.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"
#include "integrator/surface_alpha.h"

namespace pharos {

namespace {

constexpr std::uint32_t kSingleSurface = pass_bit(FilmPass::Position) |
                                         pass_bit(FilmPass::ObjectIndex) |
                                         pass_bit(FilmPass::MaterialIndex);

// Where a path writes a pass that is wanted.
[[nodiscard]] float* place(const RenderContext& context,
                           FilmPass pass,
                           std::uint32_t path,
                           PathBatch& batch) {
    return &batch.root_passes[std::size_t{batch.root[path]} * context.passes.sample_size() +
                              context.passes.offset(pass)];
}

void add(const RenderContext& context,
         FilmPass pass,
         std::uint32_t path,
         const Vec3& value,
         PathBatch& batch) {
    if (context.passes.wants(pass) && is_finite(value)) {
        float* out = place(context, pass, path, batch);
        for (int c = 0; c < 3; ++c) {
            out[c] += value[c];
        }
    }
}

void set(const RenderContext& context,
         FilmPass pass,
         std::uint32_t path,
         std::uint32_t value,
         PathBatch& batch) {
    if (context.passes.wants(pass)) {
        *place(context, pass, path, batch) = static_cast<float>(value);
    }
}

// Third component 1 where the mesh has a map.
[[nodiscard]] Vec3 texture_coordinate(const Scene& scene, const SurfaceInteraction& surface) {
    const Mesh& mesh = scene.description.meshes[scene.instances[surface.instance].mesh];
    if (mesh.uv_maps.empty()) {
        return Vec3(0.0f);
    }
    const Vec2* uv = &mesh.uv_maps.front().uv[std::size_t{3} * surface.triangle];
    const Vec2 at = uv[0] * (1.0f - surface.u - surface.v) + uv[1] * surface.u + uv[2] * surface.v;
    return {at, 1.0f};
}

// How far into the mist a point lies: 0 ... 1.
[[nodiscard]] float mist(const PassesDescription& settings, float distance) {
    const float depth = settings.mist_depth;
    const float linear =
        depth > 0.0f ? std::clamp((distance - settings.mist_start) / depth, 0.0f, 1.0f) : 0.0f;
    return std::pow(linear, settings.mist_falloff);
}

void write_single_surface(const RenderContext& context,
                          const SurfaceInteraction& surface,
                          std::uint32_t path,
                          PathBatch& batch) {
    const Scene& scene = context.scene;
    add(context, FilmPass::Position, path, surface.p + scene.shading.origin, batch);
    if (!scene.pass_index.empty()) {
        set(context, FilmPass::ObjectIndex, path, scene.pass_index[surface.instance], batch);
    }
    const auto& materials = scene.description.passes.material_indices;
    if (surface.material < materials.size()) {
        set(context, FilmPass::MaterialIndex, path, materials[surface.material], batch);
    }
}

void write_surface(const RenderContext& context,
                   std::size_t s,
                   std::uint32_t path,
                   PathBatch& batch) {
    const PassLayout& passes = context.passes;
    const SurfaceInteraction& surface = batch.surfaces[s];
    const Rgb alpha = surface_alpha(context.scene.materials[surface.material], batch.bsdfs[s]);
    bool& done = batch.counters[path].passes_done;
    const bool wants_single = passes.wants_any(kSingleSurface) || !passes.aovs().empty();
    if (!done && wants_single && is_shown(alpha)) {
        write_single_surface(context, surface, path, batch);
        done = true;
    }
    if (passes.wants(FilmPass::Uv)) {
        add(context, FilmPass::Uv, path, texture_coordinate(context.scene, surface), batch);
    }
    if (passes.wants(FilmPass::Mist)) {
        const float near =
            1.0f - mist(context.scene.description.passes, context.camera.distance(surface.p));
        *place(context, FilmPass::Mist, path, batch) += near * average(batch.beta[path] * alpha);
    }
    add(context, FilmPass::Emission, path, batch.beta[path] * batch.closures.emission[s], batch);
}

void write_background(const RenderContext& context, PathBatch& batch) {
    const std::uint32_t visibility = context.scene.description.world.visibility;
    for (std::size_t k = 0; k < batch.escaped.size(); ++k) {
        const std::uint32_t i = batch.escaped[k];
        const std::uint32_t path = batch.active[i];
        if (batch.counters[path].from_camera && (visibility & batch.visibility[i])) {
            const Rgb light = batch.beta[path] * batch.escaped_radiance[k];
            add(context, FilmPass::Environment, path, light, batch);
        }
    }
}

// Adds what a material wrote for one of its hits: values lie `stride` apart, one for each of its
// operations.
void add_aovs(const RenderContext& context,
              const Material& material,
              std::uint32_t path,
              std::span<const Vec3> values,
              std::size_t stride,
              PathBatch& batch) {
    const std::span<const PassLayout::AovPlace> places = context.passes.aovs();
    float* block = &batch.root_passes[std::size_t{batch.root[path]} * context.passes.sample_size()];
    for (std::size_t k = 0; k < material.aovs.closures.size(); ++k) {
        const NodeOp& op = material.aovs.closures[k];
        const Vec3& value = values[k * stride];
        const bool color = op.code == NodeOpCode::AovColor;
        if (op.mode >= places.size() || (places[op.mode].channels == 4) != color ||
            !is_finite(value)) {
            continue;
        }
        float* out = block + places[op.mode].offset;
        const float rgba[4] = {value.x, value.y, value.z, 1.0f};
        for (std::uint32_t c = 0; c < places[op.mode].channels; ++c) {
            out[c] += rgba[c];
        }
    }
}

// As in Cycles: by every surface up to the first that is shown, whole, however clear it is.
void write_surface_aovs(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    std::vector<SurfaceInteraction>& hits = batch.pending_surfaces;
    std::vector<std::uint32_t>& paths = batch.aov_paths;
    std::uint32_t begin = 0;
    for (std::size_t m = 0; m < scene.materials.size() && !batch.surfaces.empty(); ++m) {
        const Material& material = scene.materials[m];
        const std::uint32_t end = batch.material_count[m];  // evaluate_materials() has sorted
        hits.clear();
        paths.clear();
        for (std::uint32_t k = begin; k < end && !material.aovs.closures.empty(); ++k) {
            const std::uint32_t s = batch.material_order[k];
            const PathCounters& counters = batch.counters[batch.surface_path[s]];
            if (counters.from_camera && !counters.passes_done) {
                hits.push_back(batch.surfaces[s]);
                paths.push_back(batch.surface_path[s]);
            }
        }
        begin = end;
        batch.aov_values.resize(hits.size() * material.aovs.closures.size());
        const ShadingContext shading =
            shading_with_paths(scene, hits.size(), batch.path_infos, [&](std::size_t i) {
                return path_info(batch.counters[paths[i]]);
            });
        evaluate_aovs(material, shading, hits, batch.scratch, batch.aov_values);
        for (std::size_t i = 0; i < hits.size(); ++i) {
            const std::span<const Vec3> values(batch.aov_values);
            add_aovs(context, material, paths[i], values.subspan(i), hits.size(), batch);
        }
    }
}

void write_world_aovs(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    if (scene.world.aovs.closures.empty()) {
        return;
    }
    batch.aov_values.resize(scene.world.aovs.closures.size());
    for (const std::uint32_t i : batch.escaped) {
        const std::uint32_t path = batch.active[i];
        const PathCounters& counters = batch.counters[path];
        if (!counters.from_camera || counters.passes_done) {
            continue;
        }
        const SurfaceInteraction hit = world_hit(batch.rays[i].direction);
        const ShadingContext shading = shading_with_paths(
            scene, 1, batch.path_infos, [&](std::size_t) { return world_path_info(counters); });
        evaluate_aovs(scene.world, shading, std::span(&hit, 1), batch.scratch, batch.aov_values);
        add_aovs(context, scene.world, path, batch.aov_values, 1, batch);
    }
}

}  // namespace

std::uint64_t write_passes(const RenderContext& context, PathBatch& batch) {
    if (context.passes.sample_size() == 0) {
        return 0;
    }
    std::uint64_t items = 0;
    if (!context.passes.aovs().empty()) {
        write_surface_aovs(context, batch);
        write_world_aovs(context, batch);
    }
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const std::uint32_t path = batch.surface_path[s];
        if (batch.counters[path].from_camera) {
            write_surface(context, s, path, batch);
            ++items;
        }
    }
    if (context.scene.needs.environment && context.passes.wants(FilmPass::Environment)) {
        write_background(context, batch);
        items += batch.escaped.size();
    }
    return items;
}

}  // namespace pharos
