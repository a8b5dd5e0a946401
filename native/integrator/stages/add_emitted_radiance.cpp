#include "integrator/mis.h"
#include "integrator/stages.h"

namespace pharos {

std::uint64_t add_emitted_radiance(const RenderContext& context, PathBatch& batch) {
    const Scene& scene = context.scene;
    if (!scene.needs.emission) {
        return 0;
    }
    std::uint64_t items = 0;
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const Rgb& emission = batch.closures.emission[s];
        if (is_zero(emission)) {
            continue;
        }
        const std::uint32_t path = batch.surface_path[s];
        const SurfaceInteraction& surface = batch.surfaces[s];
        float light_pdf = 0.0f;
        if (const LightSampleContext* rival = rival_context(batch, path)) {
            // Distance from the vertex: transparent surfaces in between restarted the ray.
            const float t = glm::distance(rival->p, surface.p);
            const float cos_light = glm::dot(surface.ng, surface.wo);
            light_pdf = scene.lights->pdf_triangle(
                *rival, surface.instance, surface.triangle, t, cos_light);
        }
        add_chance_hit(
            context, batch, path, {emission, light_pdf, kSurfaceEmitter | surface.instance});
        ++items;
    }
    return items;
}

}  // namespace pharos
