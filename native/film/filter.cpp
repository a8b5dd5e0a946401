#include "film/filter.h"

#include <array>

namespace pharos {

namespace {

constexpr int kCells = 1024;

// The four-term window of Harris 1978 over t in [0, 1].
double blackman_harris(double t) {
    const double angle = 2.0 * std::numbers::pi * t;
    return 0.35875 - 0.48829 * std::cos(angle) + 0.14128 * std::cos(2.0 * angle) -
           0.01168 * std::cos(3.0 * angle);
}

}  // namespace

FilterSampler::FilterSampler(PixelFilter filter, float width) {
    const float used = std::isfinite(width) ? std::clamp(width, 0.01f, 100.0f) : 1.5f;
    if (filter == PixelFilter::Box) {
        return;
    }
    const bool gaussian = filter == PixelFilter::Gaussian;
    radius_ = gaussian ? 1.5f * used : used;
    std::array<float, kCells> weights{};
    for (int i = 0; i < kCells; ++i) {
        const double t = (i + 0.5) / kCells;
        // exp(-2 (6 v / 3 width)^2) with v = (2 t - 1) 1.5 width.
        const double x = 3.0 * (2.0 * t - 1.0);
        const double value = gaussian ? std::exp(-2.0 * x * x) : blackman_harris(t);
        weights[static_cast<std::size_t>(i)] = static_cast<float>(value);
    }
    axis_ = Distribution1D(weights);
}

}  // namespace pharos
