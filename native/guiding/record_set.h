// Radiance records made ready for training: checked, split into training and held-out, thinned,
// brought into an order that depends on their keys alone, and turned into columns.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "guiding/aligned_floats.h"
#include "guiding/guiding_field.h"
#include "guiding/mlp.h"

namespace pharos {

// Records as columns, padded to a multiple of kTrainChunk with records of weight 0.
class RecordSet {
  public:
    [[nodiscard]] std::size_t size() const { return size_; }

    [[nodiscard]] std::size_t chunks() const { return (size_ + kTrainChunk - 1) / kTrainChunk; }

    [[nodiscard]] TrainingColumns columns() const;

    [[nodiscard]] std::span<const float> target() const { return {columns_[9].data(), size_}; }

    [[nodiscard]] std::span<const float> pdf() const { return {columns_[10].data(), size_}; }

    [[nodiscard]] Vec3 position(std::size_t i) const {
        return Vec3(columns_[0][i], columns_[1][i], columns_[2][i]);
    }

    void resize(std::size_t size);
    void set(std::size_t i, const RadianceRecord& record, float target, float weight);

  private:
    std::array<AlignedFloats, 12> columns_;
    std::size_t size_ = 0;
};

struct PreparedRecords {
    RecordSet training;
    RecordSet held_out;
    std::uint64_t invalid = 0;
    float scale = 0.0f;  // the unit of the targets; 0: no light seen so far, nothing to train on
};

// `scale` is the unit in use, 0 at first. It is measured from the first pass with light as the mean
// of radiance / pdf with outliers cut at 1000 medians, and again when the pass' mean has left it by
// 1e4.
void prepare_records(const GuidingConfig& config,
                     std::span<const RadianceRecord> records,
                     float scale,
                     PreparedRecords& out);

}  // namespace pharos
