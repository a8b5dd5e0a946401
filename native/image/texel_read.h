// Reading one texel of any depth and channel count as four floats (internal to image/).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include <immintrin.h>

#include "image/texture.h"

namespace pharos::detail {

// Bytes kept readable after the last texel, so that every texel can be read as a whole vector.
inline constexpr std::size_t kTexelPadding = 16;

// Channels as stored, in the unit range for integers; missing channels are undefined.
template <TexelType Type>
[[nodiscard]] inline __m128 read_channels(const std::uint8_t* texel) {
    if constexpr (Type == TexelType::U8) {
        std::int32_t packed = 0;
        std::memcpy(&packed, texel, sizeof(packed));
        const __m128i wide = _mm_cvtepu8_epi32(_mm_cvtsi32_si128(packed));
        return _mm_mul_ps(_mm_cvtepi32_ps(wide), _mm_set1_ps(1.0f / 255.0f));
    } else if constexpr (Type == TexelType::Float) {
        return _mm_loadu_ps(reinterpret_cast<const float*>(texel));
    } else {
        const __m128i packed = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(texel));
        if constexpr (Type == TexelType::Half) {
            return _mm_cvtph_ps(packed);
        } else {
            const __m128 wide = _mm_cvtepi32_ps(_mm_cvtepu16_epi32(packed));
            return _mm_mul_ps(wide, _mm_set1_ps(1.0f / 65535.0f));
        }
    }
}

// (r, g, b, a) of texel `index`: grey is spread, a missing alpha is 1.
template <TexelType Type, int Channels>
[[nodiscard]] inline __m128 read_texel(const std::uint8_t* data, std::size_t index) {
    const __m128 c = read_channels<Type>(
        data + index * (static_cast<std::size_t>(Channels) * texel_bytes(Type)));
    const __m128 one = _mm_set1_ps(1.0f);
    if constexpr (Channels == 1) {
        return _mm_blend_ps(_mm_shuffle_ps(c, c, 0), one, 8);
    } else if constexpr (Channels == 2) {
        return _mm_shuffle_ps(c, c, _MM_SHUFFLE(1, 0, 0, 0));
    } else if constexpr (Channels == 3) {
        return _mm_blend_ps(c, one, 8);
    } else {
        return c;
    }
}

// Calls function.template operator()<Type, Channels>() for the texture's layout.
template <class Function>
decltype(auto) with_layout(TexelType type, std::uint32_t channels, const Function& function) {
    const auto by_channels = [&]<TexelType Type>() {
        switch (channels) {
            case 1:
                return function.template operator()<Type, 1>();
            case 2:
                return function.template operator()<Type, 2>();
            case 3:
                return function.template operator()<Type, 3>();
            default:
                return function.template operator()<Type, 4>();
        }
    };
    switch (type) {
        case TexelType::U8:
            return by_channels.template operator()<TexelType::U8>();
        case TexelType::U16:
            return by_channels.template operator()<TexelType::U16>();
        case TexelType::Half:
            return by_channels.template operator()<TexelType::Half>();
        default:
            return by_channels.template operator()<TexelType::Float>();
    }
}

// sRGB to linear by linear interpolation between 2041 points: the 256 byte values are points, and
// between them the error stays below 2e-7.
class SrgbTable {
  public:
    SrgbTable();

    // Linear values of the first three lanes; the fourth is kept.
    [[nodiscard]] __m128 to_linear(__m128 encoded) const {
        const __m128 position =
            _mm_min_ps(_mm_max_ps(_mm_mul_ps(encoded, _mm_set1_ps(kSegments)), _mm_setzero_ps()),
                       _mm_set1_ps(kSegments));
        const __m128i segment = _mm_min_epi32(_mm_cvttps_epi32(position),
                                              _mm_set1_epi32(static_cast<int>(kSegments) - 1));
        const __m128 t = _mm_sub_ps(position, _mm_cvtepi32_ps(segment));
        const __m128 lower = _mm_i32gather_ps(points_, segment, 4);
        const __m128 upper = _mm_i32gather_ps(points_ + 1, segment, 4);
        const __m128 linear = _mm_fmadd_ps(t, _mm_sub_ps(upper, lower), lower);
        return _mm_blend_ps(linear, encoded, 8);
    }

  private:
    static constexpr float kSegments = 2040.0f;  // 8 per byte value
    float points_[2041];
};

[[nodiscard]] const SrgbTable& srgb_table();

}  // namespace pharos::detail
