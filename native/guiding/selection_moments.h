// Second moments of a vertex' estimate under every share of the guide, all from the one recorded
// sample (off-policy), their sums over records, and what a decision makes of them.
//
// With pa = a q + (1 - a) p_b for the share a,
//   N_a = f_e / (p_l + pa(light direction)),  B_a = f_e' / (p_l' + pa) + fL / pa,
//   S_a = w [ N_a^2 + (pa / p_used) (2 N_a B_a + B_a^2) ],  w = (lum(T) / I_pixel)^2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "guiding/selection.h"

namespace pharos {

inline constexpr std::size_t kShares = 4;
inline constexpr std::array<float, kShares> kShare = {0.0f, 0.25f, 0.5f, kLargestShare};

inline constexpr double kPriorCount = 128.0;  // weight of the parent in a cell's mean, and so on up

// Sums over records: second moments per share, squares of the differences to share 0, count.
struct Moments {
    std::array<double, kShares> moment{};
    std::array<double, kShares> square{};
    double count = 0.0;

    void add(const Moments& other, double scale);
    void scale_by(double factor);
};

template <class Archive>
void state_fields(Archive& archive, Moments& moments) {
    archive(moments.moment, moments.square, moments.count);
}

// The same sums while a pass adds up: whole numbers of a part of the picture's variance and its
// square, so that the order of records does not matter.
struct PassSums {
    std::array<std::int64_t, kShares> moment{};
    std::array<std::int64_t, kShares> square{};
    std::int64_t count = 0;

    // One record's moments; they shrink together until none is above 50 variances. Not finite:
    // false, and nothing is added.
    bool add(const std::array<double, kShares>& moments, double variance);
    void add(const PassSums& other);
    [[nodiscard]] Moments moments(double variance) const;
};

[[nodiscard]] bool is_valid(const SelectionRecord& record);

// S_a of a valid record.
[[nodiscard]] std::array<double, kShares> record_moments(const SelectionRecord& record);

// Contributions to the pixel, in units of what it shows: expected by A, and arrived.
struct Contributions {
    double expected = 0.0;
    double arrived = 0.0;
};

template <class Archive>
void state_fields(Archive& archive, Contributions& contributions) {
    archive(contributions.expected, contributions.arrived);
}

// Of one record: 50 pixels at most, so that neither a firefly nor a single wrong A decides.
[[nodiscard]] Contributions contributions(const SelectionRecord& record);

// What a decision needs: means after shrinkage, and the standard errors of the gains.
struct MomentEstimate {
    std::array<double, kShares> mean{};
    std::array<double, kShares> gain_error{};
};

// Means over `own` and kPriorCount records' worth of `above`.
[[nodiscard]] Moments shrink(const Moments& own, const Moments& above);

// `records` is how many records really stand behind the means.
[[nodiscard]] MomentEstimate estimate(const Moments& shrunk, double records);

// Shares of all cells in two bits each: looked up at every vertex, small enough to stay in a cache.
class ShareTable {
  public:
    explicit ShareTable(std::size_t cells) : bytes_((cells + 3) / 4) {}

    [[nodiscard]] std::uint8_t operator[](std::uint32_t cell) const {
        return static_cast<std::uint8_t>((bytes_[cell / 4] >> shift(cell)) & 3u);
    }

    void set(std::uint32_t cell, std::uint8_t share) {
        std::uint8_t& byte = bytes_[cell / 4];
        byte = static_cast<std::uint8_t>((byte & ~(3u << shift(cell))) |
                                         (unsigned{share} << shift(cell)));
    }

    // For archives: any content of this length is a table.
    [[nodiscard]] std::vector<std::uint8_t>& bytes() { return bytes_; }

  private:
    static unsigned shift(std::uint32_t cell) { return 2 * (cell % 4); }

    std::vector<std::uint8_t> bytes_;
};

static_assert(kShares <= 4);

}  // namespace pharos
