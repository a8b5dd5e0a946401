// An image description becomes a texture, or magenta and a line in the report.
#include <cstring>
#include <new>

#include "image/image_io.h"
#include "image/texel_read.h"

namespace pharos {

namespace {

// The 8-bit values behind float pixels, when every one of them is a multiple of 1/255: hosts hand
// byte images over as floats, a quarter of the memory and Cycles' interpolation need bytes.
[[nodiscard]] bool quantise(std::span<const float> pixels, std::vector<std::uint8_t>& bytes) {
    bytes.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const float scaled = pixels[i] * 255.0f;
        if (!(scaled > -0.5f && scaled < 255.5f)) {
            return false;
        }
        const float rounded = std::floor(scaled + 0.5f);
        if (std::abs(scaled - rounded) > 1e-4f) {
            return false;
        }
        bytes[i] = static_cast<std::uint8_t>(rounded);
    }
    return true;
}

[[nodiscard]] DecodedImage from_pixels(const ImageDescription& description) {
    DecodedImage image;
    image.straight_alpha = description.alpha == ImageAlpha::Straight;
    const std::uint64_t texels = std::uint64_t{description.width} * description.height;
    if (texels == 0 || description.width > kMaxImageSide || description.height > kMaxImageSide ||
        description.pixels.size() != 4 * texels) {
        image.error = "The image's pixels do not have its size";
        return image;
    }
    image.pixels.width = description.width;
    image.pixels.height = description.height;
    image.pixels.channels = 4;
    if (description.color_space == ImageColorSpace::Srgb &&
        quantise(description.pixels, image.pixels.data)) {
        image.pixels.type = TexelType::U8;
        return image;
    }
    image.pixels.type = TexelType::Float;
    const std::size_t bytes = description.pixels.size() * sizeof(float);
    image.pixels.data.reserve(bytes + detail::kTexelPadding);  // Texture will not copy them
    image.pixels.data.resize(bytes);
    std::memcpy(image.pixels.data.data(), description.pixels.data(), bytes);
    return image;
}

}  // namespace

Texture load_texture(const ImageDescription& description,
                     SceneReport& report,
                     const CancelFlag* cancel) {
    DecodedImage image;
    if (!description.pixels.empty()) {
        image = from_pixels(description);
    } else if (!description.bytes.empty()) {
        image = read_image_bytes(description.bytes, cancel);
    } else if (!description.path.empty()) {
        image = read_image_file(description.path, cancel);
    } else {
        image.error = "The image is missing";
    }
    if (image.error.empty()) {
        // Whether colours are multiplied by alpha is a property of the file, whatever the host
        // says.
        ImageAlpha alpha = description.alpha;
        if (alpha == ImageAlpha::Straight || alpha == ImageAlpha::Premultiplied) {
            alpha = image.straight_alpha ? ImageAlpha::Straight : ImageAlpha::Premultiplied;
        }
        try {
            return Texture(std::move(image.pixels), description.color_space, alpha, cancel);
        } catch (const std::bad_alloc&) {
            image.error = "There is not enough memory for the image";
        }
    }
    report.add({Severity::Warning, description.name, image.error, true});
    return Texture();
}

}  // namespace pharos
