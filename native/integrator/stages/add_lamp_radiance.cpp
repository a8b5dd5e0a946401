#include "integrator/mis.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

constexpr int kMaxLampsAlongRay = 64;

}  // namespace

std::uint64_t add_lamp_radiance(const RenderContext& context, PathBatch& batch) {
    if (!context.scene.needs.lamps_hittable) {
        return 0;
    }
    const LightSampler& lights = *context.scene.lights;
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        const std::uint32_t path = batch.active[i];
        if (batch.counters[path].from_camera) {
            continue;  // as in Cycles, the camera itself sees no lamp
        }
        const LightSampleContext* rival = rival_context(batch, path);
        Ray ray = batch.rays[i];
        ray.t_max = std::min(ray.t_max, batch.hits[i].t);
        // Lamps are no obstacle: collect all of them up to the surface.
        for (int lamp = 0; lamp < kMaxLampsAlongRay; ++lamp) {
            const auto hit = lights.intersect_lamps(ray, rival);
            if (!hit) {
                break;
            }
            if (sees_light(batch.counters[path], batch.visibility[i], hit->visibility)) {
                add_lamp_hit(context, batch, path, ray, *hit);
            }
            ray.t_min = std::nextafter(hit->distance, kInfinity);
        }
    }
    return batch.active.size();
}

}  // namespace pharos
