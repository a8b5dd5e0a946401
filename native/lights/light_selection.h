// Which light a receiver samples, and with what probability.
//
// In proportion to an estimate of each group's irradiance at the receiver (light_columns.h), where
// a group is a lamp, some emissive triangles of one material on one instance, or the world; zero
// only where nothing can arrive. Up to kMaxEstimated groups are estimated all together, more of
// them along a tree. A scene with one group pays nothing.
#pragma once

#include <cstdint>
#include <span>

#include "core/cancel.h"
#include "lights/light_columns.h"
#include "lights/light_tree.h"

namespace pharos {

class LightSelection {
  public:
    static constexpr std::uint32_t kMaxEstimated = 32;

    LightSelection() = default;
    // Throws Cancelled.
    explicit LightSelection(std::span<const LightBound> bounds, const CancelFlag& cancel = {});

    [[nodiscard]] bool empty() const { return count_ == 0; }

    [[nodiscard]] std::uint32_t size() const { return count_; }

    void choose(std::span<LightQuery> queries) const;

    [[nodiscard]] float pmf(const LightSampleContext& context, std::uint32_t group) const;

  private:
    std::uint32_t count_ = 0;
    LightColumns<kMaxEstimated> columns_;
    LightTree tree_;  // of more than kMaxEstimated
};

}  // namespace pharos
