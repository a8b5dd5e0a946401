// The path tracer: renders passes of a scene into a film on a pool of threads.
//
// Estimator: unidirectional path tracing with next-event estimation and scattering joined by
// multiple importance sampling (Veach 1997, power heuristic); wavefront stages over batches that
// fit a core's cache (Laine et al. 2013 give the reason, stages.h the order). The picture depends
// on the scene and the pass numbers alone, not on the number of threads.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/parallel.h"
#include "film/film.h"
#include "integrator/effort_share.h"
#include "integrator/render_context.h"

namespace pharos {

// A film that a host may read while batches are added: adding takes the lock shared (batches own
// their pixels), reading takes it alone.
struct SharedFilm {
    explicit SharedFilm(const FilmDescription& description, const PassLayout& passes = PassLayout())
        : film(description, passes) {}

    Film film;
    mutable std::shared_mutex mutex;
    std::atomic<std::uint64_t> serial{0};  // batches added
};

// When a pass has to end early: on cancel, or at a deadline (time limits; never adaptive).
struct StopCondition {
    const CancelFlag& cancel;
    std::optional<std::chrono::steady_clock::time_point> deadline;

    [[nodiscard]] bool reached() const {
        return cancel.cancelled() || (deadline && std::chrono::steady_clock::now() >= *deadline);
    }
};

class Integrator {
  public:
    Integrator(const Scene& scene, ThreadPool& pool);
    ~Integrator();

    // Renders a pass, of each batch what the film does not have yet; false when it was stopped
    // before its end (finished batches are in the film).
    bool render_pass(const PassSettings& pass,
                     const GuidingContext& guiding,
                     SharedFilm& film,
                     const StopCondition& stop);

    // Writes the wanted passes about the guide, as it is now, into the film.
    void render_guide_passes(const GuidingContext& guiding, SharedFilm& film);

    // Radiance that arrives at surfaces along `rays`, one path each: all of it, whatever light
    // sampling would have found there. As of rays scattered diffusely.
    void trace_incident(std::span<const Ray> rays, std::uint32_t sample, std::span<Rgb> radiance);

    // What the last pass recorded, gathered from all threads (unordered: sort by key).
    [[nodiscard]] RecordBuffer take_records();

    // Counts training done between passes among the stages.
    void book_training(std::uint64_t records, std::uint64_t nanoseconds);

    [[nodiscard]] std::uint32_t batches_per_sample() const;

    // Of all passes so far, by the scene's names; empty where FilmPass::Effort is not wanted.
    [[nodiscard]] std::vector<EffortShare> effort() const;

    [[nodiscard]] const BatchStatistics& statistics() const { return total_; }

  private:
    struct Worker;

    void render_batch(const RenderContext& context,
                      const struct BatchWork& work,
                      Worker& worker) const;
    void follow_paths(const RenderContext& context, Worker& worker) const;
    std::uint64_t render_guide_batch(const RenderContext& context,
                                     std::uint32_t first_pixel,
                                     Worker& worker,
                                     SharedFilm& film) const;
    void add_up();

    const Scene& scene_;
    ThreadPool& pool_;
    PassLayout passes_;
    Camera camera_;
    FilterSampler filter_;
    std::vector<std::unique_ptr<Worker>> workers_;
    WorkCounter training_;
    BatchStatistics total_;
};

}  // namespace pharos
