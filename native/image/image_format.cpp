#include "image/image_format.h"

#include <string_view>

namespace pharos::detail {

namespace {

using namespace std::string_view_literals;

struct Magic {
    std::size_t offset;
    std::string_view bytes;
    const char* format;
};

constexpr Magic kMagics[] = {
    {0, "\x89PNG\r\n\x1a\n"sv, "png"},
    {0, "\xff\xd8\xff"sv, "jpeg"},
    {0, "\x76\x2f\x31\x01"sv, "openexr"},
    {0, "#?RADIANCE"sv, "hdr"},
    {0, "#?RGBE"sv, "hdr"},
    {0, "II*\0"sv, "tiff"},
    {0, "MM\0*"sv, "tiff"},
    {0, "II+\0"sv, "tiff"},  // BigTIFF
    {0, "MM\0+"sv, "tiff"},
    {0, "BM"sv, "bmp"},
    {8, "WEBP"sv, "webp"},
    {4, "jP  \r\n\x87\n"sv, "jpeg2000"},
    {0, "\xff\x4f\xff\x51"sv, "jpeg2000"},
    {0, "SDPX"sv, "dpx"},
    {0, "XPDS"sv, "dpx"},
    {0, "\x80\x2a\x5f\xd7"sv, "cineon"},
    {0, "\xd7\x5f\x2a\x80"sv, "cineon"},
};

// TGA has no signature: its 18 header bytes must make sense together.
[[nodiscard]] bool looks_like_tga(std::span<const std::uint8_t> h) {
    if (h.size() < 18) {
        return false;
    }
    const int map = h[1];
    const int kind = h[2];
    const int depth = h[16];
    const bool mapped = kind == 1 || kind == 9;
    const bool known = mapped || kind == 2 || kind == 3 || kind == 10 || kind == 11;
    const bool good_depth = depth == 8 || depth == 15 || depth == 16 || depth == 24 || depth == 32;
    const bool sized = (h[12] | h[13]) != 0 && (h[14] | h[15]) != 0;
    return known && good_depth && sized && (map == 1 || (map == 0 && !mapped)) &&
           (h[17] & 0xc0) == 0;
}

}  // namespace

const char* identify_image(std::span<const std::uint8_t> header) {
    const std::string_view text(reinterpret_cast<const char*>(header.data()), header.size());
    for (const Magic& magic : kMagics) {
        if (text.size() >= magic.offset + magic.bytes.size() &&
            text.substr(magic.offset, magic.bytes.size()) == magic.bytes) {
            return magic.format;
        }
    }
    return looks_like_tga(header) ? "targa" : nullptr;
}

}  // namespace pharos::detail
