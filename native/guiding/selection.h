// Off until proven on: where the guide takes a share of the sampling, decided per region from
// recorded vertices by counted work, never by a clock.
//
// Cells are 32^3 positions over the scene's box x 6 dominant normal axes x {diffuse, glossy}, with
// parents four times coarser and one global cell for shrinkage. For every candidate share a in
// {0, 1/4, 1/2, 3/4} the second moment S_a of the vertex' estimate is found off-policy from the one
// recorded sample (selection_moments.h).
// A cell turns on when S_0 / n - S_a / n exceeds the cost of guiding in units of the picture's
// variance per unit of work, with hysteresis and a confidence margin, so that one firefly decides
// nothing. Beside it the field's A is held against what arrived: an adjoint has to add up.
// Deterministic: a pass adds up whole numbers, so the order of records does not matter.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math.h"
#include "core/state_archive.h"

namespace pharos {

// Of the guide at a vertex: the material always keeps a quarter.
inline constexpr float kLargestShare = 0.75f;

// One vertex of a recorded path; all f are luminances of f |cos| L, all pdfs per solid angle.
struct SelectionRecord {
    Vec3 position;
    Vec3 normal;
    bool glossy = false;
    float weight = 0.0f;         // w, finite
    float nee_radiance = 0.0f;   // f_e, visibility included; 0: nothing arrived
    float nee_pdf_light = 0.0f;  // p_l and the others at the light's direction
    float nee_pdf_bsdf = 0.0f;
    float nee_pdf_guide = 0.0f;
    float hit_radiance = 0.0f;   // f_e': emission met by the sampled direction, unweighted
    float hit_pdf_light = 0.0f;  // p_l'
    float indirect = 0.0f;       // fL: everything else that arrived along it
    float pdf_used = 0.0f;       // of the mixture the direction was sampled with
    float pdf_bsdf = 0.0f;
    float pdf_guide = 0.0f;
    float expected = 0.0f;  // what the guide's A says of hit and indirect together, before sampling
    std::uint64_t key = 0;
};

template <class Archive>
void state_fields(Archive& archive, SelectionRecord& r) {
    archive(r.position, r.normal, r.glossy, r.weight, r.nee_radiance, r.nee_pdf_light);
    archive(r.nee_pdf_bsdf, r.nee_pdf_guide, r.hit_radiance, r.hit_pdf_light, r.indirect);
    archive(r.pdf_used, r.pdf_bsdf, r.pdf_guide, r.expected, r.key);
}

// What a pass cost and how noisy it was, counted.
struct SelectionPass {
    double paths = 0.0;              // camera samples of the pass
    double vertices = 0.0;           // surface vertices of the pass
    double relative_variance = 0.0;  // mean over recorded paths of min(((lum L - I) / I)^2, 2000)
};

// The share a > 0 with the least second moment over some vertices.
struct BestShare {
    float share = 0.0f;         // 0: nothing was judged yet
    double moment_ratio = 1.0;  // its S_a / S_0; over 1: it would do harm
    float largest = 0.0f;       // of the shares that still gain clearly; 0: none
    double part = 0.0;          // of the recorded vertices, these
};

struct SelectionStatistics {
    double guided_share = 0.0;  // of the recorded vertices, by the alpha of their cells
    BestShare best;             // over all of them
    std::array<BestShare, 2> best_of_kind{};  // over diffuse and over glossy ones
    // What A expected over what arrived, of diffuse and of glossy vertices; 0: unknown.
    std::array<double, 2> calibration{};
    std::uint32_t cells_on = 0;
    std::uint32_t cells = 0;  // with records
    bool closed = false;      // the gate: nearly nothing is on, recording and training stop
};

class GuideSelection {
  public:
    explicit GuideSelection(const Bounds3& scene_box);
    ~GuideSelection();
    GuideSelection(GuideSelection&&) noexcept;
    GuideSelection& operator=(GuideSelection&&) noexcept;

    // Share of the guide at a vertex in the next pass: 0 (off), 1/4, 1/2 or 3/4. Thread-safe.
    [[nodiscard]] float alpha(const Vec3& position, const Vec3& normal, bool glossy) const;

    // Takes the records of a pass and decides for the next one.
    SelectionStatistics update(std::span<const SelectionRecord> records, const SelectionPass& pass);

    // True: nothing is guided and nothing need be recorded. The gate opens again for probing passes
    // by pass number alone.
    [[nodiscard]] bool closed() const;

    // All that was learned, the scene's box included. load() throws StateError, and the selection
    // is then to be thrown away.
    void save(StateWriter& out) const;
    void load(StateReader& in);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
