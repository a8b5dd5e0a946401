#include "integrator/effort.h"

#include <algorithm>
#include <functional>
#include <map>

#include "core/color.h"

namespace pharos {

namespace {

void add_to(std::vector<double>& sum, const std::vector<double>& values) {
    sum.resize(std::max(sum.size(), values.size()));
    std::transform(values.begin(), values.end(), sum.begin(), sum.begin(), std::plus());
}

using Names = std::map<std::string, double>;

// Rows of one kind for every name, as shares of `total`.
void add_rows(const Names& names, EffortKind kind, double total, std::vector<EffortShare>& rows) {
    for (const auto& [name, effort] : names) {
        if (effort > kLeastEffortShare * total) {
            rows.push_back({kind, name, effort / total});
        }
    }
}

}  // namespace

void EffortTally::add(const EffortTally& other) {
    add_to(objects, other.objects);
    add_to(lamps, other.lamps);
    add_to(surfaces, other.surfaces);
    world += other.world;
}

std::vector<EffortShare> effort_shares(const EffortTally& tally, const Scene& scene) {
    const SceneDescription& d = scene.description;
    const auto name_of = [&](std::size_t instance) {
        return instance < scene.described.size() ? d.instances[scene.described[instance]].name
                                                 : std::string();
    };
    Names objects;
    Names lights;
    double seen = 0.0;
    double unseen = 0.0;
    for (std::size_t i = 0; i < tally.objects.size(); ++i) {
        const bool hit = i < scene.instances.size();
        (hit ? objects[name_of(i)] : unseen) += tally.objects[i];
        seen += tally.objects[i];
    }
    double lit = tally.world;
    for (std::size_t i = 0; i < tally.lamps.size(); ++i) {
        lights[d.lights[i].name] += tally.lamps[i];
        lit += tally.lamps[i];
    }
    for (std::size_t i = 0; i < tally.surfaces.size(); ++i) {
        lights[name_of(i)] += tally.surfaces[i];
        lit += tally.surfaces[i];
    }
    std::vector<EffortShare> rows;
    add_rows(objects, EffortKind::Object, seen, rows);
    if (unseen > kLeastEffortShare * seen) {
        rows.push_back({EffortKind::Object, "Background", unseen / seen});
    }
    const auto first_light = static_cast<std::ptrdiff_t>(rows.size());
    add_rows(lights, EffortKind::Light, lit, rows);
    if (tally.world > kLeastEffortShare * lit) {
        rows.push_back({EffortKind::World, "World", tally.world / lit});
    }
    const auto by_share = [](const EffortShare& a, const EffortShare& b) {
        return a.share > b.share;
    };
    std::stable_sort(rows.begin(), rows.begin() + first_light, by_share);
    std::stable_sort(rows.begin() + first_light, rows.end(), by_share);
    return rows;
}

void EffortMeter::begin(const RenderContext& context, PathBatch& batch) {
    wanted_ = context.passes.wants(FilmPass::Effort);
    batch.notes_arrivals = wanted_;
    if (!wanted_) {
        return;
    }
    batch.arrivals.clear();
    rays_.assign(batch.roots, 0);
    objects_.assign(batch.roots, kNone);
    tally_.objects.resize(context.scene.instances.size() + 1);
    tally_.lamps.resize(context.scene.description.lights.size());
    tally_.surfaces.resize(context.scene.instances.size());
}

void EffortMeter::take_hits(const PathBatch& batch) {
    if (!wanted_) {
        return;
    }
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        const std::uint32_t path = batch.active[i];
        ++rays_[batch.root[path]];
        if (batch.counters[path].depth == 0) {
            objects_[batch.root[path]] = batch.hits[i].instance;
        }
    }
}

void EffortMeter::take_shadow_rays(const PathBatch& batch) {
    if (!wanted_) {
        return;
    }
    for (const ShadowRay& shadow : batch.shadow_rays) {
        ++rays_[batch.root[shadow.path]];
    }
}

void EffortMeter::book(const PassLayout& passes,
                       std::uint32_t first_pixel,
                       const Film& film,
                       PathBatch& batch) {
    if (!wanted_) {
        return;
    }
    scale_.assign(batch.roots, 0.0);
    for (std::uint32_t root = 0; root < batch.roots; ++root) {
        const std::uint32_t pixel = first_pixel + root;
        const double count = film.samples(pixel);
        if (count == 0.0) {
            continue;  // nothing to differ from
        }
        const auto L = static_cast<double>(luminance(batch.root_sample[root].radiance));
        const double difference = L - film.mean_luminance(pixel);
        // The mean of n samples differs by chance, too.
        const double effort = difference * difference * rays_[root] * count / (count + 1.0);
        const std::uint32_t object = objects_[root];
        tally_.objects[object != kNone ? object : tally_.objects.size() - 1] += effort;
        scale_[root] = difference > 0.0 ? effort / L : 0.0;
        batch.root_passes[std::size_t{root} * passes.sample_size() +
                          passes.offset(FilmPass::Effort)] = static_cast<float>(effort);
    }
    for (const Arrival& arrival : batch.arrivals) {
        const double effort = scale_[arrival.root] * static_cast<double>(arrival.luminance);
        if (!(effort > 0.0)) {
            continue;
        }
        if (arrival.emitter == kWorldEmitter) {
            tally_.world += effort;
        } else if ((arrival.emitter & kSurfaceEmitter) != 0) {
            tally_.surfaces[arrival.emitter & ~kSurfaceEmitter] += effort;
        } else {
            tally_.lamps[arrival.emitter] += effort;
        }
    }
}

}  // namespace pharos
