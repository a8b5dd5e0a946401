// Image files in and out; image_io.cpp is the only file that knows OpenImageIO.
//
// What a file is, is read from its first bytes, never from its name: PNG, JPEG, OpenEXR, Radiance
// HDR, TIFF, BMP, TGA, WebP, JPEG 2000, DPX and Cineon are taken, everything else is refused. A
// file that claims more than kMaxImageSide texels a side, more than kMaxImageBytes, or far more
// pixels than its size can hold is refused before memory is asked for. Writers write beside the
// target and rename. Functions return an error sentence, empty on success, and do not throw
// (Cancelled excepted).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/cancel.h"
#include "core/scene_report.h"
#include "image/image_description.h"
#include "image/texture.h"

namespace pharos {

inline constexpr std::uint32_t kMaxImageSide = 32768;
inline constexpr std::uint64_t kMaxImageBytes = std::uint64_t{4096} << 20;

struct DecodedImage {
    TexturePixels pixels;
    bool straight_alpha = false;  // colours are not multiplied by alpha
    std::string error;            // empty: pixels are valid
};

[[nodiscard]] DecodedImage read_image_file(const std::string& path,
                                           const CancelFlag* cancel = nullptr);
[[nodiscard]] DecodedImage read_image_bytes(std::span<const std::uint8_t> bytes,
                                            const CancelFlag* cancel = nullptr);

// The file as it is, for keeping it elsewhere; empty for whatever is no image of a known format.
[[nodiscard]] std::vector<std::uint8_t> image_file_bytes(const std::string& path);

// From whichever of path, bytes and pixels the description has. Failures are reported under the
// image's name and give magenta.
[[nodiscard]] Texture load_texture(const ImageDescription& description,
                                   SceneReport& report,
                                   const CancelFlag* cancel = nullptr);

// One pass of an EXR: `channels` names one letter each, "RGBA" makes Combined.R ... Combined.A; an
// empty name makes plain R ... A.
struct ExrPass {
    std::string name;
    std::string channels;
    std::span<const float> pixels;  // interleaved, bottom row first
};

struct ExrOptions {
    bool half = false;
    std::vector<std::pair<std::string, std::string>> metadata;  // text attributes
};

[[nodiscard]] std::string write_exr(const std::string& path,
                                    std::uint32_t width,
                                    std::uint32_t height,
                                    std::span<const ExrPass> passes,
                                    const ExrOptions& options = {});

// An EXR as it is: all channels as floats, bottom row first, interleaved.
struct ExrFile {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::string> channels;
    std::vector<float> pixels;
    std::vector<std::pair<std::string, std::string>> metadata;  // text attributes
    std::string error;                                          // empty: the rest is valid
};

// A file of more than kMaxExrChannels channels is refused, and what read_image_file refuses.
inline constexpr std::uint32_t kMaxExrChannels = 256;
[[nodiscard]] ExrFile read_exr(const std::string& path, bool with_pixels = true);

// linear: scene-linear values of 1 (grey), 3 or 4 (colours multiplied by alpha) channels, bottom
// row first; written with the sRGB curve, 8 bits, straight alpha.
[[nodiscard]] std::string write_png(const std::string& path,
                                    std::uint32_t width,
                                    std::uint32_t height,
                                    std::span<const float> linear);

}  // namespace pharos
