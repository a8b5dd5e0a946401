// Runs the guide through the passes of a render: what each pass may use and record, and what is
// learned from it before the next (DESIGN: "off until proven on", frozen snapshot per pass).
//
// All decisions follow from counted work and from earlier passes; none looks at a clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "core/state_archive.h"
#include "film/film.h"
#include "integrator/guiding_context.h"
#include "integrator/render_context.h"
#include "scene/scene.h"
#include "session/guide_budget.h"
#include "session/guide_status.h"
#include "session/pass_weights.h"

namespace pharos {

// How the field of a mode is made; of Off, that of Neural.
[[nodiscard]] GuidingConfig guiding_config(GuidingMode mode);

class GuideController {
  public:
    GuideController(GuidingMode mode, const Bounds3& scene_box, std::uint64_t pixels);

    // Goes on with another picture: the field lives on. Another view of the same scene is guided
    // from its first pass on; in an edited one the field's optimiser starts again, and what was
    // proven has to be proven anew.
    void begin_picture(const Bounds3& scene_box, std::uint64_t pixels, bool edited);

    // The picture is over before what is learned could pay: nothing is recorded or guided, all
    // passes count alike. Nothing of it where the guide serves whether it pays or not (SLIDES).
    void stay_out();

    // The same, but only if its first sample shows that light is easy to find.
    void stay_out_if_quiet();

    // For live pictures, before one begins: what a frame may spend. Without it all is spent.
    void set_budget(const GuideBudget& budget);

    [[nodiscard]] bool learning() const {
        return enabled_ && !frozen_ && !status_.closed && !status_.brief;
    }

    // Samples that the next pass should take at most, after `done` of them: few while much is
    // learned from each.
    [[nodiscard]] std::uint32_t most_samples(std::uint32_t done) const;

    // Looks at the picture after `done` samples, before it learns from the last of them.
    void see(const Film& film, std::uint32_t done);

    // Equal ones once the guide goes on from an earlier picture: what passes 0 and 1 show there is
    // not independent of what guided them.
    [[nodiscard]] std::array<double, 2> weight(std::uint32_t first_sample) const;

    // What it has learned, used or not; null: nothing yet.
    [[nodiscard]] const GuidingField* learned() const {
        return field_ && field_->generation() > 0 ? &*field_ : nullptr;
    }

    // What the next pass may use. Valid until learn() is called.
    [[nodiscard]] GuidingContext next_pass() const;

    // Takes what a pass recorded, with its counted work, and the picture so far. Where `cancel` is
    // set meanwhile the pass is forgotten but for what the field has learned from it.
    void learn(RecordBuffer records,
               const SelectionPass& work,
               const Film& film,
               ThreadPool& pool,
               const CancelFlag* cancel = nullptr);

    // Counts a pass taken while nothing is learned: the gate opens again, rarely, for a probe.
    void rest();

    [[nodiscard]] const GuideStatus& status() const { return status_; }

    // All that was learned and decided, between passes. load() takes the state of a controller of
    // the same mode and picture size; throws StateError, and the controller is then to be thrown
    // away.
    void save(StateWriter& out) const;
    void load(StateReader& in);

    // Takes the state of any controller of the same mode, as a field file (field_file.h) holds it,
    // and learns no more: all passes are guided alike and count alike, so that the samples of a
    // picture may be taken apart. What was learned about another picture's pixels is left out.
    void load_frozen(StateReader& in);

    // Takes the state of a controller of the same mode at the end of an earlier picture, the frame
    // before in an animation, and goes on from it: what was proven holds until it is disproved.
    void load_earlier(StateReader& in);

    // Whether the field, made for another box perhaps, can tell the places of this one apart.
    [[nodiscard]] bool serves(const Bounds3& scene_box) const;

  private:
    void calibrate(const std::array<double, 2>& calibration);
    [[nodiscard]] double served_part(const SelectionStatistics& selected) const;
    void judge_length();
    void judge_hardness(const SelectionStatistics& selected);

    void count_rates(const RecordBuffer& records, const SelectionPass& work);
    void plan_next();

    [[nodiscard]] bool serves_unproven() const {
        return hard_share_[0] > 0.0f || hard_share_[1] > 0.0f;
    }

    void read_state(StateReader& in);

    GuidingMode mode_;
    bool enabled_;
    bool frozen_ = false;
    Bounds3 box_;  // of the scene
    std::uint64_t pixels_;
    std::uint32_t pass_ = 0;
    bool continued_ = false;  // from an earlier picture
    bool short_ = false;      // too short for a quiet scene
    bool hard_ = false;
    std::array<float, 2> hard_share_{};  // of the guide, at least, at diffuse and glossy vertices
    std::array<float, 2> adjoint_scale_{};
    float record_probability_;
    std::optional<GuidingField> field_;
    std::optional<GuideSelection> selection_;
    std::vector<float> pixel_estimate_;
    PassWeights weights_;
    GuideBudget budget_;
    GuideRates rates_;
    GuidePlan plan_;
    GuideStatus status_;
};

}  // namespace pharos
