#include "sampling/distribution_1d.h"

#include <bit>

namespace pharos {

namespace {

constexpr double kGrid = 0x1p24;

double usable(float weight) {
    return std::isfinite(weight) && weight > 0.0f ? static_cast<double>(weight) : 0.0;
}

}  // namespace

namespace detail {

double build_cdf(std::span<const float> weights, std::span<float> cdf) {
    double sum = 0.0;
    for (const float weight : weights) {
        sum += usable(weight);
    }
    const std::size_t cells = weights.size();
    double prefix = 0.0;
    for (std::size_t i = 0; i < cells; ++i) {
        const double share =
            sum > 0.0 ? prefix / sum : static_cast<double>(i) / static_cast<double>(cells);
        cdf[i] = static_cast<float>(std::round(std::min(share, 1.0) * kGrid) / kGrid);
        prefix += usable(weights[i]);
    }
    cdf[cells] = 1.0f;
    return sum;
}

void build_guide(std::span<const float> cdf, std::span<std::uint32_t> guide) {
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

std::uint32_t guide_buckets(std::size_t cells) {
    return static_cast<std::uint32_t>(std::bit_ceil(std::max<std::size_t>(cells / 4, 1)));
}

}  // namespace detail

Distribution1D::Distribution1D() : Distribution1D(std::span<const float>{}) {}

Distribution1D::Distribution1D(std::span<const float> weights) {
    constexpr float kOne = 1.0f;
    const std::span<const float> used = weights.empty() ? std::span(&kOne, 1) : weights;
    cdf_.resize(used.size() + 1);
    sum_ = detail::build_cdf(used, cdf_);
    buckets_ = detail::guide_buckets(used.size());
    guide_.resize(buckets_ + 1);
    detail::build_guide(cdf_, guide_);
}

}  // namespace pharos
