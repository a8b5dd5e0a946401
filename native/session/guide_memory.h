// The guide of a scene that changes: it lives on through views, edits and the frames of an
// animation, and is made anew only where it cannot go on.
#pragma once

#include <cstdint>
#include <optional>

#include "session/guide_controller.h"

namespace pharos {

class GuideMemory {
  public:
    // The guide for the next picture of a scene; `edited`: not the scene of the picture before. One
    // picture at a time.
    [[nodiscard]] GuideController& begin_picture(const Scene& scene, bool edited);

    // Of all pictures to come.
    void set_budget(const GuideBudget& budget) { budget_ = budget; }

    // The next picture starts with a new guide.
    void forget() { guide_.reset(); }

    [[nodiscard]] const GuideController* current() const { return guide_ ? &*guide_ : nullptr; }

    // Whether the last begin_picture() went on with what earlier pictures had learned.
    [[nodiscard]] bool kept() const { return kept_; }

  private:
    [[nodiscard]] bool fits(const Scene& scene) const;

    std::optional<GuideController> guide_;
    GuideBudget budget_;
    GuidingMode mode_ = GuidingMode::Off;
    bool kept_ = false;
};

}  // namespace pharos
