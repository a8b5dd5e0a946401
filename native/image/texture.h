// An image ready for look-ups: all pixels in memory in the depth they were stored with.
//
// Look-ups follow Cycles: uv (0, 0) is the bottom left corner, texel i covers [i, i + 1) / width.
// 8-bit sRGB images are interpolated as stored and made linear afterwards, through a table; images
// of higher depth are made linear when they are loaded. Colours are held multiplied by alpha except
// for data and channel-packed images; `straight_alpha` divides it out again. NaN and huge
// coordinates are safe. One channel is grey, two are grey and alpha.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/math.h"
#include "image/image_description.h"
#include "image/image_sampling.h"

namespace pharos {

enum class TexelType : std::uint8_t { U8, U16, Half, Float };

[[nodiscard]] constexpr std::size_t texel_bytes(TexelType type) {
    return type == TexelType::U8 ? 1 : type == TexelType::Float ? 4 : 2;
}

// Pixels as they lie in memory: interleaved channels, bottom row first, no padding.
struct TexturePixels {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t channels = 0;  // 1 ... 4
    TexelType type = TexelType::U8;
    std::vector<std::uint8_t> data;  // width * height * channels * texel_bytes(type)
};

struct TextureSampling {
    ImageInterpolation interpolation = ImageInterpolation::Linear;
    ImageExtension extension = ImageExtension::Repeat;
    bool straight_alpha = false;  // divide colours by alpha before they are made linear
};

class Texture {
  public:
    // A missing image: magenta everywhere.
    Texture() = default;

    // Takes the pixels over and converts them in place where their depth asks for it. Throws
    // std::invalid_argument when the size of `data` does not fit, Cancelled when it is.
    Texture(TexturePixels pixels,
            ImageColorSpace color_space,
            ImageAlpha alpha,
            const CancelFlag* cancel = nullptr);

    [[nodiscard]] Vec4 lookup(const Vec2& uv,
                              ImageInterpolation interpolation,
                              ImageExtension extension) const;

    // rgba holds four arrays of u.size() values each, one after the other: all r, all g, all b, all
    // a.
    void lookup(std::span<const float> u,
                std::span<const float> v,
                const TextureSampling& sampling,
                std::span<float> rgba) const;

    [[nodiscard]] bool missing() const { return pixels_.data.empty(); }

    [[nodiscard]] std::uint32_t width() const { return pixels_.width; }

    [[nodiscard]] std::uint32_t height() const { return pixels_.height; }

    [[nodiscard]] std::uint32_t channels() const { return pixels_.channels; }

    [[nodiscard]] TexelType type() const { return pixels_.type; }

    [[nodiscard]] Vec4 mean() const { return mean_; }  // over all texels, scene-linear

    [[nodiscard]] std::uint64_t bytes() const { return pixels_.data.size(); }

  private:
    [[nodiscard]] Vec4 compute_mean() const;

    TexturePixels pixels_;       // padded, so that a whole vector can be read at the last texel
    bool srgb_encoded_ = false;  // 8-bit: convert after interpolation
    bool associated_ = false;    // colours are multiplied by alpha
    Vec4 mean_{1.0f, 0.0f, 1.0f, 1.0f};
};

}  // namespace pharos
