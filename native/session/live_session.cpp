#include "session/live_session.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include "core/cancel.h"
#include "core/fp_state.h"
#include "core/memory.h"
#include "scene/compare.h"
#include "session/coarse_view.h"
#include "session/guide_budget.h"
#include "session/guide_controller.h"
#include "session/guide_costs.h"
#include "session/guide_memory.h"

namespace pharos {

namespace {

constexpr std::chrono::milliseconds kPollInterval(2);
constexpr int kNiceness = 5;  // the host's interface comes first

// Content that only the description before holds moves on into the next one.
void adopt_content(SceneDescription& from, SceneDescription& next) {
    for (Mesh& mesh : next.meshes) {
        const auto known = std::ranges::find_if(from.meshes, [&](const Mesh& other) {
            return mesh.version != 0 && other.version == mesh.version;
        });
        if (mesh.positions.empty() && known != from.meshes.end()) {
            mesh = std::move(*known);
        }
    }
    for (ImageDescription& image : next.images) {
        const auto known = std::ranges::find_if(from.images, [&](const ImageDescription& other) {
            return image.version != 0 && other.version == image.version;
        });
        const bool empty = image.path.empty() && image.bytes.empty() && image.pixels.empty();
        if (empty && known != from.images.end()) {
            image = std::move(*known);
        }
    }
}

// What was asked for and not yet taken up.
struct Requests {
    std::optional<SceneDescription> scene;
    std::optional<ViewDescription> view;
    bool forget_guide = false;

    [[nodiscard]] bool any() const { return scene || view; }
};

}  // namespace

struct LiveSession::Impl {
    Impl(unsigned thread_count, const FrameBudget& frame_budget)
        : threads(thread_count), budget(frame_budget) {}

    const unsigned threads;
    const FrameBudget budget;
    CancelFlag closing;

    mutable std::mutex mutex;  // guards everything down to `full`
    mutable std::condition_variable changed;
    Requests requests;
    std::optional<SceneDescription> last_scene;  // its outline, as asked for
    std::optional<ViewDescription> last_view;
    bool paused = false;
    bool busy = false;      // taking up a request, or rendering
    LiveProgress progress;  // has_picture: of the picture under way, whatever is asked for since
    std::uint64_t serial_base = 0;
    std::vector<ReportEntry> report;
    std::shared_ptr<RenderSession> coarse;  // of the newest view; null: none
    std::shared_ptr<RenderSession> full;
    std::uint64_t questions = 0;
    std::optional<Vec2> question;
    LobeProbe answer;

    // Of the driver alone.
    LiveScene scene;
    bool waiting = false;  // there is a picture to be rendered
    bool edited = false;   // since the last picture began
    GuideMemory guide;
    std::optional<GuideBudget> calibrated;
    GuideController no_guide{GuidingMode::Off, Bounds3(), 1};

    std::jthread driver;  // last: joins before anything it uses is destroyed

    void run();
    void take_up(Requests now);
    [[nodiscard]] std::vector<std::shared_ptr<RenderSession>> drop_picture();
    void render();
    void start(GuideController& controller, std::shared_ptr<RenderSession>& place);
    [[nodiscard]] bool finish(RenderSession& session);
    void calibrate();
    void announce_picture(const RenderSession& session);
    void fail(const std::string& error);
    void answer_lobes(const GuideController& controller);

    [[nodiscard]] bool interrupted() const {
        return closing.cancelled() || paused || requests.any();
    }
};

void LiveSession::Impl::fail(const std::string& error) {
    const std::lock_guard lock(mutex);
    progress.render = SessionProgress{};
    progress.has_picture = false;
    progress.render.state = SessionState::Failed;
    progress.render.error = error;
    progress.lost_scene = scene.scene() == nullptr;
    if (progress.lost_scene) {
        last_scene.reset();
    }
}

void LiveSession::Impl::take_up(Requests now) {
    waiting = false;
    try {
        if (now.forget_guide) {
            guide.forget();
        }
        SceneReport own;
        if (now.scene) {
            scene.update(std::move(*now.scene), closing, own);
            edited = true;
        }
        if (now.view && scene.scene() != nullptr) {
            scene.set_view(*now.view, closing, own);
        }
        waiting = scene.scene() != nullptr;
        const std::lock_guard lock(mutex);
        if (now.scene) {
            report = own.entries();
        }
        progress.lost_scene = false;
    } catch (const Cancelled&) {
        return;  // closing
    } catch (const std::exception& error) {
        fail(is_out_of_memory(error) ? "Out of memory: the scene does not fit." : error.what());
    }
}

// With the mutex held.
void LiveSession::Impl::announce_picture(const RenderSession& session) {
    if (!progress.has_picture && session.progress().samples > 0) {
        progress.has_picture = true;
        changed.notify_all();
    }
}

// Waits for the end of a session, which a change brings about early; true: nothing has changed.
bool LiveSession::Impl::finish(RenderSession& session) {
    std::unique_lock lock(mutex);
    while (!interrupted()) {
        lock.unlock();
        const bool ended = session.wait(kPollInterval);
        lock.lock();
        announce_picture(session);
        if (ended) {
            return !interrupted();
        }
    }
    lock.unlock();
    session.cancel();
    while (!session.wait(std::chrono::seconds(1))) {
    }
    return false;
}

void LiveSession::Impl::start(GuideController& controller, std::shared_ptr<RenderSession>& place) {
    const bool guided = &controller != &no_guide;
    const auto answer_between = [this](const GuideController& learned) { answer_lobes(learned); };
    const BuiltScene built{*scene.scene(),
                           controller,
                           guided ? answer_between : std::function<void(const GuideController&)>()};
    auto session = std::make_shared<RenderSession>(built, threads);
    const std::lock_guard lock(mutex);
    place = std::move(session);
}

// On the thread that the guide belongs to.
void LiveSession::Impl::answer_lobes(const GuideController& controller) {
    std::unique_lock lock(mutex);
    if (!question) {
        return;
    }
    const Vec2 place = *question;
    const std::uint64_t number = questions;
    question.reset();
    lock.unlock();
    LobeProbe found = probe_lobes(*scene.scene(), controller, place);
    found.question = number;
    lock.lock();
    answer = std::move(found);
}

// What was shown belongs to an earlier view or scene. Returned, since it takes time to free.
std::vector<std::shared_ptr<RenderSession>> LiveSession::Impl::drop_picture() {
    std::vector<std::shared_ptr<RenderSession>> dropped;
    const std::lock_guard lock(mutex);
    for (std::shared_ptr<RenderSession>* session : {&coarse, &full}) {
        serial_base += *session ? (*session)->progress().serial : 0;
        dropped.push_back(std::move(*session));
    }
    ++progress.pictures;
    progress.has_picture = false;
    progress.render = SessionProgress{};
    return dropped;
}

// Once: what the guide costs, and by a coarse picture what vertices cost without it. Views that
// need none are rendered in no time.
void LiveSession::Impl::calibrate() {
    if (!calibrated) {
        const double workers =
            threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
        calibrated.emplace();
        calibrated->guide = workers * budget.guide;
        calibrated->frame = workers * budget.frame;
        calibrated->costs = measure_guide_costs(guiding_config(GuidingMode::Neural));
    }
    if (coarse && calibrated->vertex == 0.0) {
        const SessionStatistics work = coarse->statistics();
        double seconds = 0.0;
        for (const StageStatistics& stage : work.stages) {
            seconds += stage.seconds;
        }
        calibrated->vertex = seconds / std::max(1.0, static_cast<double>(work.vertices));
    }
    guide.set_budget(*calibrated);
}

// A coarse picture first, where the view is large, then the view itself.
void LiveSession::Impl::render() {
    auto dropped = drop_picture();
    const ViewDescription view = view_of(scene.scene()->description);
    SceneReport none;
    if (const auto small = coarse_view(view)) {
        scene.set_view(*small, closing, none);
        start(no_guide, coarse);
        dropped.clear();
        const bool complete = finish(*coarse);
        scene.set_view(view, closing, none);
        if (!complete) {
            return;
        }
    }
    dropped.clear();
    if (scene.scene()->description.settings.guiding != GuidingMode::Off) {
        calibrate();
    }
    GuideController& controller = guide.begin_picture(*scene.scene(), edited);
    edited = false;
    {
        const std::lock_guard lock(mutex);
        progress.guide_kept = guide.kept();
    }
    start(controller, full);
    waiting = !finish(*full);
}

void LiveSession::Impl::run() {
    const FloatStateGuard float_state;
    // Of this thread, and of all that it starts; a refusal does no harm.
    setpriority(PRIO_PROCESS, 0, kNiceness);
    std::unique_lock lock(mutex);
    while (true) {
        busy = false;
        changed.notify_all();
        changed.wait(lock, [this] {
            const bool asked = question && guide.current() != nullptr && scene.scene() != nullptr;
            return closing.cancelled() || requests.any() || (waiting && !paused) || asked;
        });
        if (closing.cancelled()) {
            return;
        }
        busy = true;
        Requests now = std::exchange(requests, {});
        progress.has_picture = progress.has_picture && !now.any();
        const bool hold = paused;
        lock.unlock();
        if (now.any() || now.forget_guide) {
            take_up(std::move(now));
        }
        if (guide.current() != nullptr && scene.scene() != nullptr) {
            answer_lobes(*guide.current());
        }
        if (waiting && !hold) {
            try {
                render();
            } catch (const Cancelled&) {
                waiting = false;  // closing
            } catch (const std::exception& error) {
                waiting = false;
                fail(error.what());
            }
        }
        lock.lock();
    }
}

LiveSession::LiveSession(unsigned threads, const FrameBudget& budget)
    : impl_(std::make_unique<Impl>(threads, budget)) {
    impl_->driver = std::jthread([impl = impl_.get()] { impl->run(); });
}

LiveSession::~LiveSession() {
    const std::lock_guard lock(impl_->mutex);
    impl_->closing.cancel();
    impl_->changed.notify_all();
}

void LiveSession::set_scene(SceneDescription description) {
    Impl& s = *impl_;
    const ViewDescription view = view_of(description);
    const std::lock_guard lock(s.mutex);
    if (s.last_scene && same_content(*s.last_scene, description)) {
        if (view != s.last_view) {
            s.last_view = view;
            s.requests.view = view;
            s.changed.notify_all();
        }
        return;
    }
    s.last_scene = outline(description);
    s.last_view = view;
    if (s.requests.scene) {
        adopt_content(*s.requests.scene, description);
    }
    s.requests.scene = std::move(description);
    s.requests.view.reset();
    s.changed.notify_all();
}

bool LiveSession::set_view(const ViewDescription& view) {
    Impl& s = *impl_;
    const std::lock_guard lock(s.mutex);
    if (view == s.last_view) {
        return false;
    }
    s.last_view = view;
    s.requests.view = view;
    s.changed.notify_all();
    return true;
}

void LiveSession::set_paused(bool paused) {
    const std::lock_guard lock(impl_->mutex);
    impl_->paused = paused;
    impl_->changed.notify_all();
}

void LiveSession::forget_guide() {
    const std::lock_guard lock(impl_->mutex);
    impl_->requests.forget_guide = true;
}

std::uint64_t LiveSession::ask_lobes(const Vec2& place) {
    const std::lock_guard lock(impl_->mutex);
    impl_->question = place;
    impl_->changed.notify_all();
    return ++impl_->questions;
}

LobeProbe LiveSession::lobes() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->answer;
}

LiveProgress LiveSession::progress() const {
    const Impl& s = *impl_;
    const std::lock_guard lock(s.mutex);
    LiveProgress out = s.progress;
    const std::uint64_t before = s.serial_base + (s.coarse ? s.coarse->progress().serial : 0);
    if (s.full) {
        out.render = s.full->progress();
    }
    out.render.serial += before;
    out.has_picture = out.has_picture && !s.requests.any();
    return out;
}

SessionStatistics LiveSession::statistics() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->full ? impl_->full->statistics() : SessionStatistics{};
}

std::vector<ReportEntry> LiveSession::report() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->report;
}

LivePicture LiveSession::picture() const {
    std::shared_ptr<const RenderSession> coarse;
    std::shared_ptr<const RenderSession> full;
    LivePicture out;
    {
        const std::lock_guard lock(impl_->mutex);
        coarse = impl_->coarse;
        full = impl_->full;
        out.serial = impl_->serial_base;
    }
    for (const auto& session : {coarse, full}) {
        out.serial += session ? session->progress().serial : 0;
    }
    show_best(coarse.get(), full.get(), out);
    return out;
}

bool LiveSession::wait(std::chrono::milliseconds time) const {
    std::unique_lock lock(impl_->mutex);
    // While it is not busy the driver waits, and `waiting` stays as it is.
    return impl_->changed.wait_for(lock, time, [&] {
        return !impl_->busy && !impl_->requests.any() && !(impl_->waiting && !impl_->paused);
    });
}

bool LiveSession::wait_picture(std::chrono::milliseconds time) const {
    const Impl& s = *impl_;
    std::unique_lock lock(s.mutex);
    bool there = false;
    s.changed.wait_for(lock, time, [&] {
        there = s.progress.has_picture && !s.requests.any();
        // With nothing asked for and nothing under way there is none to wait for.
        const bool resting = !s.busy && !s.requests.any() && (!s.waiting || s.paused);
        return there || s.paused || resting;
    });
    return there;
}

}  // namespace pharos
