#include "session/render_session.h"

#include <algorithm>
#include <condition_variable>
#include <ctime>
#include <functional>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/cancel.h"
#include "core/checksum.h"
#include "core/fp_state.h"
#include "core/memory.h"
#include "integrator/integrator.h"
#include "scene/scene.h"
#include "scene/scene_hash.h"
#include "session/field_file.h"
#include "session/guide_controller.h"
#include "session/memory_estimate.h"
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
[[nodiscard]] std::string fatal_problem(const SceneDescription& description,
                                        const SessionOptions& options) {
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
    if (description.settings.samples >
        std::numeric_limits<std::uint32_t>::max() - options.sample_offset) {
        return "The samples reach beyond what can be counted.";
    }
    if (!options.field.empty() && !options.field_learns &&
        description.settings.guiding == GuidingMode::Off) {
        return "There is a guide to load, but guiding is off.";
    }
    return {};
}

// Only a checkpoint needs it: it takes as long as writing the scene to memory.
[[nodiscard]] RenderIdentity identify(SceneDescription& description,
                                      const SessionOptions& options) {
    RenderIdentity identity;
    if (options.checkpoint.path.empty()) {
        return identity;
    }
    identity.scene = scene_hash(description);
    identity.field = options.field.empty() ? 0 : fnv1a(std::span(options.field));
    identity.seed = description.settings.seed;
    identity.offset = options.sample_offset;
    identity.guiding = description.settings.guiding;
    identity.width = description.film.crop_width;
    identity.height = description.film.crop_height;
    return identity;
}

// The guide learns on from an earlier render's.
[[nodiscard]] bool goes_on(const SessionOptions& options, GuidingMode mode) {
    return options.field_learns && !options.field.empty() && mode != GuidingMode::Off;
}

[[nodiscard]] SessionOptions with_threads(unsigned threads) {
    SessionOptions options;
    options.threads = threads;
    return options;
}

// A render's end by its time limit. Thirty years are enough: more is more than the clock can count.
[[nodiscard]] Clock::time_point deadline_after(Clock::time_point begin, float seconds) {
    constexpr float kMostSeconds = 1e9f;
    return begin + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<float>(std::min(seconds, kMostSeconds)));
}

constexpr const char* kOutOfMemory = "Out of memory: the scene does not fit.";

}  // namespace

// What the passes of a render work on.
struct RenderSession::Work {
    ThreadPool& pool;
    Integrator& integrator;
    SharedFilm& film;
    GuideController& guide;
    RenderPosition position;
    std::uint64_t nonfinite_before = 0;  // in the checkpoint it went on from
    double cpu_begin = process_cpu_seconds();
    bool live = false;  // another picture waits for the end of a cancelled one
    std::function<void(const GuideController&)> after_pass = {};
};

struct RenderSession::Impl {
    using Work = RenderSession::Work;

    CancelFlag cancel;
    SessionOptions options;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    PassLayout passes;
    std::vector<AovDescription> aovs;

    mutable std::mutex mutex;  // guards everything below but the film's pixels
    mutable std::condition_variable ended;
    SessionProgress progress;
    SessionStatistics statistics;
    SceneReport report;
    std::vector<SessionSnapshot> snapshots;
    std::shared_ptr<SharedFilm> film;
    std::uint64_t batches_per_sample = 1;
    std::optional<Clock::time_point> render_begin;
    std::vector<std::byte> field;
    std::vector<EffortShare> effort;

    // Last: joins before anything it uses is destroyed.
    std::jthread driver;

    void run(SceneDescription description);
    void run_built(const BuiltScene& built);
    void render(const Scene& scene, const RenderIdentity& identity, const BuiltScene* built);
    [[nodiscard]] GuideController make_guide(const Scene& scene);
    void resume(const Scene& scene, const CheckpointKeeper& keeper, Work& work);
    void begin(const Scene& scene, const Work& work);
    void render_passes(const RenderSettings& settings, CheckpointKeeper& keeper, Work& work);
    [[nodiscard]] bool render_pass(const PassSettings& pass, const StopCondition& stop, Work& work);
    void learn(Work& work);
    void keep(CheckpointKeeper& keeper, const Work& work);
    void finish_pass(const Work& work);
    void note(Severity severity, const std::string& object, const std::string& message);
    void end(SessionState state, const std::string& error);

    // Checks the size of `out`, then lets `copy` take it from the newest film.
    bool read(std::size_t channels,
              std::span<const float> out,
              const std::function<void(const Film&)>& copy) const;

    [[nodiscard]] bool is_ended() const { return progress.state >= SessionState::Finished; }
};

void RenderSession::Impl::end(SessionState state, const std::string& error) {
    const std::lock_guard lock(mutex);
    progress.state = state;
    progress.error = error;
    progress.out_of_memory = error == kOutOfMemory;
    if (render_begin) {
        progress.elapsed = seconds_since(*render_begin);
    }
    progress.remaining = 0.0;
    ended.notify_all();
}

void RenderSession::Impl::note(Severity severity,
                               const std::string& object,
                               const std::string& message) {
    const std::lock_guard lock(mutex);
    report.add(severity, object, message);
}

bool RenderSession::Impl::read(std::size_t channels,
                               std::span<const float> out,
                               const std::function<void(const Film&)>& copy) const {
    const std::size_t expected = std::size_t{width} * height * channels;
    if (out.size() != expected) {
        throw std::invalid_argument("RenderSession.read: the buffer holds " +
                                    std::to_string(out.size()) + " floats, the pass has " +
                                    std::to_string(expected));
    }
    std::shared_ptr<SharedFilm> newest;
    {
        const std::lock_guard lock(mutex);
        newest = film;
    }
    if (!newest) {
        return false;
    }
    const std::unique_lock lock(newest->mutex);
    copy(newest->film);
    return true;
}

void RenderSession::Impl::run(SceneDescription description) {
    const FloatStateGuard float_state;
    try {
        if (const std::string problem = fatal_problem(description, options); !problem.empty()) {
            end(SessionState::Failed, problem);
            return;
        }
        SceneReport build_report;
        const Clock::time_point begin = Clock::now();
        if (estimate_memory(description) > available_memory()) {
            throw std::bad_alloc();
        }
        const RenderIdentity identity = identify(description, options);
        if (goes_on(options, description.settings.guiding)) {
            // Samples that do not know those which the guide has learned from.
            description.settings.seed ^=
                static_cast<std::uint32_t>(fnv1a(std::span(options.field)));
        }
        const auto scene = build_scene(std::move(description), cancel, build_report);
        {
            const std::lock_guard lock(mutex);
            report = build_report;
            statistics.build_seconds = seconds_since(begin);
        }
        render(*scene, identity, nullptr);
        end(cancel.cancelled() ? SessionState::Cancelled : SessionState::Finished, {});
    } catch (const Cancelled&) {
        end(SessionState::Cancelled, {});
    } catch (const std::exception& error) {
        end(SessionState::Failed, is_out_of_memory(error) ? kOutOfMemory : error.what());
    }
}

void RenderSession::Impl::run_built(const BuiltScene& built) {
    const FloatStateGuard float_state;
    try {
        const SceneDescription& description = built.scene.description;
        if (const std::string problem = fatal_problem(description, options); !problem.empty()) {
            end(SessionState::Failed, problem);
            return;
        }
        render(built.scene, RenderIdentity{}, &built);
        end(cancel.cancelled() ? SessionState::Cancelled : SessionState::Finished, {});
    } catch (const std::exception& error) {
        end(SessionState::Failed, is_out_of_memory(error) ? kOutOfMemory : error.what());
    }
}

GuideController RenderSession::Impl::make_guide(const Scene& scene) {
    const NextPicture next{
        scene.description.settings.guiding, scene.bounds, std::uint64_t{width} * height};
    if (goes_on(options, next.mode)) {
        try {
            return continue_field(options.field, next);
        } catch (const StateError& error) {
            note(Severity::Info, "Path guiding", std::string("Learned anew: ") + error.what());
        }
    }
    GuideController guide(next.mode, next.scene_box, next.pixels);
    const std::uint64_t samples = next.pixels * scene.description.settings.samples;
    if (!options.field_learns && !options.field.empty()) {
        freeze_field(options.field, next.mode, guide);
    } else if (!passes.wants_any(kGuidePasses)) {
        if (samples < options.least_guided_samples) {
            guide.stay_out();
        } else if (samples / kQuietSamplesFactor < options.least_guided_samples) {
            guide.stay_out_if_quiet();
        }
    }
    return guide;
}

// Goes on from the checkpoint, if there is one to go on from.
void RenderSession::Impl::resume(const Scene& scene, const CheckpointKeeper& keeper, Work& work) {
    if (!keeper.finds()) {
        return;
    }
    try {
        work.position = keeper.read(work.film.film, work.guide);
    } catch (const StateError& error) {
        if (options.checkpoint.resume == Resume::Must) {
            throw;
        }
        note(Severity::Info, "Checkpoint", std::string("Rendered anew: ") + error.what());
        work.film.film =
            Film(scene.description.film,
                 PassLayout(scene.description.passes.wanted, scene.description.passes.aovs));
        work.guide = make_guide(scene);
        work.position = {};
    }
    work.nonfinite_before = work.position.nonfinite;
    work.film.serial = std::uint64_t{work.position.done} * work.integrator.batches_per_sample();
}

void RenderSession::Impl::begin(const Scene& scene, const Work& work) {
    const std::uint64_t pixels = std::uint64_t{width} * height;
    const std::lock_guard lock(mutex);
    render_begin = Clock::now();
    batches_per_sample = work.integrator.batches_per_sample();
    progress.state = SessionState::Rendering;
    progress.samples = work.position.done;
    progress.total_samples = scene.description.settings.samples;
    progress.memory_bytes = scene.bytes() + pixels * (200 + sizeof(double) * passes.size());
}

void RenderSession::Impl::render(const Scene& scene,
                                 const RenderIdentity& identity,
                                 const BuiltScene* built) {
    const RenderSettings& settings = scene.description.settings;
    ThreadPool pool(options.threads);
    Integrator integrator(scene, pool);
    const auto shared_film = std::make_shared<SharedFilm>(
        scene.description.film,
        PassLayout(scene.description.passes.wanted, scene.description.passes.aovs));
    std::optional<GuideController> own_guide;
    GuideController& guide = built != nullptr ? built->guide : own_guide.emplace(make_guide(scene));
    Work work{pool, integrator, *shared_film, guide, {}};
    if (built != nullptr) {
        work.live = true;
        work.after_pass = built->after_pass;
    }
    CheckpointKeeper keeper(options.checkpoint, identity);
    resume(scene, keeper, work);
    {
        const std::lock_guard lock(mutex);
        film = shared_film;
    }
    begin(scene, work);
    render_passes(settings, keeper, work);
    keep(keeper, work);
    if (shared_film->film.passes().wants(FilmPass::Effort)) {
        std::vector<EffortShare> shares = integrator.effort();
        const std::lock_guard lock(mutex);
        effort = std::move(shares);
    }
    if (settings.guiding != GuidingMode::Off && built == nullptr) {
        std::vector<std::byte> bytes = field_to_bytes(work.guide, settings.guiding);
        const std::lock_guard lock(mutex);
        field = std::move(bytes);
    }
    if (shared_film->film.passes().wants_any(kGuidePasses) && !cancel.cancelled()) {
        integrator.render_guide_passes(work.guide.next_pass(), *shared_film);
        finish_pass(work);
    }
}

void RenderSession::Impl::render_passes(const RenderSettings& settings,
                                        CheckpointKeeper& keeper,
                                        Work& work) {
    const Clock::time_point begin = Clock::now();
    const std::uint64_t pixels = std::uint64_t{width} * height;
    StopCondition stop{cancel, std::nullopt};
    std::uint32_t& done = work.position.done;
    if (done > 0) {
        finish_pass(work);
    }
    while (done < settings.samples) {
        if (settings.time_limit > 0.0f && done > 0) {
            // Only after the first pass: every pixel has a sample by then.
            stop.deadline = deadline_after(begin, settings.time_limit);
        }
        PassSettings pass = next_pass(done, settings.samples, pixels);
        pass.samples =
            std::min({pass.samples, work.guide.most_samples(done), options.pass_samples});
        pass.weight = work.guide.weight(done);
        pass.offset = options.sample_offset;
        if ((done > 0 && stop.reached()) || !render_pass(pass, stop, work)) {
            if (!work.live) {
                finish_pass(work);
            }
            return;
        }
        done += pass.samples;
        work.guide.see(work.film.film, done);
        learn(work);
        if (work.live && cancel.cancelled()) {
            return;
        }
        finish_pass(work);
        if (work.after_pass) {
            work.after_pass(work.guide);
        }
        if (keeper.due()) {
            keep(keeper, work);
        }
    }
}

// Its records are in `work` afterwards, whether it came to its end or not.
bool RenderSession::Impl::render_pass(const PassSettings& pass,
                                      const StopCondition& stop,
                                      Work& work) {
    const BatchStatistics before = work.integrator.statistics();
    const bool complete =
        work.integrator.render_pass(pass, work.guide.next_pass(), work.film, stop);
    const BatchStatistics& after = work.integrator.statistics();
    RenderPosition& position = work.position;
    position.records.append(work.integrator.take_records());
    position.paths += after.camera_samples - before.camera_samples;
    position.vertices += after.vertices - before.vertices;
    position.nonfinite = work.nonfinite_before + after.nonfinite;
    return complete;
}

void RenderSession::Impl::learn(Work& work) {
    RenderPosition& position = work.position;
    RecordBuffer records = std::exchange(position.records, {});
    SelectionPass counted;
    counted.paths = static_cast<double>(std::exchange(position.paths, 0));
    counted.vertices = static_cast<double>(std::exchange(position.vertices, 0));
    if (!work.guide.learning()) {
        work.guide.rest();
        return;
    }
    const std::uint64_t items = records.radiance.size();
    const Clock::time_point begin = Clock::now();
    const CancelFlag* abandon = work.live ? &cancel : nullptr;
    work.guide.learn(std::move(records), counted, work.film.film, work.pool, abandon);
    work.integrator.book_training(items, static_cast<std::uint64_t>(1e9 * seconds_since(begin)));
}

void RenderSession::Impl::keep(CheckpointKeeper& keeper, const Work& work) {
    const std::string error = keeper.write(work.position, work.film.film, work.guide);
    if (!error.empty()) {
        note(Severity::Warning, "Checkpoint", error);
    }
}

void RenderSession::Impl::finish_pass(const Work& work) {
    const BatchStatistics& batch = work.integrator.statistics();
    const double noise = [&] {
        const std::shared_lock film_lock(film->mutex);
        return film->film.noise();
    }();
    const std::lock_guard lock(mutex);
    progress.samples = work.position.done;
    progress.guiding = work.guide.status();
    progress.noise = noise;
    progress.nonfinite_samples = work.nonfinite_before + batch.nonfinite;
    statistics.stages.clear();
    for (std::size_t i = 0; i < batch.stages.size(); ++i) {
        statistics.stages.push_back({std::string(kStageNames[i]),
                                     batch.stages[i].items,
                                     1e-9 * static_cast<double>(batch.stages[i].nanoseconds)});
    }
    statistics.camera_samples = batch.camera_samples;
    statistics.vertices = batch.vertices;
    statistics.rays = batch.rays;
    statistics.render_cpu_seconds = process_cpu_seconds() - work.cpu_begin;
    const std::vector<std::uint32_t>& wanted = options.snapshot_samples;
    while (snapshots.size() < wanted.size() && wanted[snapshots.size()] <= work.position.done) {
        SessionSnapshot snapshot{
            work.position.done, statistics.render_cpu_seconds, seconds_since(*render_begin), {}};
        snapshot.combined.resize(std::size_t{width} * height * 4);
        film->film.read(FilmPass::Combined, snapshot.combined);
        snapshots.push_back(std::move(snapshot));
    }
}

RenderSession::RenderSession(SceneDescription description, unsigned threads)
    : RenderSession(std::move(description), with_threads(threads)) {}

RenderSession::RenderSession(SceneDescription description, SessionOptions options)
    : impl_(std::make_unique<Impl>()) {
    impl_->width = description.film.crop_width;
    impl_->height = description.film.crop_height;
    impl_->aovs = description.passes.aovs;
    impl_->passes = PassLayout(description.passes.wanted, impl_->aovs);
    std::ranges::sort(options.snapshot_samples);
    impl_->options = std::move(options);
    impl_->driver = std::jthread([impl = impl_.get(), scene = std::move(description)]() mutable {
        impl->run(std::move(scene));
    });
}

RenderSession::RenderSession(const BuiltScene& built, unsigned threads)
    : impl_(std::make_unique<Impl>()) {
    const SceneDescription& description = built.scene.description;
    impl_->options = with_threads(threads);
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

std::vector<EffortShare> RenderSession::effort() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->effort;
}

std::vector<std::byte> RenderSession::field() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->field;
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
    return has(pass) && impl_->read(static_cast<std::size_t>(film_pass_channels(pass)),
                                    out,
                                    [&](const Film& film) { film.read(pass, out); });
}

std::span<const AovDescription> RenderSession::aovs() const {
    return impl_->aovs;
}

bool RenderSession::read_aov(std::size_t index, std::span<float> out) const {
    return index < impl_->aovs.size() &&
           impl_->read(impl_->passes.aovs()[index].channels, out, [&](const Film& film) {
               film.read_aov(index, out);
           });
}

}  // namespace pharos
