#include "geometry/ray_offset.h"
#include "integrator/stages.h"
#include "sampling/sampler.h"

namespace pharos {

namespace {

constexpr std::uint16_t kFirstRouletteBounce = 2;
constexpr float kMinSurvival = 0.05f;

// Survival by the product of albedos, never by a throughput that sampling densities have shaped.
[[nodiscard]] float survival_probability(const PathCounters& counters, const Rgb& albedo_product) {
    if (counters.bounce < kFirstRouletteBounce) {
        return 1.0f;
    }
    return std::clamp(std::sqrt(max_component(albedo_product)), kMinSurvival, 1.0f);
}

[[nodiscard]] std::uint32_t visibility_after(std::uint8_t lobe) {
    if (lobe & kLobeTransmission) {
        return kVisibleTransmission;
    }
    return lobe & kLobeDiffuse ? kVisibleDiffuse : kVisibleGlossy;
}

// Counters after a scattering that is not straight transparency; sets the flag when a limit is
// reached.
void count_bounce(const RenderSettings& settings, std::uint8_t lobe, PathCounters& counters) {
    ++counters.bounce;
    counters.from_camera = false;
    bool limit = counters.bounce > settings.max_bounces;
    if (lobe & kLobeTransmission) {
        limit |= ++counters.transmission > settings.transmission_bounces;
    } else if (lobe & kLobeDiffuse) {
        limit |= ++counters.diffuse > settings.diffuse_bounces;
    } else {
        limit |= ++counters.glossy > settings.glossy_bounces;
    }
    counters.after_diffuse |= (lobe & kLobeDiffuse) != 0;
    counters.terminate_at_surface |= limit;
}

// The sampled direction as the path's next ray.
void continue_path(const RenderContext& context,
                   std::size_t s,
                   const BsdfSample& sample,
                   PathBatch& batch) {
    const std::uint32_t path = batch.surface_path[s];
    const SurfaceInteraction& surface = batch.surfaces[s];
    PathCounters& counters = batch.counters[path];
    batch.beta[path] *= sample.f_cos / sample.pdf;
    if (is_zero(batch.beta[path])) {
        return;
    }
    ++counters.depth;
    if (sample.lobe & kLobeTransparent) {
        if (++counters.transparent > context.settings().transparent_bounces) {
            return;
        }
        batch.next_visibility.push_back(batch.path_visibility[path]);
    } else {
        count_bounce(context.settings(), sample.lobe, counters);
        batch.scatter_pdf[path] = sample.lobe & kLobeDelta ? 0.0f : sample.pdf;
        batch.origin[path] = {
            surface.p, surface.ns, batch.traits[s].transmission_probability > 0.0f};
        batch.path_visibility[path] = visibility_after(sample.lobe);
        batch.next_visibility.push_back(batch.path_visibility[path]);
    }
    Ray ray;
    ray.origin = offset_ray_origin(surface.p, surface.ng, surface.p_error, sample.wi);
    ray.direction = sample.wi;
    batch.next_active.push_back(path);
    batch.next_rays.push_back(ray);
}

}  // namespace

std::uint64_t sample_scattering(const RenderContext& context, PathBatch& batch) {
    batch.next_active.clear();
    batch.next_rays.clear();
    batch.next_visibility.clear();
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const std::uint32_t path = batch.surface_path[s];
        const PathCounters& counters = batch.counters[path];
        if (batch.bsdfs[s].total_sample_weight <= 0.0f) {
            continue;
        }
        const std::uint32_t set = 2u + 2u * counters.depth;
        const Vec4 u = sobol_4d(batch.sampler_hash[path], batch.sample_index[path], set);
        const float survival = survival_probability(counters, batch.albedo_product[path]);
        if (u.w >= survival) {
            continue;
        }
        const auto sample = sample_bsdf(batch.bsdfs[s], u.x, Vec2(u.y, u.z));
        if (!sample || (counters.terminate_at_surface && !(sample->lobe & kLobeTransparent))) {
            continue;
        }
        batch.beta[path] /= survival;
        batch.albedo_product[path] *= glm::min(batch.traits[s].albedo, Rgb(1.0f));
        continue_path(context, s, *sample, batch);
    }
    batch.active.swap(batch.next_active);
    batch.rays.swap(batch.next_rays);
    batch.visibility.swap(batch.next_visibility);
    return batch.surfaces.size();
}

}  // namespace pharos
