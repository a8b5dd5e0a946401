// Image files of any contents, packed and on disk: refused or decoded, and looked up.

#include "core/check.h"
#include "image/image_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace pharos;
    DecodedImage image = read_image_bytes(std::span(data, size));
    CHECK(image.error.empty() == !image.pixels.data.empty());
    if (!image.error.empty()) {
        return 0;
    }
    const Texture texture(std::move(image.pixels), ImageColorSpace::Srgb, ImageAlpha::Straight);
    for (const float x : {-1e9f, 0.0f, 0.3f, 1.0f, 1e30f}) {
        static_cast<void>(
            texture.lookup(Vec2(x, 0.7f), ImageInterpolation::Cubic, ImageExtension::Repeat));
    }
    return 0;
}
