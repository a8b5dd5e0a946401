// The learned light field: position and normal in, a vMF mixture of the incident light and its
// integral out (after "Real Time Neural Path Guiding", Wuest 2023; loss and targets after Dong et
// al. 2023, "Neural Parametric Mixtures for Path Guiding"). A small MLP, trained on the paths of
// the frame.
//
// What is learned: the density over the full sphere of luminance(L_i) * |cos| at (position, shading
// normal turned to wo's side), world space; A is its integral. With `target_cosine` off (SLIDES):
// of luminance(L_i). Do not multiply a product with a lobe that contains the cosine: it would count
// twice. Snapshot: evaluate() reads one published snapshot and may run on any number of threads;
// train() and the other non-const members must not run at the same time, and only train() changes
// the snapshot. Results depend on the records (as a set), their order of arrival and the thread
// count do not matter.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/math.h"
#include "core/parallel.h"
#include "guiding/directional_mixture.h"
#include "guiding/guiding_config.h"

namespace pharos {

// One recorded direction of one vertex of a path.
struct RadianceRecord {
    Vec3 position;
    Vec3 normal;                // shading normal on wo's side, as given to evaluate()
    Vec3 wi;                    // unit
    float radiance_cos = 0.0f;  // luminance of L_i * |cos|, >= 0; zero records belong in as well
    float pdf = 0.0f;           // solid angle, of the whole mixture wi was sampled with
    std::uint64_t key = 0;      // unique per record (pixel, sample, vertex): the canonical order
};

template <class Archive>
void state_fields(Archive& archive, RadianceRecord& r) {
    archive(r.position, r.normal, r.wi, r.radiance_cos, r.pdf, r.key);
}

// Structure of arrays over vertices, all of one length.
struct FieldQuery {
    std::span<const float> px, py, pz;
    std::span<const float> nx, ny, nz;
};

// Visits wanted in a pass, and the most of one record to reach them.
inline constexpr std::size_t kTrainingVisits = 32768;
inline constexpr std::size_t kMaxVisitsOfRecord = 4;

struct TrainStatistics {
    std::uint64_t records = 0;          // given
    std::uint64_t invalid_records = 0;  // non-finite or negative values, pdf not positive: dropped
    std::uint64_t trained_records = 0;  // visits, after thinning of zeros and the held-out share
    std::uint32_t steps = 0;
    std::uint32_t skipped_steps = 0;    // gradient not finite
    bool published = false;             // this pass' snapshot was not worse on the held-out records
    float loss = 0.0f;                  // mean of the training loss over this call
    float held_out_loss = 0.0f;         // of the candidate
    float held_out_loss_before = 0.0f;  // of the snapshot in use, on the same records
};

class GuidingField {
  public:
    // Throws std::invalid_argument for a configuration out of its limits.
    GuidingField(const GuidingConfig& config, const Bounds3& scene_box);
    ~GuidingField();
    GuidingField(GuidingField&&) noexcept;
    GuidingField& operator=(GuidingField&&) noexcept;

    // One mixture a vertex. No allocation (scratch is on the caller's stack); any count, best
    // >= 32. A non-finite position or normal is taken as zero.
    void evaluate(const FieldQuery& query, std::span<VmfMixture> mixtures) const;

    // One pass of training on all threads of the pool. Bit-equal results for any pool size. Where
    // `cancel` is set meanwhile it ends early and publishes nothing. Few records are visited up to
    // four times, but not more than `visits` in all.
    TrainStatistics train(std::span<const RadianceRecord> records,
                          ThreadPool& pool,
                          const CancelFlag* cancel = nullptr,
                          std::size_t visits = kTrainingVisits);

    // After an edit of the scene: weights stay, the learning rate, moments and averages start
    // again, and the rate falls sooner, since what it knows is nearly right.
    void restart_optimizer();

    // Number of published snapshots; 0 means that the field has learned nothing yet.
    [[nodiscard]] std::uint64_t generation() const;
    [[nodiscard]] const GuidingConfig& config() const;
    [[nodiscard]] Bounds3 box() const;  // whose positions are the network's -1 ... 1

    // Weights and optimiser state as a flat file image: versioned, checksummed. load() throws
    // std::invalid_argument naming what is wrong and then leaves the field as it was.
    [[nodiscard]] std::vector<std::byte> save() const;
    void load(std::span<const std::byte> data);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
