#include "session/pass_weights.h"

#include <algorithm>

#include "session/pixel_estimate.h"

namespace pharos {

namespace {

// Over this the guide learns so much in its first passes that they are better weighted down.
constexpr double kHardVariance = 4.0;
constexpr double kMaxSquare = 2000.0;
constexpr double kFloor = 0.1;  // of the mean
constexpr int kRadius = 3;
// 1, 1, 2, 3, 4, 4, ...: near the inverse of the variance that guided passes were seen to have.
constexpr double kLastWeight = 4.0;

// Sums over windows of 2 kRadius + 1 pixels along an axis.
std::vector<double> window_sums(const std::vector<double>& in, int width, int height, int axis) {
    std::vector<double> out(in.size());
    const int step = axis == 0 ? 1 : width;
    const int length = axis == 0 ? width : height;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int at = axis == 0 ? x : y;
            const int from = std::max(-kRadius, -at);
            const int to = std::min(kRadius, length - 1 - at);
            double sum = 0.0;
            for (int d = from; d <= to; ++d) {
                sum += in[static_cast<std::size_t>(y * width + x + d * step)];
            }
            out[static_cast<std::size_t>(y * width + x)] = sum;
        }
    }
    return out;
}

}  // namespace

std::array<double, 2> relative_variance(const FirstPasses& passes) {
    const auto width = static_cast<int>(passes.width);
    const auto height = static_cast<int>(passes.height);
    std::array<double, 2> out{};
    for (int color = 0; color < 2; ++color) {
        std::vector<double> value(passes.first.size());
        std::vector<double> count(passes.first.size());
        double sum = 0.0;
        double pixels = 0.0;
        const auto for_each_own = [&](const auto& visit) {
            for (int y = 0; y < height; ++y) {
                for (int x = (y + color) % 2; x < width; x += 2) {
                    visit(static_cast<std::size_t>(y * width + x));
                }
            }
        };
        for_each_own([&](std::size_t i) {
            value[i] = 0.5 * (static_cast<double>(passes.first[i]) +
                              static_cast<double>(passes.second[i]));
            count[i] = 1.0;
            sum += value[i];
            pixels += 1.0;
        });
        if (!(sum > 0.0)) {
            continue;
        }
        const double floor = kFloor * sum / pixels;
        value = window_sums(window_sums(value, width, height, 0), width, height, 1);
        count = window_sums(window_sums(count, width, height, 0), width, height, 1);
        double total = 0.0;
        for_each_own([&](std::size_t i) {
            const double d =
                static_cast<double>(passes.first[i]) - static_cast<double>(passes.second[i]);
            const double unit = std::max(value[i] / count[i], floor);
            total += std::min(0.5 * d * d / (unit * unit), kMaxSquare);
        });
        out[static_cast<std::size_t>(color)] = total / pixels;
    }
    return out;
}

void PassWeights::see(const Film& film, std::uint32_t done) {
    if (done == 1) {
        passes_ = {film.width(), film.height(), film_luminance(film), {}};
    } else if (done == 2 && !passes_.first.empty()) {
        // Both passes weigh the same: the second is twice the mean less the first.
        passes_.second = film_luminance(film);
        for (std::size_t i = 0; i < passes_.second.size(); ++i) {
            passes_.second[i] = 2.0f * passes_.second[i] - passes_.first[i];
        }
        const std::array<double, 2> variance = relative_variance(passes_);
        hard_ = {variance[0] > kHardVariance, variance[1] > kHardVariance};
        passes_ = {};
    }
}

bool PassWeights::fits(std::uint64_t pixels) const {
    return passes_.second.empty() &&
           (passes_.first.empty() || (passes_.first.size() == pixels &&
                                      std::uint64_t{passes_.width} * passes_.height == pixels));
}

std::array<double, 2> PassWeights::of(std::uint32_t first) const {
    std::array<double, 2> weight{1.0, 1.0};
    for (std::size_t color = 0; color < 2; ++color) {
        if (hard_[1 - color]) {
            weight[color] = std::clamp(static_cast<double>(first), 1.0, kLastWeight);
        }
    }
    return weight;
}

}  // namespace pharos
