#include "core/color.h"
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
    add(context, FilmPass::Position, path, surface.p, batch);
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
    if (!done && passes.wants_any(kSingleSurface) && is_shown(alpha)) {
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

}  // namespace

std::uint64_t write_passes(const RenderContext& context, PathBatch& batch) {
    if (context.passes.sample_size() == 0) {
        return 0;
    }
    std::uint64_t items = 0;
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
