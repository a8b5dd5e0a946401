#include "session/render_session.h"

#include <algorithm>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>

#include "core/cancel.h"
#include "core/fp_state.h"
#include "integrator/integrator.h"
#include "scene/scene.h"
#include "session/guide_controller.h"
#include "session/pass_schedule.h"

namespace pharos {

namespace {

using Clock = std::chrono::steady_clock;

[[nodiscard]] double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

// CPU time of the process, all threads.
[[nodiscard]] double process_cpu_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Problems that leave nothing to render; empty when there are none.
[[nodiscard]] std::string fatal_problem(const SceneDescription& description) {
    const FilmDescription& film = description.film;
    if (!description.has_camera) {
        return "The scene has no camera: add one and make it the active camera.";
    }
    if (film.crop_width == 0 || film.crop_height == 0) {
        return "The rendered window is empty: check the resolution and the render border.";
    }
    if (film.crop_x + std::uint64_t{film.crop_width} > film.width ||
        film.crop_y + std::uint64_t{film.crop_height} > film.height) {
        return "The rendered window reaches outside the frame.";
    }
    if (description.settings.samples == 0) {
        return "The number of samples is zero.";
    }
    return {};
}

}  // namespace

// Where a render stands at the end of a pass.
struct PassEnd {
    std::uint32_t samples = 0;
    double cpu_seconds = 0.0;
};

struct RenderSession::Impl {
    CancelFlag cancel;
    unsigned threads = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    PassLayout passes;

    mutable std::mutex mutex;  // guards everything below but the film's pixels
    mutable std::condition_variable ended;
    SessionProgress progress;
    SessionStatistics statistics;
    SceneReport report;
    std::vector<std::uint32_t> snapshot_samples;  // ascending
    std::vector<SessionSnapshot> snapshots;
    std::shared_ptr<SharedFilm> film;
    std::uint64_t batches_per_sample = 1;
    std::optional<Clock::time_point> render_begin;

    // Last: joins before anything it uses is destroyed.
    std::jthread driver;

    void run(SceneDescription description);
    void run_built(const BuiltScene& built);
    void render(const Scene& scene, const BuiltScene* built);
    void learn(GuideController& guide,
               Integrator& integrator,
               const BatchStatistics& before,
               ThreadPool& pool);
    void finish_pass(const Integrator& integrator,
                     const GuideController& guide,
                     const PassEnd& end);
    void end(SessionState state, const std::string& error);

    [[nodiscard]] bool is_ended() const { return progress.state >= SessionState::Finished; }
};

void RenderSession::Impl::end(SessionState state, const std::string& error) {
    const std::lock_guard lock(mutex);
    progress.state = state;
    progress.error = error;
    if (render_begin) {
        progress.elapsed = seconds_since(*render_begin);
    }
    progress.remaining = 0.0;
    ended.notify_all();
}

void RenderSession::Impl::run(SceneDescription description) {
    const FloatStateGuard float_state;
    try {
        if (const std::string problem = fatal_problem(description); !problem.empty()) {
            end(SessionState::Failed, problem);
            return;
        }
        SceneReport build_report;
        const Clock::time_point begin = Clock::now();
        const auto scene = build_scene(std::move(description), cancel, build_report);
        {
            const std::lock_guard lock(mutex);
            report = build_report;
            statistics.build_seconds = seconds_since(begin);
        }
        render(*scene, nullptr);
        end(cancel.cancelled() ? SessionState::Cancelled : SessionState::Finished, {});
    } catch (const Cancelled&) {
        end(SessionState::Cancelled, {});
    } catch (const std::bad_alloc&) {
        end(SessionState::Failed, "Out of memory: the scene does not fit.");
    } catch (const std::exception& error) {
        end(SessionState::Failed, error.what());
    }
}

void RenderSession::Impl::run_built(const BuiltScene& built) {
    const FloatStateGuard float_state;
    try {
        if (const std::string problem = fatal_problem(built.scene.description); !problem.empty()) {
            end(SessionState::Failed, problem);
            return;
        }
        render(built.scene, &built);
        end(cancel.cancelled() ? SessionState::Cancelled : SessionState::Finished, {});
    } catch (const std::exception& error) {
        end(SessionState::Failed, error.what());
    }
}

void RenderSession::Impl::render(const Scene& scene, const BuiltScene* built) {
    const RenderSettings& settings = scene.description.settings;
    ThreadPool pool(threads);
    Integrator integrator(scene, pool);
    const auto shared_film = std::make_shared<SharedFilm>(
        scene.description.film, PassLayout(scene.description.passes.wanted));
    const std::uint64_t pixels = std::uint64_t{width} * height;
    const Clock::time_point begin = Clock::now();
    {
        const std::lock_guard lock(mutex);
        film = shared_film;
        render_begin = begin;
        batches_per_sample = integrator.batches_per_sample();
        progress.state = SessionState::Rendering;
        progress.total_samples = settings.samples;
        progress.memory_bytes = scene.bytes() + pixels * (200 + sizeof(double) * passes.size());
    }
    const double cpu_begin = process_cpu_seconds();
    StopCondition stop{cancel, std::nullopt};
    std::optional<GuideController> own_guide;
    GuideController& guide =
        built != nullptr ? built->guide : own_guide.emplace(settings.guiding, scene.bounds, pixels);
    std::uint32_t done = 0;
    while (done < settings.samples) {
        PassSettings pass = next_pass(done, settings.samples, pixels);
        pass.samples = std::min(pass.samples, guide.most_samples(done));
        pass.weight = guide.weight(done);
        const BatchStatistics before = integrator.statistics();
        if (!integrator.render_pass(pass, guide.next_pass(), *shared_film, stop)) {
            finish_pass(integrator, guide, {done, process_cpu_seconds() - cpu_begin});
            return;
        }
        done += pass.samples;
        guide.see(shared_film->film, done);
        learn(guide, integrator, before, pool);
        finish_pass(integrator, guide, {done, process_cpu_seconds() - cpu_begin});
        if (built != nullptr && built->after_pass) {
            built->after_pass(guide);
        }
        if (settings.time_limit > 0.0f) {
            // Only after the first pass: every pixel has a sample by then.
            stop.deadline = begin + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<float>(settings.time_limit));
        }
        if (stop.reached()) {
            break;
        }
    }
    if (shared_film->film.passes().wants_any(kGuidePasses) && !cancel.cancelled()) {
        integrator.render_guide_passes(guide.next_pass(), *shared_film);
        finish_pass(integrator, guide, {done, process_cpu_seconds() - cpu_begin});
    }
}

void RenderSession::Impl::learn(GuideController& guide,
                                Integrator& integrator,
                                const BatchStatistics& before,
                                ThreadPool& pool) {
    if (!guide.learning()) {
        guide.rest();
        return;
    }
    const BatchStatistics& after = integrator.statistics();
    SelectionPass work;
    work.paths = static_cast<double>(after.camera_samples - before.camera_samples);
    work.vertices = static_cast<double>(after.vertices - before.vertices);
    RecordBuffer records = integrator.take_records();
    const std::uint64_t items = records.radiance.size();
    const Clock::time_point begin = Clock::now();
    guide.learn(std::move(records), work, film->film, pool);
    integrator.book_training(items, static_cast<std::uint64_t>(1e9 * seconds_since(begin)));
}

void RenderSession::Impl::finish_pass(const Integrator& integrator,
                                      const GuideController& guide,
                                      const PassEnd& pass_end) {
    const BatchStatistics& batch = integrator.statistics();
    const double noise = [&] {
        const std::shared_lock film_lock(film->mutex);
        return film->film.noise();
    }();
    const std::lock_guard lock(mutex);
    progress.samples = pass_end.samples;
    progress.guiding = guide.status();
    progress.noise = noise;
    progress.nonfinite_samples = batch.nonfinite;
    statistics.stages.clear();
    for (std::size_t i = 0; i < batch.stages.size(); ++i) {
        statistics.stages.push_back({std::string(kStageNames[i]),
                                     batch.stages[i].items,
                                     1e-9 * static_cast<double>(batch.stages[i].nanoseconds)});
    }
    statistics.camera_samples = batch.camera_samples;
    statistics.vertices = batch.vertices;
    statistics.rays = batch.rays;
    statistics.render_cpu_seconds = pass_end.cpu_seconds;
    while (snapshots.size() < snapshot_samples.size() &&
           snapshot_samples[snapshots.size()] <= pass_end.samples) {
        SessionSnapshot snapshot{pass_end.samples, pass_end.cpu_seconds, {}};
        snapshot.combined.resize(std::size_t{width} * height * 4);
        film->film.read(FilmPass::Combined, snapshot.combined);
        snapshots.push_back(std::move(snapshot));
    }
}

RenderSession::RenderSession(SceneDescription description,
                             unsigned threads,
                             std::vector<std::uint32_t> snapshot_samples)
    : impl_(std::make_unique<Impl>()) {
    impl_->threads = threads;
    impl_->width = description.film.crop_width;
    impl_->height = description.film.crop_height;
    impl_->passes = PassLayout(description.passes.wanted);
    std::ranges::sort(snapshot_samples);
    impl_->snapshot_samples = std::move(snapshot_samples);
    impl_->driver = std::jthread([impl = impl_.get(), scene = std::move(description)]() mutable {
        impl->run(std::move(scene));
    });
}

RenderSession::RenderSession(const BuiltScene& built, unsigned threads)
    : impl_(std::make_unique<Impl>()) {
    const SceneDescription& description = built.scene.description;
    impl_->threads = threads;
    impl_->width = description.film.crop_width;
    impl_->height = description.film.crop_height;
    impl_->passes = PassLayout(description.passes.wanted);
    impl_->driver = std::jthread([impl = impl_.get(), built] { impl->run_built(built); });
}

RenderSession::~RenderSession() {
    cancel();
}

void RenderSession::cancel() {
    impl_->cancel.cancel();
}

bool RenderSession::wait(std::chrono::milliseconds time) const {
    std::unique_lock lock(impl_->mutex);
    return impl_->ended.wait_for(lock, time, [&] { return impl_->is_ended(); });
}

SessionProgress RenderSession::progress() const {
    const std::lock_guard lock(impl_->mutex);
    SessionProgress progress = impl_->progress;
    if (!impl_->film) {
        return progress;
    }
    progress.serial = impl_->film->serial.load(std::memory_order_relaxed);
    if (impl_->is_ended()) {
        progress.fraction = progress.state == SessionState::Finished ? 1.0 : progress.fraction;
        return progress;
    }
    progress.elapsed = seconds_since(*impl_->render_begin);
    const double samples =
        static_cast<double>(progress.serial) / static_cast<double>(impl_->batches_per_sample);
    progress.fraction =
        std::min(1.0, samples / std::max(1.0, static_cast<double>(progress.total_samples)));
    progress.remaining = progress.fraction > 0.0
                             ? progress.elapsed * (1.0 - progress.fraction) / progress.fraction
                             : 0.0;
    return progress;
}

SessionStatistics RenderSession::statistics() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->statistics;
}

std::vector<ReportEntry> RenderSession::report() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->report.entries();
}

std::vector<SessionSnapshot> RenderSession::snapshots() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->snapshots;
}

std::uint32_t RenderSession::width() const {
    return impl_->width;
}

std::uint32_t RenderSession::height() const {
    return impl_->height;
}

bool RenderSession::has(FilmPass pass) const {
    return film_pass_info(pass).kind == PassKind::Basic || impl_->passes.wants(pass);
}

bool RenderSession::read(FilmPass pass, std::span<float> out) const {
    if (!has(pass)) {
        return false;
    }
    const std::size_t expected = std::size_t{impl_->width} * impl_->height *
                                 static_cast<std::size_t>(film_pass_channels(pass));
    if (out.size() != expected) {
        throw std::invalid_argument("RenderSession.read: the buffer holds " +
                                    std::to_string(out.size()) + " floats, the pass has " +
                                    std::to_string(expected));
    }
    std::shared_ptr<SharedFilm> film;
    {
        const std::lock_guard lock(impl_->mutex);
        film = impl_->film;
    }
    if (!film) {
        return false;
    }
    const std::unique_lock lock(film->mutex);
    film->film.read(pass, out);
    return true;
}

}  // namespace pharos
