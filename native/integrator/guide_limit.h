// Which vertices the guide may serve while its work is limited: the first bounces first, and among
// those of one bounce the regions where it has proven most.
//
// Whether it serves a vertex is decided before the direction there is sampled, from how the path
// came and a hash of its own: the density of every direction stays known, the picture unbiased.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "sampling/sampler.h"

namespace pharos {

inline constexpr std::uint32_t kGuideRanks = 32;

// Vertices of recorded paths by rank, whether they were guided or not.
using GuideDemand = std::array<std::uint64_t, kGuideRanks>;

// Low ranks are served first. `proven` is the share that its region has proven: 0 ... 0.75.
[[nodiscard]] inline std::uint32_t guide_rank(std::uint32_t bounce, float proven) {
    const auto quarters = static_cast<std::uint32_t>(4.0f * std::clamp(proven, 0.0f, 0.75f));
    return 4 * std::min(bounce, kGuideRanks / 4 - 1) + 3 - quarters;
}

struct GuideLimit {
    std::uint32_t whole = kGuideRanks;  // ranks below it are served
    float part = 0.0f;                  // of this one

    [[nodiscard]] bool active() const { return whole < kGuideRanks; }

    // `random`: 32 random bits of the vertex.
    [[nodiscard]] bool admits(std::uint32_t rank, std::uint32_t random) const {
        return rank < whole || (rank == whole && bits_to_unit_float(random) < part);
    }
};

}  // namespace pharos
