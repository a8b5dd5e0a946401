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

class AliasTable {
  public:
    AliasTable() = default;
    explicit AliasTable(std::span<const float> weights);

    struct Sample {
        std::uint32_t index = 0;
        float pmf = 0.0f;
        double u = 0.0;  // what is left of the random number, [0, 1)
    };

    // Not to be called on an empty table.
    [[nodiscard]] Sample sample(double u) const {
        const double scaled = u * static_cast<double>(slots_.size());
        const auto slot = std::min(static_cast<std::size_t>(scaled), slots_.size() - 1);
        const double rest = scaled - static_cast<double>(slot);
        const double keep = static_cast<double>(slots_[slot].keep);
        if (rest < keep) {
            return {static_cast<std::uint32_t>(slot), slots_[slot].pmf, rest / keep};
        }
        const std::uint32_t alias = slots_[slot].alias;
        return {
            alias, slots_[alias].pmf, std::min((rest - keep) / (1.0 - keep), 0x1.fffffffffffffp-1)};
    }

    [[nodiscard]] float pmf(std::uint32_t index) const { return slots_[index].pmf; }

    [[nodiscard]] std::size_t size() const { return slots_.size(); }

    [[nodiscard]] bool empty() const { return slots_.empty(); }

  private:
    struct Slot {
        float keep = 1.0f;  // share of the slot that belongs to its own index
        std::uint32_t alias = 0;
        float pmf = 0.0f;
    };

    std::vector<Slot> slots_;
};

}  // namespace pharos
