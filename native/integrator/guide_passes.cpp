// What the guide believes at the first hits of a picture, seen once a render through a few camera
// rays a pixel: the mixture that would be sampled there, and the share it would get.
#include <array>

#include "integrator/integrator.h"
#include "integrator/integrator_worker.h"
#include "integrator/stages.h"

namespace pharos {

namespace {

constexpr std::uint32_t kSamples = 4;

struct GuideSum {
    Vec3 resultant{0.0f};  // sum of the mixtures' mean directions, unnormalised
    float irradiance = 0.0f;
    float share = 0.0f;
    float count = 0.0f;  // samples that met a surface the guide can serve
};

// The mean of a direction drawn from the mixture.
[[nodiscard]] Vec3 mean_direction(const VmfMixture& mixture) {
    Vec3 mean(0.0f);
    for (int k = 0; k < mixture.lobe_count; ++k) {
        const VmfLobe lobe = mixture.lobe(k);
        mean += mixture.weight[k] * vmf_mean_cosine(lobe.kappa) * lobe.mu;
    }
    return mean;
}

void add_mixtures(const PathBatch& batch, std::span<GuideSum> sums) {
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        const Guide& guide = batch.guides[s];
        if (guide.mixture == nullptr) {
            continue;
        }
        GuideSum& sum = sums[batch.root[batch.surface_path[s]]];
        sum.resultant += mean_direction(*guide.mixture);
        sum.irradiance += guide.mixture->A;
        sum.share += guide.share;
        sum.count += 1.0f;
    }
}

void write_pixel(const GuideSum& sum, std::uint32_t pixel, Film& film) {
    const auto write = [&](FilmPass pass, std::span<const float> values) {
        if (film.passes().wants(pass)) {
            film.set_pass(pass, pixel, values);
        }
    };
    if (sum.count == 0.0f) {
        return;
    }
    const Vec3 mean = sum.resultant / sum.count;
    const Vec3 direction = normalize_or(mean, Vec3(0.0f));
    const float kappa = vmf_kappa_from_mean_cosine(glm::length(mean));
    // Like other passes these two fade towards the background.
    const float irradiance = sum.irradiance / static_cast<float>(kSamples);
    const float share = sum.share / static_cast<float>(kSamples);
    write(FilmPass::GuideDirection, std::array{direction.x, direction.y, direction.z});
    write(FilmPass::GuideKappa, std::array{kappa});
    write(FilmPass::GuideIrradiance, std::array{irradiance});
    write(FilmPass::GuideShare, std::array{share});
}

}  // namespace

std::uint64_t Integrator::render_guide_batch(const RenderContext& context,
                                             std::uint32_t first_pixel,
                                             Worker& worker,
                                             SharedFilm& film) const {
    const std::uint32_t pixels = film.film.width() * film.film.height();
    const std::uint32_t count = std::min(kBatchPaths, pixels - first_pixel);
    PathBatch& batch = worker.batch;
    std::vector<GuideSum> sums(count);
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) {
        generate_camera_rays(context, {first_pixel, count, sample}, batch);
        intersect_closest(context, batch);
        evaluate_materials(context, batch);
        query_guiding_field(context, batch);
        add_mixtures(batch, sums);
    }
    batch.records.clear();
    const std::shared_lock lock(film.mutex);
    for (std::uint32_t i = 0; i < count; ++i) {
        write_pixel(sums[i], first_pixel + i, film.film);
    }
    return std::uint64_t{count} * kSamples;
}

void Integrator::render_guide_passes(const GuidingContext& guiding, SharedFilm& film) {
    if (!passes_.wants_any(kGuidePasses) || guiding.field == nullptr) {
        return;
    }
    // Every path is recorded, so that the field is asked at every hit it can serve.
    GuidingContext asking = guiding;
    asking.record = asking.probe = true;
    asking.record_probability = 1.0f;
    const RenderContext context{scene_, camera_, filter_, PassSettings{}, asking, passes_};
    pool_.parallel_for(batches_per_sample(), [&](std::size_t index, unsigned thread) {
        Worker& worker = *workers_[thread];
        worker.timed(Stage::WritePasses, [&] {
            return render_guide_batch(
                context, static_cast<std::uint32_t>(index) * kBatchPaths, worker, film);
        });
    });
    add_up();
    film.serial.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace pharos
