// What makes a picture slow: the effort of its camera samples, by the object that the camera sees
// and by the light that brought them.
//
// A sample's effort is the squared difference of its luminance from its pixel's mean so far, times
// the rays of its paths: variance times cost, the reciprocal of the efficiency of Monte Carlo
// estimates. It is booked on the first surface, and where the sample is brighter than the mean on
// the lights by their parts of it. All functions return at once where FilmPass::Effort is not
// wanted.
#pragma once

#include <cstdint>
#include <vector>

#include "film/film.h"
#include "integrator/effort_share.h"
#include "integrator/path_batch.h"
#include "integrator/render_context.h"

namespace pharos {

struct EffortTally {
    std::vector<double> objects;   // by instance, those of samples that hit nothing in the last
    std::vector<double> lamps;     // by the description's lamps
    std::vector<double> surfaces;  // that emit, by instance
    double world = 0.0;

    void add(const EffortTally& other);
};

inline constexpr double kLeastEffortShare = 0.001;

// By names, the largest first, objects before lights; what is less than kLeastEffortShare is left
// out.
[[nodiscard]] std::vector<EffortShare> effort_shares(const EffortTally& tally, const Scene& scene);

class EffortMeter {
  public:
    // Before the first stage after the camera rays.
    void begin(const RenderContext& context, PathBatch& batch);

    // After the rays of `batch.active` have been traced, and before those of shadow_rays are.
    void take_hits(const PathBatch& batch);
    void take_shadow_rays(const PathBatch& batch);

    // Before the batch's samples are added to the film: their effort is in root_passes afterwards.
    void book(const PassLayout& passes,
              std::uint32_t first_pixel,
              const Film& film,
              PathBatch& batch);

    [[nodiscard]] const EffortTally& tally() const { return tally_; }

  private:
    bool wanted_ = false;
    std::vector<std::uint32_t> rays_;     // by root
    std::vector<std::uint32_t> objects_;  // first hit's instance, else kNone
    std::vector<double> scale_;           // effort over luminance of each root that is too bright
    EffortTally tally_;
};

}  // namespace pharos
