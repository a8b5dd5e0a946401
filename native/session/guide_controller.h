// Runs the guide through the passes of a render: what each pass may use and record, and what is
// learned from it before the next (DESIGN: "off until proven on", frozen snapshot per pass).
//
// All decisions follow from counted work and from earlier passes; none looks at a clock.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "film/film.h"
#include "integrator/guiding_context.h"
#include "integrator/render_context.h"
#include "scene/scene.h"
#include "session/guide_status.h"

namespace pharos {

// Film weight of a pass, by its number alone: the same whether the guide turned on or not.
[[nodiscard]] double pass_weight(std::uint32_t pass);

class GuideController {
  public:
    GuideController(GuidingMode mode, const Bounds3& scene_box, std::uint64_t pixels);

    // Samples the next pass should take at most: one while something is learned.
    [[nodiscard]] bool learning() const { return enabled_ && !status_.closed; }

    // What the next pass may use. Valid until learn() is called.
    [[nodiscard]] GuidingContext next_pass() const;

    // Takes what a pass recorded, with its counted work, and the picture so far.
    void learn(RecordBuffer records, const SelectionPass& work, const Film& film, ThreadPool& pool);

    // Counts a pass taken while nothing is learned: the gate opens again, rarely, for a probe.
    void rest();

    [[nodiscard]] const GuideStatus& status() const { return status_; }

  private:
    void judge_hardness(double relative_variance, double moment_ratio);
    void update_pixel_estimate(const Film& film);

    GuidingMode mode_;
    bool enabled_;
    std::uint64_t pixels_;
    std::uint32_t pass_ = 0;
    bool hard_ = false;
    float record_probability_;
    std::optional<GuidingField> field_;
    std::optional<GuideSelection> selection_;
    std::vector<float> pixel_estimate_;
    GuideStatus status_;
};

}  // namespace pharos
