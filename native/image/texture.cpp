#include "image/texture.h"

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/color.h"
#include "image/texel_read.h"

namespace pharos {

namespace detail {

SrgbTable::SrgbTable() {
    for (int i = 0; i <= static_cast<int>(kSegments); ++i) {
        points_[i] = srgb_to_linear(static_cast<float>(i) / kSegments);
    }
}

const SrgbTable& srgb_table() {
    static const SrgbTable table;
    return table;
}

}  // namespace detail

namespace {

constexpr float kLargestHalf = 65504.0f;
constexpr std::size_t kCancelPollInterval = 1u << 18;  // texels

[[nodiscard]] std::uint16_t to_half(float v) {
    return static_cast<std::uint16_t>(
        _cvtss_sh(std::clamp(v, -kLargestHalf, kLargestHalf), _MM_FROUND_TO_NEAREST_INT));
}

[[nodiscard]] float from_half(std::uint16_t v) {
    return _cvtsh_ss(v);
}

// One channel value as a float, and back, for each depth.
template <TexelType Type>
struct Channel;

template <>
struct Channel<TexelType::U8> {
    using Stored = std::uint8_t;

    static float get(Stored v) { return static_cast<float>(v) * (1.0f / 255.0f); }

    static Stored put(float v) { return static_cast<Stored>(saturate(v) * 255.0f + 0.5f); }

    // Rounded down, as Cycles does: a step is visible where alpha is divided out again.
    static Stored product(Stored v, Stored alpha) {
        return static_cast<Stored>(unsigned{v} * unsigned{alpha} / 255u);
    }
};

template <>
struct Channel<TexelType::U16> {
    using Stored = std::uint16_t;

    static float get(Stored v) { return static_cast<float>(v) * (1.0f / 65535.0f); }

    static Stored put(float v) { return static_cast<Stored>(saturate(v) * 65535.0f + 0.5f); }

    static Stored product(Stored v, Stored alpha) {
        return static_cast<Stored>(std::uint32_t{v} * std::uint32_t{alpha} / 65535u);
    }
};

template <>
struct Channel<TexelType::Half> {
    using Stored = std::uint16_t;

    static float get(Stored v) { return from_half(v); }

    static Stored put(float v) { return to_half(v); }
};

template <>
struct Channel<TexelType::Float> {
    using Stored = float;

    static float get(Stored v) { return v; }

    static Stored put(float v) { return v; }
};

// What becomes of the stored values when a texture takes pixels over.
struct Conversion {
    bool to_linear = false;   // sRGB of more than 8 bits
    bool multiply = false;    // straight alpha: multiply colours by it
    bool unmultiply = false;  // multiplied alpha: divide before the curve, multiply again after it
    bool opaque = false;      // ignore the stored alpha
    bool has_alpha = false;

    [[nodiscard]] bool changes_texels() const { return to_linear || multiply || opaque; }
};

// Reads texels of depth From and writes them as depth To over the same memory.
template <TexelType From, TexelType To>
void convert_texels(TexturePixels& pixels, const Conversion& conversion, const CancelFlag* cancel) {
    using Source = typename Channel<From>::Stored;
    using Target = typename Channel<To>::Stored;
    static_assert(sizeof(Source) == sizeof(Target));
    const std::uint32_t channels = pixels.channels;
    const std::uint32_t colors = conversion.has_alpha ? channels - 1 : channels;
    const std::size_t count = std::size_t{pixels.width} * pixels.height;
    std::uint8_t* bytes = pixels.data.data();
    for (std::size_t i = 0; i < count; ++i, bytes += channels * sizeof(Source)) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        std::array<Source, 4> in{};
        std::memcpy(in.data(), bytes, channels * sizeof(Source));
        float alpha = 1.0f;
        if (conversion.has_alpha && !conversion.opaque) {
            alpha = Channel<From>::get(in[colors]);
        }
        std::array<Target, 4> out{};
        for (std::uint32_t k = 0; k < colors; ++k) {
            if constexpr (requires { Channel<To>::product(in[0], in[0]); }) {
                if (conversion.multiply && !conversion.to_linear) {
                    out[k] = Channel<To>::product(in[k], in[colors]);
                    continue;
                }
            }
            float value = Channel<From>::get(in[k]);
            if (conversion.to_linear) {
                const bool divide = conversion.unmultiply && alpha > 0.0f;
                value = srgb_to_linear(divide ? value / alpha : value);
                value = divide ? value * alpha : value;
            }
            out[k] = Channel<To>::put(conversion.multiply ? value * alpha : value);
        }
        if (conversion.has_alpha) {
            out[colors] = Channel<To>::put(alpha);
        }
        std::memcpy(bytes, out.data(), channels * sizeof(Target));
    }
}

void convert(TexturePixels& pixels, const Conversion& conversion, const CancelFlag* cancel) {
    switch (pixels.type) {
        case TexelType::U8:
            return convert_texels<TexelType::U8, TexelType::U8>(pixels, conversion, cancel);
        case TexelType::Half:
            return convert_texels<TexelType::Half, TexelType::Half>(pixels, conversion, cancel);
        case TexelType::Float:
            return convert_texels<TexelType::Float, TexelType::Float>(pixels, conversion, cancel);
        case TexelType::U16:
            break;
    }
    // Linear values of 16-bit sRGB need finer steps near black than integers have: half floats.
    if (conversion.to_linear) {
        convert_texels<TexelType::U16, TexelType::Half>(pixels, conversion, cancel);
        pixels.type = TexelType::Half;
    } else {
        convert_texels<TexelType::U16, TexelType::U16>(pixels, conversion, cancel);
    }
}

// A broken texel must not spread through interpolation.
void zero_non_finite(TexturePixels& pixels) {
    if (pixels.type == TexelType::Float) {
        auto* values = reinterpret_cast<float*>(pixels.data.data());
        for (std::size_t i = 0; i < pixels.data.size() / sizeof(float); ++i) {
            values[i] = std::isfinite(values[i]) ? values[i] : 0.0f;
        }
    } else if (pixels.type == TexelType::Half) {
        auto* values = reinterpret_cast<std::uint16_t*>(pixels.data.data());
        for (std::size_t i = 0; i < pixels.data.size() / sizeof(std::uint16_t); ++i) {
            values[i] = (values[i] & 0x7c00u) == 0x7c00u ? std::uint16_t{0} : values[i];
        }
    }
}

}  // namespace

Texture::Texture(TexturePixels pixels,
                 ImageColorSpace color_space,
                 ImageAlpha alpha,
                 const CancelFlag* cancel)
    : pixels_(std::move(pixels)) {
    const std::size_t expected =
        std::size_t{pixels_.width} * pixels_.height * pixels_.channels * texel_bytes(pixels_.type);
    if (expected == 0 || pixels_.channels > 4 || pixels_.data.size() != expected) {
        throw std::invalid_argument("Texture: " + std::to_string(pixels_.data.size()) +
                                    " bytes do not make " + std::to_string(pixels_.width) + " x " +
                                    std::to_string(pixels_.height) + " texels of " +
                                    std::to_string(pixels_.channels) + " channels");
    }
    throw_if_cancelled(cancel);
    zero_non_finite(pixels_);

    Conversion conversion;
    conversion.has_alpha = pixels_.channels == 2 || pixels_.channels == 4;
    conversion.to_linear = color_space == ImageColorSpace::Srgb && pixels_.type != TexelType::U8;
    conversion.opaque = alpha == ImageAlpha::None && conversion.has_alpha;
    // Data and channel-packed images hold values that have nothing to do with their alpha.
    associated_ = conversion.has_alpha && color_space != ImageColorSpace::Data &&
                  (alpha == ImageAlpha::Straight || alpha == ImageAlpha::Premultiplied);
    conversion.multiply = associated_ && alpha == ImageAlpha::Straight;
    // Cycles does not do that to floats.
    conversion.unmultiply =
        associated_ && alpha == ImageAlpha::Premultiplied && pixels_.type == TexelType::U16;
    if (conversion.changes_texels()) {
        convert(pixels_, conversion, cancel);
    }
    throw_if_cancelled(cancel);
    srgb_encoded_ = color_space == ImageColorSpace::Srgb && pixels_.type == TexelType::U8;
    pixels_.data.resize(expected + detail::kTexelPadding);
    mean_ = compute_mean();
}

Vec4 Texture::compute_mean() const {
    constexpr std::size_t kMostTexels = 1u << 18;  // every n-th of a larger image
    const std::size_t count = std::size_t{pixels_.width} * pixels_.height;
    const std::size_t step = std::max<std::size_t>(1, count / kMostTexels);
    const detail::SrgbTable& table = detail::srgb_table();
    glm::dvec4 sum(0.0);
    std::size_t read = 0;
    detail::with_layout(pixels_.type, pixels_.channels, [&]<TexelType Type, int Channels>() {
        for (std::size_t i = 0; i < count; i += step, ++read) {
            __m128 texel = detail::read_texel<Type, Channels>(pixels_.data.data(), i);
            texel = srgb_encoded_ ? table.to_linear(texel) : texel;
            alignas(16) float value[4];
            _mm_store_ps(value, texel);
            sum += glm::dvec4(value[0], value[1], value[2], value[3]);
        }
    });
    return Vec4(sum / static_cast<double>(read));
}

}  // namespace pharos
