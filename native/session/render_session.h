// A render from description to finished passes on threads of its own; hosts start, poll, read,
// cancel.
//
// All functions are thread-safe and return at once, except wait(), read() (copies a pass: some
// milliseconds) and the destructor (cancels and joins). Nothing here calls back into the host.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/scene_report.h"
#include "film/film.h"
#include "integrator/effort_share.h"
#include "scene/scene_description.h"
#include "session/checkpoint_keeper.h"
#include "session/guide_status.h"

namespace pharos {

class GuideController;
struct Scene;

enum class SessionState : std::uint8_t { Building, Rendering, Finished, Cancelled, Failed };

struct SessionProgress {
    SessionState state = SessionState::Building;
    std::string error;           // state Failed: one sentence
    bool out_of_memory = false;  // state Failed: this is why
    std::uint32_t samples = 0;   // finished passes of the whole frame
    std::uint32_t total_samples = 0;
    std::uint64_t serial = 0;        // grows whenever the picture has changed
    double fraction = 0.0;           // 0 ... 1, including the time limit
    double elapsed = 0.0;            // seconds since start of rendering
    double remaining = 0.0;          // estimate, seconds
    double noise = 1.0;              // Film::noise()
    std::uint64_t memory_bytes = 0;  // scene and film
    std::uint64_t nonfinite_samples = 0;
    GuideStatus guiding;
};

// Work per stage, for --stats and the benchmarks.
struct StageStatistics {
    std::string name;
    std::uint64_t items = 0;
    double seconds = 0.0;  // summed over threads
};

struct SessionStatistics {
    std::vector<StageStatistics> stages;
    std::uint64_t camera_samples = 0;
    std::uint64_t vertices = 0;
    std::uint64_t rays = 0;
    double build_seconds = 0.0;
    double render_cpu_seconds = 0.0;  // process CPU time of passes and training
};

// The picture after some number of samples, kept for whoever measures error over time.
struct SessionSnapshot {
    std::uint32_t samples = 0;
    double cpu_seconds = 0.0;     // of passes and training up to here
    double wall_seconds = 0.0;    // since the start of rendering
    std::vector<float> combined;  // RGBA
};

// From about so many camera samples on learning pays for itself in hard scenes
// (`tests/benchmark/run` at 16 samples of 128 x 96 pixels, 196 608 in all).
inline constexpr std::uint64_t kLeastGuidedSamples = 160000;

// Where the first sample of each pixel shows that light is easy to find it takes so many times as
// many.
inline constexpr std::uint64_t kQuietSamplesFactor = 8;

struct SessionOptions {
    unsigned threads = 0;  // 0: one per core
    // A snapshot is kept at the end of the first pass that reaches each of these.
    std::vector<std::uint32_t> snapshot_samples;
    std::uint32_t pass_samples = 0xffffffffu;  // of a pass, at most
    // The film's first sample in each pixel's sequence: shards of one picture start where the one
    // before ends.
    std::uint32_t sample_offset = 0;
    // Of an earlier render (RenderSession::field()): guides all passes alike and learns no more, or
    // goes on learning from where it was, or, where it does not fit, starts anew and reports why.
    std::vector<std::byte> field;
    bool field_learns = false;
    // Camera samples in all under which a picture is unguided (kQuietSamplesFactor times as many in
    // quiet scenes), where no field is given and none of the guide's passes is asked for. 0: as
    // where what is learned serves the next picture.
    std::uint64_t least_guided_samples = 0;
    CheckpointOptions checkpoint;
};

// A scene that is built already, and a guide that may have learned from earlier pictures. Both
// belong to the session until it has ended.
struct BuiltScene {
    const Scene& scene;
    GuideController& guide;
    std::function<void(const GuideController&)>
        after_pass;  // on the session's thread; may be empty
};

class RenderSession {
  public:
    // Takes the description; work begins at once on threads of the session.
    explicit RenderSession(SceneDescription description, unsigned threads = 0);
    RenderSession(SceneDescription description, SessionOptions options);
    RenderSession(const BuiltScene& built, unsigned threads);
    ~RenderSession();
    RenderSession(const RenderSession&) = delete;
    RenderSession& operator=(const RenderSession&) = delete;

    void cancel();

    // True when the render has ended (finished, cancelled or failed) within the time.
    bool wait(std::chrono::milliseconds time) const;

    [[nodiscard]] SessionProgress progress() const;
    [[nodiscard]] SessionStatistics statistics() const;
    [[nodiscard]] std::vector<ReportEntry> report() const;
    [[nodiscard]] std::vector<SessionSnapshot> snapshots() const;

    [[nodiscard]] std::uint32_t width() const;  // of the rendered window
    [[nodiscard]] std::uint32_t height() const;

    // Whether a pass is there to be read: a basic one, or one that the description asks for.
    [[nodiscard]] bool has(FilmPass pass) const;

    // The newest complete state of a pass: width * height * film_pass_channels(pass) floats, bottom
    // row first. False while there is no picture yet or without the pass (out is untouched).
    // Throws std::invalid_argument for a wrong size.
    bool read(FilmPass pass, std::span<float> out) const;

    // What the guide has learned, as SessionOptions::field takes it; empty before the end and
    // without a guide.
    [[nodiscard]] std::vector<std::byte> field() const;

    // What made the picture slow, after its end; empty unless FilmPass::Effort is wanted.
    [[nodiscard]] std::vector<EffortShare> effort() const;

    // The passes that materials write, and their newest state: 4 or 1 floats a pixel. As read().
    [[nodiscard]] std::span<const AovDescription> aovs() const;
    bool read_aov(std::size_t index, std::span<float> out) const;

  private:
    struct Impl;
    struct Work;
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
