#include <array>

#include "core/color.h"
#include "geometry/ray_offset.h"
#include "guiding/roulette.h"
#include "integrator/path_info.h"
#include "integrator/stages.h"
#include "sampling/sampler.h"

namespace pharos {

namespace {

constexpr std::uint16_t kFirstRouletteBounce = 2;
constexpr float kMinSurvival = 0.05f;
constexpr std::size_t kMaxCopies = 8;
constexpr std::uint32_t kCopySalt = 0x5bd1e995u;
constexpr std::uint32_t kGuideSet = 0x10000u;  // sampler sets of the guide's choices

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
    counters.ray_kind = ray_kind_after(lobe);
    counters.straight_length = 0.0f;
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
                   std::uint32_t path,
                   const BsdfSample& sample,
                   PathBatch& batch) {
    const SurfaceInteraction& surface = batch.surfaces[s];
    PathCounters& counters = batch.counters[path];
    ++counters.depth;
    if (sample.lobe & kLobeTransparent) {
        if (++counters.transparent > context.settings().transparent_bounces) {
            return;
        }
        counters.straight_length += surface.t;
    } else {
        count_bounce(context.settings(), sample.lobe, counters);
        batch.scatter_pdf[path] = sample.lobe & kLobeDelta ? 0.0f : sample.pdf;
        batch.origin[path] = {
            surface.p, surface.ns, batch.traits[s].transmission_probability > 0.0f};
        batch.path_visibility[path] = visibility_after(sample.lobe);
    }
    Ray ray;
    ray.origin = offset_ray_origin(surface.p, surface.ng, surface.p_error, sample.wi);
    ray.direction = sample.wi;
    batch.next_active.push_back(path);
    batch.next_rays.push_back(ray);
    batch.next_visibility.push_back(batch.path_visibility[path]);
}

// Completes the open record of the surface with the sampled direction.
void complete_record(
    std::size_t s, std::uint32_t path, const BsdfSample& sample, float survival, PathBatch& batch) {
    VertexRecord& record = batch.records[batch.vertex_record[s]];
    const Guide& guide = batch.guides[s];
    record.complete = true;
    record.wi = sample.wi;
    record.f_cos = sample.f_cos;
    record.beta = batch.beta[path] * batch.split_scale[path];
    record.radiance_before = batch.recorded_radiance[path];
    record.selection.weight /= survival;  // the surviving stand for all
    record.selection.pdf_used = sample.pdf;
    if (guide.mixture != nullptr) {
        record.judged = true;
        record.selection.expected =
            luminance(batch.traits[s].albedo) * guide.mixture->expected * kInvPi;
        const float smooth = 1.0f - guide.delta_probability;
        record.selection.pdf_guide = smooth * mixture_pdf(*guide.mixture, sample.wi);
        record.selection.pdf_bsdf =
            guide.share < 1.0f
                ? std::max(sample.pdf - guide.share * record.selection.pdf_guide, 0.0f) /
                      (1.0f - guide.share)
                : 0.0f;
    }
    batch.last_record[path] = batch.vertex_record[s];
}

// Random numbers of a path's scattering at its vertex: closure, direction (2), roulette.
[[nodiscard]] Vec4 scattering_random(const PathBatch& batch, std::uint32_t path) {
    return sobol_4d(
        batch.sampler_hash[path], batch.sample_index[path], 2u + 2u * batch.counters[path].depth);
}

// One continuation of a vertex.
struct Departure {
    std::uint32_t path = 0;  // its slot
    float survival = 1.0f;   // of the roulette before
    Vec4 u{0.0f};
};

// Samples one continuation of surface s.
void scatter(const RenderContext& context,
             std::size_t s,
             const Departure& departure,
             PathBatch& batch) {
    const auto [path, survival, u] = departure;
    const PathCounters& counters = batch.counters[path];
    const Guide guide = batch.guides.empty() ? Guide{} : batch.guides[s];
    ScatteringRandom random{u.x, 0.0f, Vec2(u.y, u.z)};
    if (guide.share > 0.0f) {
        random.guide =
            sobol_4d(batch.sampler_hash[path], batch.sample_index[path], kGuideSet + counters.depth)
                .x;
    }
    const auto sample = sample_guided(batch.bsdfs[s], guide, random);
    if (!sample || (counters.terminate_at_surface && !(sample->lobe & kLobeTransparent))) {
        return;
    }
    batch.beta[path] *= sample->f_cos / sample->pdf;
    const bool smooth = !(sample->lobe & kLobeDelta);
    if (!(sample->lobe & kLobeTransparent)) {
        batch.last_record[path] = kNone;
    }
    if (smooth && !batch.guides.empty() && batch.vertex_record[s] != kNone &&
        batch.split_scale[path] > 0.0f) {
        complete_record(s, path, *sample, survival, batch);
    }
    if (is_zero(batch.beta[path])) {
        return;
    }
    batch.albedo_product[path] *= glm::min(batch.traits[s].albedo, Rgb(1.0f));
    continue_path(context, s, path, *sample, batch);
}

// Decides by what the guide expects to arrive where it is in use, else by the product of albedos.
RouletteDecision roulette(const RenderContext& context,
                          std::size_t s,
                          float u,
                          const PathBatch& batch) {
    const std::uint32_t path = batch.surface_path[s];
    const GuidingContext& guiding = context.guiding;
    const bool guided = !batch.guides.empty() && batch.guides[s].share > 0.0f;
    const float adjoint_scale = guided ? guiding.adjoint_scale[batch.guides[s].glossy] : 0.0f;
    if (adjoint_scale > 0.0f && !guiding.pixel_estimate.empty()) {
        const float pixel = guiding.pixel_estimate[batch.root_pixel[batch.root[path]]];
        const float r = luminance(batch.beta[path] * batch.traits[s].albedo) *
                        batch.guides[s].mixture->expected * (adjoint_scale * kInvPi) / pixel;
        const bool may_split = batch.counters[path].bounce > 0 && batch.paths < batch.capacity;
        return weight_window(guiding.window, r, may_split, u);
    }
    const float survival = survival_probability(batch.counters[path], batch.albedo_product[path]);
    return u < survival ? RouletteDecision{1, 1.0f / survival} : RouletteDecision{0, 0.0f};
}

// A further copy of `path` in a slot of its own, with random numbers of its own.
std::uint32_t copy_path(std::uint32_t path, std::uint32_t copy, PathBatch& batch) {
    const std::uint32_t slot = batch.paths++;
    batch.root[slot] = batch.root[path];
    batch.sampler_hash[slot] =
        hash_combine(batch.sampler_hash[path] ^ kCopySalt, copy + 8u * batch.counters[path].depth);
    batch.sample_index[slot] = batch.sample_index[path];
    batch.beta[slot] = batch.beta[path];
    batch.radiance[slot] = Rgb(0.0f);
    batch.albedo_product[slot] = batch.albedo_product[path];
    batch.scatter_pdf[slot] = batch.scatter_pdf[path];
    batch.origin[slot] = batch.origin[path];
    batch.counters[slot] = batch.counters[path];
    batch.path_visibility[slot] = batch.path_visibility[path];
    batch.last_record[slot] = kNone;
    batch.split_scale[slot] = 0.0f;
    batch.recorded_radiance[slot] = Rgb(0.0f);
    return slot;
}

// Roulette, splitting and scattering of one vertex.
void leave_vertex(const RenderContext& context, std::size_t s, PathBatch& batch) {
    const std::uint32_t path = batch.surface_path[s];
    const Vec4 u = scattering_random(batch, path);
    const RouletteDecision decision = roulette(context, s, u.w, batch);
    if (decision.copies == 0) {
        return;
    }
    batch.beta[path] *= decision.weight;
    batch.albedo_product[path] *= decision.weight;  // expected throughput of the survivors
    std::array<std::uint32_t, kMaxCopies> slots{path};
    std::size_t count = 1;
    // Fewer free slots than copies: the weight of those that fit grows in proportion.
    const auto wanted = static_cast<std::size_t>(decision.copies);
    while (count < wanted && batch.paths < batch.capacity) {
        slots[count] = copy_path(path, static_cast<std::uint32_t>(count), batch);
        ++count;
    }
    if (count != wanted) {
        const float scale = static_cast<float>(wanted) / static_cast<float>(count);
        for (std::size_t i = 0; i < count; ++i) {
            batch.beta[slots[i]] *= scale;
        }
    }
    if (count > 1 && batch.split_scale[path] > 0.0f) {
        batch.split_scale[path] *= static_cast<float>(count);
    }
    const float survival = decision.weight > 1.0f ? 1.0f / decision.weight : 1.0f;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec4 own = i == 0 ? u : scattering_random(batch, slots[i]);
        scatter(context, s, {slots[i], survival, own}, batch);
    }
}

}  // namespace

std::uint64_t sample_scattering(const RenderContext& context, PathBatch& batch) {
    batch.next_active.clear();
    batch.next_rays.clear();
    batch.next_visibility.clear();
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        if (batch.bsdfs[s].total_sample_weight > 0.0f) {
            leave_vertex(context, s, batch);
        }
    }
    batch.active.swap(batch.next_active);
    batch.rays.swap(batch.next_rays);
    batch.visibility.swap(batch.next_visibility);
    return batch.surfaces.size();
}

}  // namespace pharos
