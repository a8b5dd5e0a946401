// A render that goes on while its scene and view change: what a viewport shows.
//
// A change ends the picture under way within a batch, and the next one starts from what is built
// already (LiveScene) and what the guide has learned (GuideMemory). All of it runs on threads of
// the session: every function is thread-safe and returns at once, except picture() (copies a
// pass), wait(), wait_picture() and the destructor (cancels and joins). Changes are coalesced, the
// last one counts.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "scene/live_scene.h"
#include "session/coarse_view.h"
#include "session/lobe_probe.h"
#include "session/render_session.h"

namespace pharos {

struct LiveProgress {
    SessionProgress render;      // of the newest picture; its serial grows over all pictures
    std::uint64_t pictures = 0;  // begun so far: grows with every change
    bool guide_kept = false;     // the guide has learned from earlier pictures
    bool lost_scene = false;     // after a failure: the next scene must come in full
    bool has_picture = false;    // of the newest view and scene there is something to show
};

// What the guide may take of the time, in seconds with all threads; costs are counted, and
// calibrated once a session (guide_budget.h).
struct FrameBudget {
    double guide = 0.016;       // guided vertices and training, a frame
    double frame = 1.0 / 30.0;  // redraws come no sooner
};

class LiveSession {
  public:
    explicit LiveSession(unsigned threads = 0, const FrameBudget& budget = {});
    ~LiveSession();
    LiveSession(const LiveSession&) = delete;
    LiveSession& operator=(const LiveSession&) = delete;

    // The scene as a whole, with its view; what the last one had may come without content
    // (LiveScene). Nothing starts again where nothing has changed.
    void set_scene(SceneDescription description);

    // Another view of the same scene; whether it is another one.
    bool set_view(const ViewDescription& view);

    void set_paused(bool paused);  // while paused nothing renders; afterwards it starts again

    void forget_guide();  // before the next picture

    [[nodiscard]] LiveProgress progress() const;
    [[nodiscard]] SessionStatistics statistics() const;
    [[nodiscard]] std::vector<ReportEntry> report() const;  // of the scene in use

    // The best there is to show of the newest view; empty until something of it is there.
    [[nodiscard]] LivePicture picture() const;

    // Asks what the guide believes at a place of the view, fractions from its bottom left; the
    // answer comes between two passes. Returns the question's number.
    std::uint64_t ask_lobes(const Vec2& place);
    [[nodiscard]] LobeProbe lobes() const;  // the last answer

    // True when every change has been taken up and the picture has ended, within the time.
    bool wait(std::chrono::milliseconds time) const;

    // True when there is something to show of the newest view and scene, within the time; false at
    // once when there will be nothing (paused, failed).
    bool wait_picture(std::chrono::milliseconds time) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
