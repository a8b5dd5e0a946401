#include "session/pixel_estimate.h"

#include <algorithm>
#include <array>

#include "core/color.h"

namespace pharos {

namespace {

constexpr int kQuadrant = 4;            // pixels a side, the pixel itself among them
constexpr double kEstimateFloor = 0.1;  // of the picture's mean

struct Picture {
    int width = 0;
    int height = 0;
    std::vector<float> value;
};

// Along one axis, the mean of the kQuadrant pixels from each one on (fewer at the far edge).
void average_forward(Picture& picture, int axis) {
    const int step = axis == 0 ? 1 : picture.width;
    const int length = axis == 0 ? picture.width : picture.height;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const int count = std::min(kQuadrant, length - (axis == 0 ? x : y));
            const int first = y * picture.width + x;
            double sum = 0.0;
            for (int i = 0; i < count; ++i) {
                sum +=
                    static_cast<double>(picture.value[static_cast<std::size_t>(first + i * step)]);
            }
            // What lies behind is no longer needed, so that the mean may take the pixel's place.
            picture.value[static_cast<std::size_t>(first)] = static_cast<float>(sum / count);
        }
    }
}

// Mean of the two darkest of the four quadrants that have the pixel as a corner.
float darker_quadrants(const Picture& means, int x, int y) {
    const auto mean = [&](int left, int top) {
        return means.value[static_cast<std::size_t>(top * means.width + left)];
    };
    const int left = std::max(0, x - kQuadrant + 1);
    const int top = std::max(0, y - kQuadrant + 1);
    std::array<float, 4> around = {mean(x, y), mean(left, y), mean(x, top), mean(left, top)};
    std::ranges::sort(around);
    return 0.5f * (around[0] + around[1]);
}

}  // namespace

std::vector<float> film_luminance(const Film& film) {
    const std::size_t pixels = std::size_t{film.width()} * film.height();
    std::vector<float> combined(pixels * 4);
    film.read(FilmPass::Combined, combined);
    const float unexposed = film.exposure() > 0.0f ? 1.0f / film.exposure() : 1.0f;
    std::vector<float> out(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        out[i] =
            unexposed * luminance(Rgb(combined[4 * i], combined[4 * i + 1], combined[4 * i + 2]));
    }
    return out;
}

std::vector<float> estimate_pixels(const Film& film) {
    Picture picture{
        static_cast<int>(film.width()), static_cast<int>(film.height()), film_luminance(film)};
    const std::size_t pixels = picture.value.size();
    double mean = 0.0;
    for (const float value : picture.value) {
        mean += static_cast<double>(value);
    }
    mean /= static_cast<double>(pixels);
    if (!(mean > 0.0)) {
        return {};
    }
    average_forward(picture, 0);
    average_forward(picture, 1);
    const auto floor = static_cast<float>(kEstimateFloor * mean);
    std::vector<float> estimate(pixels);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            estimate[static_cast<std::size_t>(y * picture.width + x)] =
                std::max(floor, darker_quadrants(picture, x, y));
        }
    }
    return estimate;
}

}  // namespace pharos
