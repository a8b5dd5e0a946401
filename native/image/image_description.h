// An image as the host hands it over: by path, by the bytes of a file, or by pixels.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pharos {

enum class ImageColorSpace : std::uint32_t { Srgb, Linear, Data };
enum class ImageAlpha : std::uint32_t { Straight, Premultiplied, ChannelPacked, None };

// Exactly one of path, bytes (an encoded file) and pixels is used; none of them: a missing image.
struct ImageDescription {
    std::string name;
    std::uint64_t version = 0;  // equal and not 0: the same content (scene/live_scene.h)
    std::string path;
    std::vector<std::uint8_t> bytes;
    std::vector<float> pixels;  // RGBA, bottom row first
    std::uint32_t width = 0;    // of `pixels`
    std::uint32_t height = 0;
    ImageColorSpace color_space = ImageColorSpace::Srgb;
    ImageAlpha alpha = ImageAlpha::Straight;
};

}  // namespace pharos
