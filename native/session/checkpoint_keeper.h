// When a render writes its checkpoints, and what it does with the one it finds.
#pragma once

#include <chrono>
#include <string>

#include "session/checkpoint.h"

namespace pharos {

enum class Resume : std::uint8_t {
    Never,
    IfItFits,  // from a file of another render, or a damaged one, it starts again and reports so
    Must       // such a file is an error; none at all is a new render
};

struct CheckpointOptions {
    std::string path;         // empty: none are written
    double interval = 300.0;  // seconds between two; one more is written at the end
    Resume resume = Resume::Never;
};

class CheckpointKeeper {
  public:
    CheckpointKeeper(const CheckpointOptions& options, const RenderIdentity& identity)
        : options_(options), identity_(identity), last_(Clock::now()) {}

    // There is a file, and it shall be used.
    [[nodiscard]] bool finds() const;

    // read_checkpoint().
    [[nodiscard]] RenderPosition read(Film& film, GuideController& guide) const;

    // A pass has ended, and it is time to write.
    [[nodiscard]] bool due() const;

    // An error sentence, empty on success and where no file is wanted: a disk that is full does not
    // end a render.
    [[nodiscard]] std::string write(const RenderPosition& position,
                                    const Film& film,
                                    const GuideController& guide);

  private:
    using Clock = std::chrono::steady_clock;

    CheckpointOptions options_;
    RenderIdentity identity_;
    Clock::time_point last_;
};

}  // namespace pharos
