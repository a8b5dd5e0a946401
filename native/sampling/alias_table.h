// Discrete choice in constant time (Walker 1977 in the form of Vose 1991).
//
// u is a double, so that tables of millions of entries still see fresh bits; widen_random() makes
// one from the random numbers of a sample. Negative and non-finite weights count as 0; no positive
// weight: uniform.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace pharos {

// u with its missing low bits filled from a hash of the other numbers of the same sample.
[[nodiscard]] inline double widen_random(float u, const Vec2& others) {
    const std::uint64_t packed = (std::uint64_t{std::bit_cast<std::uint32_t>(others.x)} << 32) |
                                 std::bit_cast<std::uint32_t>(others.y);
    std::uint64_t h = (packed ^ std::bit_cast<std::uint32_t>(u)) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    return std::min(static_cast<double>(u) + static_cast<double>(h >> 40) * 0x1p-48,
                    0x1.fffffffffffffp-1);
}

struct AliasSlot {
    float keep = 1.0f;  // share of the slot that belongs to its own index
    std::uint32_t alias = 0;
    float pmf = 0.0f;
};

struct AliasSample {
    std::uint32_t index = 0;
    float pmf = 0.0f;
    double u = 0.0;  // what is left of the random number, [0, 1)
};

// The choice among `count` slots, of which slot_at(i) is one; not to be called for none.
template <class SlotAt>
[[nodiscard]] inline AliasSample sample_alias(double u, std::size_t count, const SlotAt& slot_at) {
    const double scaled = u * static_cast<double>(count);
    const auto place = std::min(static_cast<std::size_t>(scaled), count - 1);
    const double rest = scaled - static_cast<double>(place);
    const AliasSlot& slot = slot_at(place);
    const auto keep = static_cast<double>(slot.keep);
    if (rest < keep) {
        return {static_cast<std::uint32_t>(place), slot.pmf, rest / keep};
    }
    const std::uint32_t alias = slot.alias;
    return {
        alias, slot_at(alias).pmf, std::min((rest - keep) / (1.0 - keep), 0x1.fffffffffffffp-1)};
}

class AliasTable {
  public:
    using Sample = AliasSample;
    using Slot = AliasSlot;

    AliasTable() = default;
    explicit AliasTable(std::span<const float> weights);

    // Not to be called on an empty table.
    [[nodiscard]] Sample sample(double u) const {
        return sample_alias(
            u, slots_.size(), [this](std::size_t i) -> const Slot& { return slots_[i]; });
    }

    [[nodiscard]] float pmf(std::uint32_t index) const { return slots_[index].pmf; }

    [[nodiscard]] const Slot& slot(std::size_t index) const { return slots_[index]; }

    [[nodiscard]] std::size_t size() const { return slots_.size(); }

    [[nodiscard]] bool empty() const { return slots_.empty(); }

  private:
    std::vector<Slot> slots_;
};

}  // namespace pharos
