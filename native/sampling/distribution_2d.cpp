#include "sampling/distribution_2d.h"

#include <stdexcept>

namespace pharos {

Distribution2D::Distribution2D() : cdf_{0.0f, 1.0f}, guide_{0, 0} {}

Distribution2D::Distribution2D(std::span<const float> weights,
                               std::uint32_t width,
                               std::uint32_t height)
    : width_(width), buckets_(detail::guide_buckets(width)) {
    if (width == 0 || height == 0 || weights.size() != std::size_t{width} * height) {
        throw std::invalid_argument("Distribution2D: weights do not match width x height");
    }
    const std::size_t cdf_stride = std::size_t{width} + 1;
    const std::size_t guide_stride = std::size_t{buckets_} + 1;
    cdf_.resize(cdf_stride * height);
    guide_.resize(guide_stride * height);

    // Conditionals, and their sums in double for the marginal.
    std::vector<double> sums(height);
    double largest = 0.0;
    for (std::size_t y = 0; y < height; ++y) {
        const std::span<float> cdf = std::span(cdf_).subspan(y * cdf_stride, cdf_stride);
        sums[y] = detail::build_cdf(weights.subspan(y * width, width), cdf);
        detail::build_guide(cdf, std::span(guide_).subspan(y * guide_stride, guide_stride));
        largest = std::max(largest, sums[y]);
    }
    // Scaled so that no row's sum overflows a float.
    std::vector<float> marginal(height);
    for (std::size_t y = 0; y < height; ++y) {
        marginal[y] = largest > 0.0 ? static_cast<float>(sums[y] / largest) : 0.0f;
    }
    rows_ = Distribution1D(marginal);
}

}  // namespace pharos
