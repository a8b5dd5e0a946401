#include <array>
#include <optional>
#include <span>

#include "integrator/mis.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

constexpr int kMaxLampsAlongRay = 64;
constexpr std::size_t kTogether = 16;

// Lamps are no obstacle: collects all of them up to the surface.
void add_lamps(const RenderContext& context,
               std::span<const std::size_t> places,
               std::span<LampRay> rays,
               PathBatch& batch) {
    const LightSampler& lights = *context.scene.lights;
    std::array<std::optional<LightHit>, kTogether> hits;
    lights.intersect_lamps(rays, hits);
    for (std::size_t k = 0; k < rays.size(); ++k) {
        Ray& ray = rays[k].ray;
        const std::uint32_t path = batch.active[places[k]];
        for (int lamp = 0; hits[k] && lamp < kMaxLampsAlongRay; ++lamp) {
            if (sees_light(
                    batch.counters[path], batch.visibility[places[k]], hits[k]->visibility)) {
                add_lamp_hit(context, batch, path, ray, *hits[k]);
            }
            ray.t_min = std::nextafter(hits[k]->distance, kInfinity);
            hits[k] = lights.intersect_lamps(ray, rays[k].context);
        }
    }
}

}  // namespace

std::uint64_t add_lamp_radiance(const RenderContext& context, PathBatch& batch) {
    if (!context.scene.needs.lamps_hittable) {
        return 0;
    }
    std::array<std::size_t, kTogether> places;
    std::array<LampRay, kTogether> rays;
    std::size_t count = 0;
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        const std::uint32_t path = batch.active[i];
        if (!batch.counters[path].from_camera) {  // as in Cycles, the camera itself sees no lamp
            places[count] = i;
            rays[count] = {batch.rays[i], rival_context(batch, path)};
            rays[count].ray.t_max = std::min(batch.rays[i].t_max, batch.hits[i].t);
            ++count;
        }
        if (count == kTogether || i + 1 == batch.active.size()) {
            add_lamps(context, std::span(places).first(count), std::span(rays).first(count), batch);
            count = 0;
        }
    }
    return batch.active.size();
}

}  // namespace pharos
