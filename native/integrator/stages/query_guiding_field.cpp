#include "core/color.h"
#include "integrator/narrow_lobe.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

// Roughness under which a lobe is left to itself: the product with a learned field could only blur
// it.
constexpr float kMinGuidedRoughness = 0.05f;
constexpr float kMinGuidedAlpha = kMinGuidedRoughness * kMinGuidedRoughness;

constexpr std::uint32_t kLimitSalt = 0x3c6ef372u;

struct LobeSummary {
    float guidable = 0.0f;  // share of the sample weight that a guide can serve
    float glossy = 0.0f;    // of that, in reflecting microfacet lobes
    const Closure* dominant = nullptr;
};

[[nodiscard]] bool is_microfacet(ClosureType type) {
    return type == ClosureType::GgxReflection || type == ClosureType::GgxRefraction ||
           type == ClosureType::GgxGlass || type == ClosureType::Clearcoat;
}

[[nodiscard]] bool is_transmitting(ClosureType type) {
    return type == ClosureType::GgxRefraction || type == ClosureType::GgxGlass ||
           type == ClosureType::Translucent;
}

[[nodiscard]] LobeSummary summarize(const GuidingContext& guiding, const Bsdf& bsdf) {
    LobeSummary summary;
    float largest = 0.0f;
    for (const Closure& c : bsdf.closures) {
        if (c.type == ClosureType::Transparent ||
            (!guiding.guides_transmission && is_transmitting(c.type))) {
            continue;
        }
        const bool microfacet = is_microfacet(c.type);
        if (microfacet && std::max(c.alpha_x, c.alpha_y) < kMinGuidedAlpha) {
            continue;
        }
        summary.guidable += c.sample_weight;
        summary.glossy += microfacet ? c.sample_weight : 0.0f;
        if (c.sample_weight > largest) {
            largest = c.sample_weight;
            summary.dominant = &c;
        }
    }
    if (bsdf.total_sample_weight > 0.0f) {
        summary.glossy = summary.guidable > 0.0f ? summary.glossy / summary.guidable : 0.0f;
        summary.guidable /= bsdf.total_sample_weight;
    }
    return summary;
}

// Opens a record for a vertex of a recorded path.
std::uint32_t open_record(const RenderContext& context,
                          std::size_t s,
                          bool glossy,
                          PathBatch& batch) {
    const std::uint32_t path = batch.surface_path[s];
    VertexRecord record;
    record.path = path;
    record.vertex = batch.counters[path].depth;
    record.rank = guide_rank(batch.counters[path].bounce, 0.0f);
    record.selection.position = batch.surfaces[s].p;
    record.selection.normal = batch.surfaces[s].ns;
    record.selection.glossy = glossy;
    record.smooth_probability = 1.0f - batch.traits[s].delta_probability;
    record.split_scale = batch.split_scale[path];
    if (!context.guiding.pixel_estimate.empty()) {
        const float pixel = context.guiding.pixel_estimate[batch.root_pixel[batch.root[path]]];
        record.selection.weight = sqr(luminance(batch.beta[path]) * record.split_scale / pixel);
    }
    batch.records.push_back(record);
    return static_cast<std::uint32_t>(batch.records.size() - 1);
}

void queue_query(std::size_t s, const Closure* lobe, PathBatch& batch) {
    const SurfaceInteraction& surface = batch.surfaces[s];
    batch.query_surface.push_back(static_cast<std::uint32_t>(s));
    batch.query_lobe.push_back(lobe);
    for (int axis = 0; axis < 3; ++axis) {
        batch.query[static_cast<std::size_t>(axis)].push_back(surface.p[axis]);
        batch.query[static_cast<std::size_t>(axis) + 3].push_back(surface.ns[axis]);
    }
}

// Of this path's vertex and of nothing else that is drawn for it.
[[nodiscard]] std::uint32_t limit_bits(std::uint32_t path, const PathBatch& batch) {
    const std::uint32_t sample =
        hash_combine(batch.sampler_hash[path] ^ kLimitSalt, batch.sample_index[path]);
    return hash_combine(sample, batch.counters[path].depth);
}

void decide_vertex(const RenderContext& context, std::size_t s, PathBatch& batch) {
    const GuidingContext& guiding = context.guiding;
    const std::uint32_t path = batch.surface_path[s];
    Guide& guide = batch.guides[s];
    guide.delta_probability = batch.traits[s].delta_probability;
    const bool recorded = batch.split_scale[path] > 0.0f;
    if (batch.bsdfs[s].total_sample_weight <= 0.0f || batch.counters[path].terminate_at_surface) {
        return;
    }
    if (!recorded && !guiding.serves()) {
        return;
    }
    const LobeSummary lobes = summarize(guiding, batch.bsdfs[s]);
    if (lobes.guidable < 0.25f) {
        return;
    }
    const bool glossy = lobes.glossy > 0.5f;
    guide.glossy = glossy;
    if (recorded) {
        batch.vertex_record[s] = open_record(context, s, glossy, batch);
    }
    if (guiding.field == nullptr) {
        return;
    }
    const SurfaceInteraction& surface = batch.surfaces[s];
    const float fixed = guiding.fixed_share[glossy ? 1 : 0];
    // No need to look where nothing could come of it.
    const bool decided = fixed >= kLargestShare && !recorded && !guiding.limit.active();
    const float proven = guiding.selection == nullptr || decided
                             ? 0.0f
                             : guiding.selection->alpha(surface.p, surface.ns, glossy);
    const std::uint32_t rank = guide_rank(batch.counters[path].bounce, proven);
    const bool asked = recorded && guiding.probe;
    guide.share = std::max(fixed, proven);
    if (guiding.limit.active() && !asked && !guiding.limit.admits(rank, limit_bits(path, batch))) {
        guide.share = 0.0f;
    }
    if (recorded) {
        batch.records[batch.vertex_record[s]].rank = rank;
    }
    if (guide.share > 0.0f || asked) {
        queue_query(s, lobes.dominant, batch);
    }
}

}  // namespace

std::uint64_t query_guiding_field(const RenderContext& context, PathBatch& batch) {
    if (!context.guiding.active()) {
        // Whatever a guided pass left behind must not speak for this one.
        batch.guides.clear();
        batch.vertex_record.clear();
        return 0;
    }
    const std::size_t count = batch.surfaces.size();
    batch.guides.assign(count, Guide{});
    batch.vertex_record.assign(count, kNone);
    batch.query_surface.clear();
    batch.query_lobe.clear();
    for (auto& values : batch.query) {
        values.clear();
    }
    for (std::size_t s = 0; s < count; ++s) {
        decide_vertex(context, s, batch);
    }
    const std::size_t queries = batch.query_surface.size();
    if (queries == 0) {
        return 0;
    }
    if (batch.mixtures.size() < queries) {
        batch.mixtures.resize(queries);
    }
    const FieldQuery query{batch.query[0],
                           batch.query[1],
                           batch.query[2],
                           batch.query[3],
                           batch.query[4],
                           batch.query[5]};
    context.guiding.field->evaluate(query, std::span(batch.mixtures).first(queries));
    for (std::size_t q = 0; q < queries; ++q) {
        const std::uint32_t s = batch.query_surface[q];
        if (context.guiding.multiplies) {
            const Closure* dominant = batch.query_lobe[q];
            const NarrowLobe lobe =
                dominant == nullptr ? NarrowLobe{} : narrow_lobe(*dominant, batch.bsdfs[s].wo);
            if (lobe.kappa > 0.0f) {
                batch.mixtures[q] = multiply_lobe(batch.mixtures[q], lobe.axis, lobe.kappa);
            }
        }
        batch.guides[s].mixture = &batch.mixtures[q];
    }
    return queries;
}

}  // namespace pharos
