// Frame size, rendered window, pixel filter.
#pragma once

#include <cstdint>

namespace pharos {

enum class PixelFilter : std::uint32_t { Box, Gaussian, BlackmanHarris };

struct FilmDescription {
    std::uint32_t width = 0;  // full frame
    std::uint32_t height = 0;
    std::uint32_t crop_x = 0;  // rendered window, origin bottom left
    std::uint32_t crop_y = 0;
    std::uint32_t crop_width = 0;
    std::uint32_t crop_height = 0;
    PixelFilter filter = PixelFilter::BlackmanHarris;
    float filter_width = 1.5f;
    float exposure = 1.0f;
    bool transparent = false;

    bool operator==(const FilmDescription&) const = default;
};

}  // namespace pharos
