// Look-ups: per axis the taps (indices and weights), then a weighted sum of texels.
#include <array>

#include "core/check.h"
#include "image/texel_read.h"
#include "image/texture.h"

namespace pharos {

namespace {

using detail::SrgbTable;

// Texels of one axis that a look-up reads; those outside of a clipped image weigh nothing.
template <int Count>
struct Taps {
    std::array<int, Count> index;
    std::array<float, Count> weight;
};

// Brings a coordinate near the image without changing what it means, so that it fits an int. NaN
// and infinity become 0.
template <ImageExtension Extension>
[[nodiscard]] float reduce(float u) {
    if constexpr (Extension == ImageExtension::Repeat) {
        u -= std::floor(u);
    } else if constexpr (Extension == ImageExtension::Mirror) {
        u -= 2.0f * std::floor(0.5f * u);
        u = u > 1.0f ? 2.0f - u : u;
    } else {
        u = std::clamp(u, -4.0f, 5.0f);
    }
    return std::isfinite(u) ? u : 0.0f;
}

template <ImageExtension Extension>
[[nodiscard]] int wrap(int i, int size) {
    if constexpr (Extension == ImageExtension::Repeat) {
        if (i >= 0 && i < size) [[likely]] {
            return i;
        }
        const int rest = i % size;
        return rest < 0 ? rest + size : rest;
    } else if constexpr (Extension == ImageExtension::Mirror) {
        const int period = 2 * size;
        const int rest = ((i % period) + period) % period;
        return rest < size ? rest : period - 1 - rest;
    } else {
        return std::clamp(i, 0, size - 1);
    }
}

// The texel that holds a point of a repeated image. At whole numbers below zero it is the one
// before, as in Cycles.
[[nodiscard]] int repeated_texel(float u, int size) {
    constexpr float kFar = 1e6f;
    const float x = u * static_cast<float>(size);
    const int texel =
        std::abs(x) < kFar
            ? static_cast<int>(x) - (x < 0.0f ? 1 : 0)
            : static_cast<int>(reduce<ImageExtension::Repeat>(u) * static_cast<float>(size));
    return wrap<ImageExtension::Repeat>(texel, size);
}

template <int Count, ImageExtension Extension>
[[nodiscard]] Taps<Count> make_taps(float u, int size) {
    Taps<Count> taps;
    if constexpr (Count == 1 && Extension == ImageExtension::Repeat) {
        return {{repeated_texel(u, size)}, {1.0f}};
    }
    // Closest takes the texel that holds the point, the others lie around texel centres.
    const float x = reduce<Extension>(u) * static_cast<float>(size) - (Count == 1 ? 0.0f : 0.5f);
    const float base = std::floor(x);
    const float t = x - base;
    if constexpr (Count == 1) {
        taps.weight = {1.0f};
    } else if constexpr (Count == 2) {
        taps.weight = {1.0f - t, t};
    } else {  // uniform cubic B-spline
        const float s = 1.0f - t;
        taps.weight = {s * s * s * (1.0f / 6.0f),
                       (2.0f / 3.0f) - t * t * (1.0f - 0.5f * t),
                       (2.0f / 3.0f) - s * s * (1.0f - 0.5f * s),
                       t * t * t * (1.0f / 6.0f)};
    }
    const int first = static_cast<int>(base) - (Count == 4 ? 1 : 0);
    for (int i = 0; i < Count; ++i) {
        const int index = first + i;
        if (Extension == ImageExtension::Clip && (index < 0 || index >= size)) {
            taps.weight[static_cast<std::size_t>(i)] = 0.0f;
        }
        taps.index[static_cast<std::size_t>(i)] = wrap<Extension>(index, size);
    }
    return taps;
}

// What every lane of a batch shares.
struct View {
    const std::uint8_t* data;
    int width;
    int height;
    bool divide_alpha;
    const SrgbTable* srgb;  // null: already linear
};

[[nodiscard]] __m128 finish(const View& view, __m128 texel) {
    if (view.divide_alpha) {
        const float alpha = _mm_cvtss_f32(_mm_shuffle_ps(texel, texel, _MM_SHUFFLE(3, 3, 3, 3)));
        if (alpha != 1.0f && alpha != 0.0f) {
            const __m128 divided = _mm_mul_ps(texel, _mm_set1_ps(1.0f / alpha));
            texel = _mm_blend_ps(divided, texel, 8);
        }
    }
    return view.srgb != nullptr ? view.srgb->to_linear(texel) : texel;
}

template <TexelType Type, int Channels, int Count, ImageExtension Extension>
[[nodiscard]] __m128 lookup_one(const View& view, float u, float v) {
    const Taps<Count> column = make_taps<Count, Extension>(u, view.width);
    const Taps<Count> row = make_taps<Count, Extension>(v, view.height);
    __m128 sum = _mm_setzero_ps();
    for (std::size_t y = 0; y < Count; ++y) {
        const std::size_t start =
            static_cast<std::size_t>(row.index[y]) * static_cast<std::size_t>(view.width);
        __m128 line = _mm_setzero_ps();
        for (std::size_t x = 0; x < Count; ++x) {
            const __m128 texel = detail::read_texel<Type, Channels>(
                view.data, start + static_cast<std::size_t>(column.index[x]));
            // A missing alpha counts as 1 inside of the image only: the weight does that.
            line = _mm_fmadd_ps(texel, _mm_set1_ps(column.weight[x]), line);
        }
        sum = _mm_fmadd_ps(line, _mm_set1_ps(row.weight[y]), sum);
    }
    return finish(view, sum);
}

template <TexelType Type, int Channels, int Count, ImageExtension Extension>
void lookup_lanes(const View& view,
                  std::span<const float> u,
                  std::span<const float> v,
                  std::span<float> rgba) {
    const std::size_t lanes = u.size();
    for (std::size_t i = 0; i < lanes; ++i) {
        alignas(16) float value[4];
        _mm_store_ps(value, lookup_one<Type, Channels, Count, Extension>(view, u[i], v[i]));
        for (std::size_t k = 0; k < 4; ++k) {
            rgba[k * lanes + i] = value[k];
        }
    }
}

using LookupFunction = void (*)(const View&,
                                std::span<const float>,
                                std::span<const float>,
                                std::span<float>);

template <TexelType Type, int Channels, int Count>
[[nodiscard]] LookupFunction by_extension(ImageExtension extension) {
    switch (extension) {
        case ImageExtension::Extend:
            return lookup_lanes<Type, Channels, Count, ImageExtension::Extend>;
        case ImageExtension::Clip:
            return lookup_lanes<Type, Channels, Count, ImageExtension::Clip>;
        case ImageExtension::Mirror:
            return lookup_lanes<Type, Channels, Count, ImageExtension::Mirror>;
        default:
            return lookup_lanes<Type, Channels, Count, ImageExtension::Repeat>;
    }
}

template <TexelType Type, int Channels>
[[nodiscard]] LookupFunction choose(const TextureSampling& sampling) {
    switch (sampling.interpolation) {
        case ImageInterpolation::Closest:
            return by_extension<Type, Channels, 1>(sampling.extension);
        case ImageInterpolation::Linear:
            return by_extension<Type, Channels, 2>(sampling.extension);
        default:  // Smart is cubic where a texel covers more than a pixel: taken as cubic
            return by_extension<Type, Channels, 4>(sampling.extension);
    }
}

}  // namespace

void Texture::lookup(std::span<const float> u,
                     std::span<const float> v,
                     const TextureSampling& sampling,
                     std::span<float> rgba) const {
    CHECK_EQ(u.size(), v.size());
    CHECK_EQ(4 * u.size(), rgba.size());
    if (missing()) {
        for (std::size_t i = 0; i < rgba.size(); ++i) {
            rgba[i] = i / u.size() == 1 ? 0.0f : 1.0f;
        }
        return;
    }
    const View view{pixels_.data.data(),
                    static_cast<int>(pixels_.width),
                    static_cast<int>(pixels_.height),
                    sampling.straight_alpha && associated_,
                    srgb_encoded_ ? &detail::srgb_table() : nullptr};
    const LookupFunction function = detail::with_layout(
        pixels_.type, pixels_.channels, [&]<TexelType Type, int Channels>() -> LookupFunction {
            return choose<Type, Channels>(sampling);
        });
    function(view, u, v, rgba);
}

Vec4 Texture::lookup(const Vec2& uv,
                     ImageInterpolation interpolation,
                     ImageExtension extension) const {
    Vec4 result;
    lookup({&uv.x, 1}, {&uv.y, 1}, {interpolation, extension, false}, {&result.x, 4});
    return result;
}

}  // namespace pharos
