// Piecewise-constant density over [0, 1): sample, density and inverse, in O(1) expected time.
//
// The cumulative function is summed in double and stored on the grid of multiples of 2^-24, which
// is that of the random numbers. Densities are differences of stored values, so sampling and
// density agree exactly: a cell lighter than the grid has density 0 and is never sampled (MIS gives
// it to the other technique). Look-up starts from a guide table (Chen and Asau 1974) and ends by
// bisection. Negative and non-finite weights count as 0; no positive weight at all: uniform.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace pharos {

namespace detail {

[[nodiscard]] inline double usable_weight(float weight) {
    return std::isfinite(weight) && weight > 0.0f ? static_cast<double>(weight) : 0.0;
}

// Fills cdf (weights.size() + 1 values, 0 ... 1) and returns the sum of the usable weights.
inline double build_cdf(std::span<const float> weights, std::span<float> cdf) {
    constexpr double kGrid = 0x1p24;
    double sum = 0.0;
    for (const float weight : weights) {
        sum += usable_weight(weight);
    }
    const std::size_t cells = weights.size();
    double prefix = 0.0;
    for (std::size_t i = 0; i < cells; ++i) {
        const double share =
            sum > 0.0 ? prefix / sum : static_cast<double>(i) / static_cast<double>(cells);
        cdf[i] = static_cast<float>(std::round(std::min(share, 1.0) * kGrid) / kGrid);
        prefix += usable_weight(weights[i]);
    }
    cdf[cells] = 1.0f;
    return sum;
}

// guide[b] = the cell that holds b / (guide.size() - 1); the size is a power of two plus one.
inline void build_guide(std::span<const float> cdf, std::span<std::uint32_t> guide) {
    const auto buckets = static_cast<float>(guide.size() - 1);
    const auto last = static_cast<std::uint32_t>(cdf.size() - 2);
    std::uint32_t cell = 0;
    for (std::size_t b = 0; b < guide.size(); ++b) {
        // The upper end stands for the largest number below 1.
        const float u = std::min(static_cast<float>(b) / buckets, kOneMinusEpsilon);
        while (cell < last && cdf[cell + 1] <= u) {
            ++cell;
        }
        guide[b] = cell;
    }
}

// About one bucket for four cells.
[[nodiscard]] inline std::uint32_t guide_buckets(std::size_t cells) {
    return static_cast<std::uint32_t>(std::bit_ceil(std::max<std::size_t>(cells / 4, 1)));
}

// The cell with cdf[cell] <= u < cdf[cell + 1].
[[nodiscard]] inline std::uint32_t find_cell(const float* cdf,
                                             const std::uint32_t* guide,
                                             std::uint32_t buckets,
                                             float u) {
    const auto bucket = static_cast<std::uint32_t>(u * static_cast<float>(buckets));
    std::uint32_t low = guide[bucket];
    std::uint32_t high = guide[bucket + 1];
    while (low < high) {
        const std::uint32_t middle = low + (high - low + 1) / 2;
        if (cdf[middle] <= u) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    return low;
}

}  // namespace detail

class Distribution1D {
  public:
    Distribution1D() : Distribution1D(std::span<const float>{}) {}  // uniform, one cell

    explicit Distribution1D(std::span<const float> weights) {
        constexpr float kOne = 1.0f;
        const std::span<const float> used = weights.empty() ? std::span(&kOne, 1) : weights;
        cdf_.resize(used.size() + 1);
        sum_ = detail::build_cdf(used, cdf_);
        buckets_ = detail::guide_buckets(used.size());
        guide_.resize(buckets_ + 1);
        detail::build_guide(cdf_, guide_);
    }

    struct Sample {
        float x = 0.0f;
        float pdf = 0.0f;  // with respect to x in [0, 1)
        std::uint32_t cell = 0;
        float offset = 0.0f;  // within the cell, [0, 1)
    };

    [[nodiscard]] Sample sample(float u) const {
        u = std::clamp(u, 0.0f, kOneMinusEpsilon);
        const std::uint32_t cell = detail::find_cell(cdf_.data(), guide_.data(), buckets_, u);
        const float mass = pmf(cell);
        const float offset = std::min((u - cdf_[cell]) / mass, kOneMinusEpsilon);
        const float cells = static_cast<float>(size());
        const float x = (static_cast<float>(cell) + offset) / cells;
        return {std::min(x, kOneMinusEpsilon), mass * cells, cell, offset};
    }

    [[nodiscard]] float pdf(float x) const { return pmf(cell_of(x)) * static_cast<float>(size()); }

    // The u for which sample() returns x.
    [[nodiscard]] float invert(float x) const {
        const std::uint32_t cell = cell_of(x);
        const float offset = saturate(x * static_cast<float>(size()) - static_cast<float>(cell));
        return cdf_[cell] + offset * pmf(cell);
    }

    [[nodiscard]] float pmf(std::uint32_t cell) const { return cdf_[cell + 1] - cdf_[cell]; }

    [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(cdf_.size()) - 1; }

    [[nodiscard]] double sum() const { return sum_; }  // of the weights

  private:
    [[nodiscard]] std::uint32_t cell_of(float x) const {
        const float scaled = std::clamp(x, 0.0f, kOneMinusEpsilon) * static_cast<float>(size());
        return std::min(static_cast<std::uint32_t>(scaled), size() - 1);
    }

    std::vector<float> cdf_;
    std::vector<std::uint32_t> guide_;
    std::uint32_t buckets_ = 1;
    double sum_ = 0.0;
};

}  // namespace pharos
