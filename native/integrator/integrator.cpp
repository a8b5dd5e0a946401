#include "integrator/integrator.h"

#include "core/check.h"
#include "integrator/integrator_worker.h"
#include "integrator/stages.h"
#include "sampling/sampler.h"

namespace pharos {

namespace {

constexpr std::uint32_t kIncidentSalt = 0x6a09e667u;
const PassLayout kNoPasses;

// Adds a batch's samples, those of the passes on request first.
void add_to_film(const PathBatch& batch,
                 const PassSettings& pass,
                 const BatchWork& work,
                 const PassLayout& passes,
                 Film& film) {
    const std::size_t size = passes.sample_size();
    for (std::uint32_t root = 0; root < work.pixels; ++root) {
        const std::uint32_t pixel = work.first_pixel + root;
        const std::uint32_t color = (pixel % film.width() + pixel / film.width()) % 2;
        const double weight = pass.weight[color];
        if (size > 0) {
            film.add_passes(pixel, std::span(batch.root_passes).subspan(root * size, size), weight);
        }
        film.add(pixel, batch.root_sample[root], weight, work.sample % 2 == 0);
    }
}

}  // namespace

void BatchStatistics::add(const BatchStatistics& other) {
    for (std::size_t i = 0; i < stages.size(); ++i) {
        stages[i].items += other.stages[i].items;
        stages[i].nanoseconds += other.stages[i].nanoseconds;
    }
    camera_samples += other.camera_samples;
    vertices += other.vertices;
    rays += other.rays;
    nonfinite += other.nonfinite;
}

Integrator::Integrator(const Scene& scene, ThreadPool& pool)
    : scene_(scene),
      pool_(pool),
      passes_(scene.description.passes.wanted, scene.description.passes.aovs),
      camera_(scene.camera(), scene.description.film.width, scene.description.film.height),
      filter_(scene.description.film.filter, scene.description.film.filter_width) {
    for (unsigned worker = 0; worker < pool.size(); ++worker) {
        workers_.push_back(std::make_unique<Worker>());
    }
}

Integrator::~Integrator() = default;

std::uint32_t Integrator::batches_per_sample() const {
    const FilmDescription& film = scene_.description.film;
    return (film.crop_width * film.crop_height + kBatchPaths - 1) / kBatchPaths;
}

void Integrator::render_batch(const RenderContext& context,
                              const BatchWork& work,
                              Worker& worker) const {
    PathBatch& batch = worker.batch;
    BatchStatistics& statistics = worker.statistics;
    worker.timed(Stage::GenerateCameraRays,
                 [&] { return generate_camera_rays(context, work, batch); });
    batch.root_passes.assign(std::size_t{work.pixels} * context.passes.sample_size(), 0.0f);
    statistics.camera_samples += work.pixels;
    follow_paths(context, worker);
}

void Integrator::follow_paths(const RenderContext& context, Worker& worker) const {
    PathBatch& batch = worker.batch;
    BatchStatistics& statistics = worker.statistics;
    LightSplit& split = worker.split;
    split.begin(context, batch);
    worker.effort.begin(context, batch);
    while (!batch.active.empty()) {
        statistics.rays += batch.active.size();
        worker.timed(Stage::IntersectClosest, [&] { return intersect_closest(context, batch); });
        worker.effort.take_hits(batch);
        worker.timed(Stage::AddLampRadiance, [&] { return add_lamp_radiance(context, batch); });
        worker.timed(Stage::AddEscapedRadiance,
                     [&] { return add_escaped_radiance(context, batch); });
        worker.timed(Stage::EvaluateMaterials, [&] { return evaluate_materials(context, batch); });
        statistics.vertices += batch.surfaces.size();
        worker.timed(Stage::AddEmittedRadiance,
                     [&] { return add_emitted_radiance(context, batch); });
        worker.timed(Stage::WritePasses, [&] {
            split.take_hits(context, batch);
            return write_passes(context, batch);
        });
        worker.timed(Stage::QueryGuidingField, [&] { return query_guiding_field(context, batch); });
        worker.timed(Stage::SampleDirectLight, [&] { return sample_direct_light(context, batch); });
        statistics.rays += batch.shadow_rays.size();
        split.before_shadow_rays(context, batch);
        worker.effort.take_shadow_rays(batch);
        worker.timed(Stage::TraceShadowRays, [&] { return trace_shadow_rays(context, batch); });
        split.after_shadow_rays(context, batch);
        worker.timed(Stage::SampleScattering, [&] { return sample_scattering(context, batch); });
        split.take_directions(context, batch);
    }
    worker.timed(Stage::RecordRadiance,
                 [&] { return record_radiance(context, batch, worker.records); });
    statistics.nonfinite += finish_paths(batch);
}

void Integrator::trace_incident(std::span<const Ray> rays,
                                std::uint32_t sample,
                                std::span<Rgb> radiance) {
    CHECK_EQ(rays.size(), radiance.size());
    const RenderContext context{scene_, camera_, filter_, PassSettings{}, {}, kNoPasses};
    const std::uint32_t seed = context.settings().seed;
    const std::size_t batches = (rays.size() + kBatchPaths - 1) / kBatchPaths;
    pool_.parallel_for(batches, [&](std::size_t index, unsigned thread) {
        PathBatch& batch = workers_[thread]->batch;
        const std::size_t first = index * kBatchPaths;
        const std::size_t count = std::min<std::size_t>(kBatchPaths, rays.size() - first);
        batch.begin(static_cast<std::uint32_t>(count));
        for (std::uint32_t path = 0; path < count; ++path) {
            const auto key = static_cast<std::uint32_t>(first) + path;
            batch.begin_path(path, pixel_hash(seed ^ kIncidentSalt, key, 0), sample);
            batch.root_pixel[path] = 0;
            batch.path_visibility[path] = kVisibleDiffuse;
            PathCounters& counters = batch.counters[path];
            counters.depth = counters.bounce = counters.diffuse = 1;
            counters.from_camera = false;
            counters.after_diffuse = true;
            batch.active.push_back(path);
            batch.rays.push_back(rays[first + path]);
            batch.visibility.push_back(kVisibleDiffuse);
        }
        follow_paths(context, *workers_[thread]);
        for (std::uint32_t path = 0; path < count; ++path) {
            radiance[first + path] = batch.root_sample[path].radiance;
        }
    });
}

void Integrator::book_training(std::uint64_t records, std::uint64_t nanoseconds) {
    training_.items += records;
    training_.nanoseconds += nanoseconds;
    total_[Stage::Train] = training_;
}

RecordBuffer Integrator::take_records() {
    RecordBuffer all;
    for (const auto& worker : workers_) {
        RecordBuffer& own = worker->records;
        all.append(own);
        own.clear();
    }
    return all;
}

bool Integrator::render_pass(const PassSettings& pass,
                             const GuidingContext& guiding,
                             SharedFilm& film,
                             const StopCondition& stop) {
    const RenderContext context{scene_, camera_, filter_, pass, guiding, passes_};
    const std::uint32_t pixels = film.film.width() * film.film.height();
    std::atomic<bool> complete{true};
    // A batch is a run of pixels with all of the pass' samples, one after the other.
    pool_.parallel_for(batches_per_sample(), [&](std::size_t index, unsigned thread) {
        Worker& worker = *workers_[thread];
        const auto first = static_cast<std::uint32_t>(index) * kBatchPaths;
        const std::uint32_t count = std::min(kBatchPaths, pixels - first);
        for (std::uint32_t i = 0; i < pass.samples; ++i) {
            if (stop.reached()) {
                complete.store(false, std::memory_order_relaxed);
                return;
            }
            if (film.film.samples(first) > pass.first_sample + i) {
                continue;  // taken before the render was interrupted
            }
            const std::uint32_t sample = pass.offset + pass.first_sample + i;
            render_batch(context, {first, count, sample}, worker);
            worker.timed(Stage::AccumulateFilm, [&] {
                const std::shared_lock lock(film.mutex);
                worker.effort.book(passes_, first, film.film, worker.batch);
                add_to_film(worker.batch, pass, {first, count, sample}, passes_, film.film);
                return count;
            });
            film.serial.fetch_add(1, std::memory_order_relaxed);
        }
    });
    add_up();
    return complete.load();
}

std::vector<EffortShare> Integrator::effort() const {
    EffortTally tally;
    for (const auto& worker : workers_) {
        tally.add(worker->effort.tally());
    }
    return effort_shares(tally, scene_);
}

void Integrator::add_up() {
    total_ = {};
    for (const auto& worker : workers_) {
        total_.add(worker->statistics);
    }
    total_[Stage::Train] = training_;
}

}  // namespace pharos
