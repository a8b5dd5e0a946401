#include "session/pass_weights.h"

#include <algorithm>
#include <limits>

#include "session/pixel_estimate.h"

namespace pharos {

namespace {

// Over this the guide learns so much in its first passes that they are better weighted down.
constexpr double kHardVariance = 4.0;
// Under this in the first sample alone the light is easy to find: the easy scenes of the benchmark
// show 0 to 1.3 there, the others 7 to 26.
constexpr double kQuietVariance = 2.0;
constexpr double kMaxSquare = 2000.0;
constexpr double kFloor = 0.1;  // of the usual brightness
constexpr int kDimmings = 2;    // of what is brighter than usual, to find it
constexpr int kRadius = 3;
constexpr double kUnit = 1 << 20;  // of what is summed up, relative to the mean
constexpr double kMaxRelative = 1e9;
// 1, 1, 2, 3, ... 8, 8, ...: near the inverse of the variance that guided passes were seen to have.
constexpr double kLastWeight = 8.0;

// Sums over the windows of 2 kRadius + 1 pixels a side, each from the next: whole numbers of
// kUnit, so that nothing is lost on the way.
class WindowSums {
  public:
    WindowSums(int width, int height)
        : width_(width), height_(height), columns_(static_cast<std::size_t>(width)) {}

    // visit(x, y, sum) for every pixel of `in`, row by row.
    template <class Visit>
    void for_each(const std::vector<std::int64_t>& in, const Visit& visit) {
        std::ranges::fill(columns_, 0);
        for (int y = 0; y < std::min(kRadius, height_); ++y) {
            add_row(in, y, 1);
        }
        for (int y = 0; y < height_; ++y) {
            if (y + kRadius < height_) {
                add_row(in, y + kRadius, 1);
            }
            if (y - kRadius - 1 >= 0) {
                add_row(in, y - kRadius - 1, -1);
            }
            std::int64_t sum = 0;
            for (int x = 0; x < std::min(kRadius, width_); ++x) {
                sum += column(x);
            }
            for (int x = 0; x < width_; ++x) {
                sum += x + kRadius < width_ ? column(x + kRadius) : 0;
                sum -= x - kRadius - 1 >= 0 ? column(x - kRadius - 1) : 0;
                visit(x, y, sum);
            }
        }
    }

  private:
    void add_row(const std::vector<std::int64_t>& in, int y, std::int64_t sign) {
        for (int x = 0; x < width_; ++x) {
            columns_[static_cast<std::size_t>(x)] +=
                sign * in[static_cast<std::size_t>(y * width_ + x)];
        }
    }

    [[nodiscard]] std::int64_t column(int x) const { return columns_[static_cast<std::size_t>(x)]; }

    int width_;
    int height_;
    std::vector<std::int64_t> columns_;
};

// Pixels of the colour of (x, y) in the window around it.
int own_pixels(int x, int y, int width, int height) {
    const int left = std::max(0, x - kRadius);
    const int bottom = std::max(0, y - kRadius);
    const int area = (std::min(width - 1, x + kRadius) - left + 1) *
                     (std::min(height - 1, y + kRadius) - bottom + 1);
    const bool own_corner = (left + bottom) % 2 == (x + y) % 2;
    return (area + (own_corner ? 1 : 0)) / 2;
}

// Brightness of windows, in units of the mean: the mean once more without what a lamp or a window
// in sight adds to it, which would make the noise of all else look small.
double usual_brightness(const std::vector<double>& windows) {
    double usual = 1.0;
    for (int i = 0; i < kDimmings; ++i) {
        double sum = 0.0;
        for (const double window : windows) {
            sum += std::min(window, usual);
        }
        usual = sum / static_cast<double>(windows.size());
    }
    return usual;
}

// The same sample of the pixel two to the right, or two up (of the same colour), or two to the
// other side where the picture ends.
std::vector<float> neighbors(const FirstPasses& passes, int dx, int dy) {
    const auto width = static_cast<int>(passes.width);
    const auto height = static_cast<int>(passes.height);
    std::vector<float> out(passes.first.size());
    for (int y = 0; y < height; ++y) {
        const int other_y = y + dy < height ? y + dy : std::max(0, y - dy);
        for (int x = 0; x < width; ++x) {
            const int other_x = x + dx < width ? x + dx : std::max(0, x - dx);
            out[static_cast<std::size_t>(y * width + x)] =
                passes.first[static_cast<std::size_t>(other_y * width + other_x)];
        }
    }
    return out;
}

// A neighbour stands for the second sample: what differs between them by itself adds to the noise,
// so that of two directions the quieter one counts.
bool shows_quiet_light(FirstPasses passes) {
    double least = std::numeric_limits<double>::infinity();
    for (const int dx : {2, 0}) {
        passes.second = neighbors(passes, dx, 2 - dx);
        const std::array<double, 2> variance = relative_variance(passes);
        least = std::min(least, std::max(variance[0], variance[1]));
    }
    return least < kQuietVariance;
}

// A pixel's variance of one sample over the square of its neighbourhood, both in units of the mean.
struct PixelNoise {
    double half_square = 0.0;
    double window = 0.0;
};

}  // namespace

std::array<double, 2> relative_variance(const FirstPasses& passes) {
    const auto width = static_cast<int>(passes.width);
    const auto height = static_cast<int>(passes.height);
    WindowSums windows(width, height);
    std::array<double, 2> out{};
    for (int color = 0; color < 2; ++color) {
        const auto mean_of = [&](int x, int y) {
            const auto i = static_cast<std::size_t>(y * width + x);
            return 0.5 *
                   (static_cast<double>(passes.first[i]) + static_cast<double>(passes.second[i]));
        };
        double sum = 0.0;
        double pixels = 0.0;
        for (int y = 0; y < height; ++y) {
            for (int x = (y + color) % 2; x < width; x += 2) {
                sum += mean_of(x, y);
                pixels += 1.0;
            }
        }
        if (!(sum > 0.0)) {
            continue;
        }
        const double mean = sum / pixels;
        std::vector<std::int64_t> values(passes.first.size());
        for (int y = 0; y < height; ++y) {
            for (int x = (y + color) % 2; x < width; x += 2) {
                const double relative = std::clamp(mean_of(x, y) / mean, 0.0, kMaxRelative);
                values[static_cast<std::size_t>(y * width + x)] =
                    static_cast<std::int64_t>(relative * kUnit);
            }
        }
        std::vector<PixelNoise> noise;
        std::vector<double> brightness;
        windows.for_each(values, [&](int x, int y, std::int64_t window) {
            if ((x + y) % 2 != color) {
                return;
            }
            const int count = own_pixels(x, y, width, height);
            brightness.push_back(static_cast<double>(window) / (kUnit * count));
            if (window > 0) {
                const auto i = static_cast<std::size_t>(y * width + x);
                const double d =
                    (static_cast<double>(passes.first[i]) - static_cast<double>(passes.second[i])) /
                    mean;
                noise.push_back({0.5 * d * d, brightness.back()});
            }
        });
        const double least = kFloor * usual_brightness(brightness);
        double total = 0.0;
        for (const PixelNoise& pixel : noise) {
            const double unit = std::max(pixel.window, least);
            total += std::min(pixel.half_square / (unit * unit), kMaxSquare);
        }
        out[static_cast<std::size_t>(color)] =
            noise.empty() ? 0.0 : total / static_cast<double>(noise.size());
    }
    return out;
}

void PassWeights::see(const Film& film, std::uint32_t done) {
    if (done == 1) {
        passes_ = {film.width(), film.height(), film_luminance(film), {}};
        quiet_ = shows_quiet_light(passes_);
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
