// Look-ups against values computed by hand from the definition of each extension and interpolation.
#include "image/texture.h"

#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/color.h"
#include "support/random.h"
#include "support/stress.h"

namespace pharos {
namespace {

constexpr ImageInterpolation kInterpolations[] = {
    ImageInterpolation::Linear, ImageInterpolation::Closest, ImageInterpolation::Cubic};
constexpr ImageExtension kExtensions[] = {
    ImageExtension::Repeat, ImageExtension::Extend, ImageExtension::Clip, ImageExtension::Mirror};

[[nodiscard]] TexturePixels float_pixels(std::uint32_t width,
                                         std::uint32_t height,
                                         std::uint32_t channels,
                                         const std::vector<float>& values) {
    TexturePixels pixels{width, height, channels, TexelType::Float, {}};
    pixels.data.resize(values.size() * sizeof(float));
    std::memcpy(pixels.data.data(), values.data(), pixels.data.size());
    return pixels;
}

[[nodiscard]] TexturePixels byte_pixels(std::uint32_t width,
                                        std::uint32_t height,
                                        std::uint32_t channels,
                                        const std::vector<std::uint8_t>& values) {
    return {width, height, channels, TexelType::U8, values};
}

// The texel an index outside of [0, size) stands for; -1: nothing.
[[nodiscard]] long wrapped(long i, long size, ImageExtension extension) {
    switch (extension) {
        case ImageExtension::Repeat:
            return ((i % size) + size) % size;
        case ImageExtension::Extend:
            return std::clamp(i, 0l, size - 1);
        case ImageExtension::Clip:
            return i < 0 || i >= size ? -1 : i;
        case ImageExtension::Mirror: {
            const long m = ((i % (2 * size)) + 2 * size) % (2 * size);
            return m < size ? m : 2 * size - 1 - m;
        }
    }
    return -1;
}

// Weight of the texel at distance x from the point, in texels.
[[nodiscard]] double kernel(double x, ImageInterpolation interpolation) {
    const double d = std::abs(x);
    if (interpolation == ImageInterpolation::Linear) {
        return std::max(0.0, 1.0 - d);
    }
    if (d < 1.0) {  // cubic B-spline
        return (4.0 - 6.0 * d * d + 3.0 * d * d * d) / 6.0;
    }
    return d < 2.0 ? std::pow(2.0 - d, 3.0) / 6.0 : 0.0;
}

[[nodiscard]] double expected(const std::vector<float>& texels,
                              long width,
                              long height,
                              const Vec2& uv,
                              ImageInterpolation interpolation,
                              ImageExtension extension) {
    const double x = static_cast<double>(uv.x) * static_cast<double>(width);
    const double y = static_cast<double>(uv.y) * static_cast<double>(height);
    const auto texel = [&](long i, long j) {
        const long a = wrapped(i, width, extension);
        const long b = wrapped(j, height, extension);
        return a < 0 || b < 0
                   ? 0.0
                   : static_cast<double>(texels[static_cast<std::size_t>(b * width + a)]);
    };
    if (interpolation == ImageInterpolation::Closest) {
        return texel(std::lround(std::floor(x)), std::lround(std::floor(y)));
    }
    double sum = 0.0;
    for (long j = std::lround(std::floor(y)) - 3; j <= std::lround(std::floor(y)) + 3; ++j) {
        for (long i = std::lround(std::floor(x)) - 3; i <= std::lround(std::floor(x)) + 3; ++i) {
            sum += texel(i, j) * kernel(x - static_cast<double>(i) - 0.5, interpolation) *
                   kernel(y - static_cast<double>(j) - 0.5, interpolation);
        }
    }
    return sum;
}

TEST(Texture, EveryExtensionAndInterpolationMatchesItsDefinition) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> value(0.0f, 2.0f);
    std::uniform_real_distribution<float> coordinate(-2.6f, 3.4f);
    for (const auto& [width, height] : {std::pair{5u, 3u}, {1u, 1u}, {2u, 7u}, {16u, 1u}}) {
        std::vector<float> texels(std::size_t{width} * height);
        for (float& t : texels) {
            t = value(random);
        }
        const Texture texture(
            float_pixels(width, height, 1, texels), ImageColorSpace::Linear, ImageAlpha::Straight);
        for (const ImageInterpolation interpolation : kInterpolations) {
            for (const ImageExtension extension : kExtensions) {
                for (int i = 0; i < 200; ++i) {
                    const Vec2 uv(coordinate(random), coordinate(random));
                    const Vec4 got = texture.lookup(uv, interpolation, extension);
                    const double want =
                        expected(texels, width, height, uv, interpolation, extension);
                    // Coordinates are rounded to float, so values move by the slope times 1e-6.
                    EXPECT_NEAR(static_cast<double>(got.x), want, 4e-5)
                        << uv.x << ' ' << uv.y << ' ' << static_cast<int>(interpolation) << ' '
                        << static_cast<int>(extension);
                    EXPECT_EQ(got.x, got.z);
                }
            }
        }
    }
}

TEST(Texture, OriginIsBottomLeft) {
    const Texture texture(float_pixels(2, 2, 1, {1.0f, 2.0f, 3.0f, 4.0f}),
                          ImageColorSpace::Linear,
                          ImageAlpha::Straight);
    const auto at = [&](float u, float v) {
        return texture.lookup(Vec2(u, v), ImageInterpolation::Closest, ImageExtension::Repeat).x;
    };
    EXPECT_EQ(at(0.25f, 0.25f), 1.0f);
    EXPECT_EQ(at(0.75f, 0.25f), 2.0f);
    EXPECT_EQ(at(0.25f, 0.75f), 3.0f);
    EXPECT_EQ(at(0.75f, 0.75f), 4.0f);
}

TEST(Texture, ClipFadesOutOverHalfATexelAndHasNoAlphaOutside) {
    const Texture texture(float_pixels(4, 4, 1, std::vector<float>(16, 1.0f)),
                          ImageColorSpace::Linear,
                          ImageAlpha::None);
    const auto at = [&](float u) {
        return texture.lookup(Vec2(u, 0.5f), ImageInterpolation::Linear, ImageExtension::Clip);
    };
    EXPECT_EQ(at(0.5f), Vec4(1.0f));
    EXPECT_NEAR(at(0.0f).x, 0.5f, 1e-6f);
    EXPECT_NEAR(at(0.0f).w, 0.5f, 1e-6f);
    EXPECT_EQ(at(-0.126f), Vec4(0.0f));
    EXPECT_EQ(at(1.126f), Vec4(0.0f));
}

TEST(Texture, AnyCoordinateIsSafe) {
    const float extremes[] = {NAN,
                              INFINITY,
                              -INFINITY,
                              1e30f,
                              -1e30f,
                              1e9f,
                              -1e-30f,
                              3.4e38f,
                              -0.0f,
                              std::nextafter(1.0f, 0.0f),
                              -1e-9f};
    const Texture texture(float_pixels(3, 2, 3, std::vector<float>(18, 0.5f)),
                          ImageColorSpace::Linear,
                          ImageAlpha::Straight);
    for (const float u : extremes) {
        for (const float v : extremes) {
            for (const ImageInterpolation interpolation : kInterpolations) {
                for (const ImageExtension extension : kExtensions) {
                    const Vec4 c = texture.lookup(Vec2(u, v), interpolation, extension);
                    EXPECT_TRUE(std::isfinite(c.x) && c.x >= 0.0f && c.x <= 0.500001f);
                    if (extension != ImageExtension::Clip) {
                        EXPECT_NEAR(c.x, 0.5f, 1e-6f);
                        EXPECT_NEAR(c.w, 1.0f, 1e-6f);
                    }
                }
            }
        }
    }
}

TEST(Texture, MissingIsMagenta) {
    const Texture texture;
    EXPECT_TRUE(texture.missing());
    EXPECT_EQ(texture.lookup(Vec2(0.3f), ImageInterpolation::Linear, ImageExtension::Clip),
              Vec4(1.0f, 0.0f, 1.0f, 1.0f));
    EXPECT_EQ(texture.mean(), Vec4(1.0f, 0.0f, 1.0f, 1.0f));
}

TEST(Texture, RefusesPixelsOfTheWrongSize) {
    EXPECT_THROW(Texture(byte_pixels(2, 2, 3, std::vector<std::uint8_t>(11)),
                         ImageColorSpace::Srgb,
                         ImageAlpha::None),
                 std::invalid_argument);
    EXPECT_THROW(Texture(byte_pixels(1, 1, 5, std::vector<std::uint8_t>(5)),
                         ImageColorSpace::Srgb,
                         ImageAlpha::None),
                 std::invalid_argument);
    EXPECT_THROW(Texture(TexturePixels(), ImageColorSpace::Srgb, ImageAlpha::None),
                 std::invalid_argument);
}

TEST(Texture, ByteValuesFollowTheSrgbCurve) {
    std::vector<std::uint8_t> bytes(256);
    for (int i = 0; i < 256; ++i) {
        bytes[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i);
    }
    const Texture srgb(byte_pixels(256, 1, 1, bytes), ImageColorSpace::Srgb, ImageAlpha::None);
    const Texture data(byte_pixels(256, 1, 1, bytes), ImageColorSpace::Data, ImageAlpha::None);
    for (int i = 0; i < 256; ++i) {
        const Vec2 uv((static_cast<float>(i) + 0.5f) / 256.0f, 0.5f);
        const float encoded = static_cast<float>(i) / 255.0f;
        EXPECT_NEAR(srgb.lookup(uv, ImageInterpolation::Closest, ImageExtension::Repeat).x,
                    srgb_to_linear(encoded),
                    2e-7f);
        EXPECT_NEAR(
            data.lookup(uv, ImageInterpolation::Closest, ImageExtension::Repeat).x, encoded, 1e-7f);
    }
    // Between texels the stored values are mixed, then the curve is applied (as Cycles).
    const Texture two(byte_pixels(2, 1, 1, {0, 255}), ImageColorSpace::Srgb, ImageAlpha::None);
    for (float t = 0.0f; t <= 1.0f; t += 0.01f) {
        const Vec2 uv(0.25f + 0.5f * t, 0.5f);
        EXPECT_NEAR(two.lookup(uv, ImageInterpolation::Linear, ImageExtension::Extend).x,
                    srgb_to_linear(t),
                    2e-6f);
    }
}

TEST(Texture, EveryDepthAndChannelCountReadsTheSame) {
    const float values[4] = {0.25f, 0.5f, 0.75f, 1.0f};
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
        for (const TexelType type :
             {TexelType::U8, TexelType::U16, TexelType::Half, TexelType::Float}) {
            constexpr std::uint16_t kHalf[4] = {0x3400, 0x3800, 0x3a00, 0x3c00};
            TexturePixels pixels{3, 3, channels, type, {}};
            for (int texel = 0; texel < 9; ++texel) {
                for (std::uint32_t k = 0; k < channels; ++k) {
                    const float v = values[channels == 2 && k == 1 ? 3 : k];
                    std::uint8_t raw[4];
                    if (type == TexelType::U8) {
                        raw[0] = static_cast<std::uint8_t>(std::lround(v * 255.0f));
                    } else if (type == TexelType::U16) {
                        const auto u = static_cast<std::uint16_t>(std::lround(v * 65535.0f));
                        std::memcpy(raw, &u, 2);
                    } else if (type == TexelType::Half) {
                        std::memcpy(raw, &kHalf[channels == 2 && k == 1 ? 3 : k], 2);
                    } else {
                        std::memcpy(raw, &v, 4);
                    }
                    pixels.data.insert(pixels.data.end(), raw, raw + texel_bytes(type));
                }
            }
            const Texture texture(std::move(pixels), ImageColorSpace::Data, ImageAlpha::Straight);
            const float tolerance = type == TexelType::U8 ? 0.003f : 1e-4f;
            for (const ImageInterpolation interpolation : kInterpolations) {
                const Vec4 c =
                    texture.lookup(Vec2(0.9f, 0.9f), interpolation, ImageExtension::Repeat);
                EXPECT_NEAR(c.x, 0.25f, tolerance);
                EXPECT_NEAR(c.y, channels >= 3 ? 0.5f : 0.25f, tolerance);
                EXPECT_NEAR(c.z, channels >= 3 ? 0.75f : 0.25f, tolerance);
                EXPECT_NEAR(c.w, 1.0f, tolerance);
            }
            EXPECT_NEAR(texture.mean().x, 0.25f, tolerance);
        }
    }
}

TEST(Texture, AlphaModes) {
    const std::vector<float> texel = {0.8f, 0.4f, 0.2f, 0.5f};
    const auto look = [&](ImageColorSpace space, ImageAlpha alpha, bool straight) {
        const Texture texture(float_pixels(1, 1, 4, texel), space, alpha);
        Vec4 c;
        const float u = 0.5f;
        texture.lookup({&u, 1}, {&u, 1}, {{}, {}, straight}, {&c.x, 4});
        return c;
    };
    const auto near = [](const Vec4& a, const Vec4& b) {
        return glm::all(glm::lessThan(glm::abs(a - b), Vec4(1e-6f)));
    };
    const Vec4 raw(0.8f, 0.4f, 0.2f, 0.5f);
    EXPECT_TRUE(near(look(ImageColorSpace::Linear, ImageAlpha::Straight, false),
                     Vec4(0.4f, 0.2f, 0.1f, 0.5f)));
    EXPECT_TRUE(near(look(ImageColorSpace::Linear, ImageAlpha::Straight, true), raw));
    EXPECT_TRUE(near(look(ImageColorSpace::Linear, ImageAlpha::Premultiplied, false), raw));
    EXPECT_TRUE(near(look(ImageColorSpace::Linear, ImageAlpha::Premultiplied, true),
                     Vec4(1.6f, 0.8f, 0.4f, 0.5f)));
    EXPECT_TRUE(near(look(ImageColorSpace::Linear, ImageAlpha::ChannelPacked, true), raw));
    EXPECT_TRUE(near(look(ImageColorSpace::Data, ImageAlpha::Straight, false), raw));
    EXPECT_TRUE(
        near(look(ImageColorSpace::Linear, ImageAlpha::None, false), Vec4(0.8f, 0.4f, 0.2f, 1.0f)));
    // The curve applies to colours as they were before alpha was multiplied.
    const Vec4 curved(srgb_to_linear(0.8f) * 0.5f,
                      srgb_to_linear(0.4f) * 0.5f,
                      srgb_to_linear(0.2f) * 0.5f,
                      0.5f);
    EXPECT_TRUE(near(look(ImageColorSpace::Srgb, ImageAlpha::Straight, false), curved));
    // As Cycles, to floats that come multiplied it is applied as they are.
    const Vec4 direct(srgb_to_linear(0.8f), srgb_to_linear(0.4f), srgb_to_linear(0.2f), 0.5f);
    EXPECT_TRUE(near(look(ImageColorSpace::Srgb, ImageAlpha::Premultiplied, false), direct));
}

TEST(Texture, BrokenTexelsDoNotSpread) {
    const Texture texture(
        float_pixels(2, 1, 1, {NAN, 1.0f}), ImageColorSpace::Linear, ImageAlpha::None);
    const Vec4 c = texture.lookup(Vec2(0.5f), ImageInterpolation::Linear, ImageExtension::Extend);
    EXPECT_NEAR(c.x, 0.5f, 1e-6f);
}

TEST(Texture, BatchesEqualSingleLookups) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> coordinate(-1.0f, 2.0f);
    std::vector<std::uint8_t> bytes(64 * 32 * 4);
    for (std::uint8_t& b : bytes) {
        b = static_cast<std::uint8_t>(random());
    }
    const Texture texture(
        byte_pixels(64, 32, 4, bytes), ImageColorSpace::Srgb, ImageAlpha::ChannelPacked);
    for (const std::size_t lanes : {std::size_t{1}, std::size_t{7}, std::size_t{500}}) {
        std::vector<float> u(lanes);
        std::vector<float> v(lanes);
        std::vector<float> rgba(4 * lanes);
        for (std::size_t i = 0; i < lanes; ++i) {
            u[i] = coordinate(random);
            v[i] = coordinate(random);
        }
        texture.lookup(u, v, TextureSampling(), rgba);
        for (std::size_t i = 0; i < lanes; ++i) {
            const Vec4 one = texture.lookup(
                Vec2(u[i], v[i]), ImageInterpolation::Linear, ImageExtension::Repeat);
            for (std::size_t k = 0; k < 4; ++k) {
                EXPECT_EQ(rgba[k * lanes + i], one[static_cast<int>(k)]);
            }
        }
    }
}

// Coordinates of any size, images of any depth and shape: no look-up leaves the texels' range.
TEST(Texture, AnyCoordinatesGiveTexels) {
    const std::uint64_t tries = testing::case_count(400000, 20000000);
    constexpr float kExtremes[] = {0.0f,
                                   -0.0f,
                                   1.0f,
                                   1e-30f,
                                   -1e-7f,
                                   0.99999994f,
                                   1e9f,
                                   -1e30f,
                                   3e38f,
                                   std::numeric_limits<float>::infinity(),
                                   NAN};
    std::uint64_t bad = 0;
    test::Random random(31);
    for (std::uint64_t i = 0; i < tries; i += 200) {
        const std::uint32_t width = 1 + random.index(9);
        const std::uint32_t height = 1 + random.index(9);
        const std::uint32_t channels = 1 + random.index(4);
        TexturePixels pixels{width, height, channels, static_cast<TexelType>(random.index(4)), {}};
        pixels.data.resize(std::size_t{width} * height * channels * texel_bytes(pixels.type));
        for (std::size_t k = 0; k < pixels.data.size(); ++k) {
            // Floats and halves between 0 and 2; others as they come.
            const bool top = pixels.type == TexelType::Float ? k % 4 == 3 : k % 2 == 1;
            pixels.data[k] = pixels.type == TexelType::Half || pixels.type == TexelType::Float
                                 ? static_cast<std::uint8_t>(top ? 0x3c : 0)
                                 : static_cast<std::uint8_t>(random.index(256));
        }
        const auto alpha = static_cast<ImageAlpha>(random.index(4));
        const Texture texture(
            std::move(pixels), static_cast<ImageColorSpace>(random.index(3)), alpha);
        // Colours over their alpha are not those of a picture, but numbers.
        const float most = alpha == ImageAlpha::Premultiplied ? 1e8f : 2.0f;
        for (int k = 0; k < 200; ++k) {
            const auto wild = [&] {
                return random.index(2) == 0 ? random.uniform(-3.0f, 3.0f)
                                            : kExtremes[random.index(std::size(kExtremes))];
            };
            const Vec4 rgba = texture.lookup(Vec2(wild(), wild()),
                                             kInterpolations[random.index(3)],
                                             kExtensions[random.index(4)]);
            bool good = true;
            for (int c = 0; c < 4; ++c) {
                good = good && rgba[c] >= 0.0f && rgba[c] <= most;
            }
            bad += good ? 0 : 1;
            EXPECT_TRUE(good) << "case " << i + static_cast<std::uint64_t>(k);
        }
        ASSERT_LT(bad, 5u);
    }
    testing::say_stress(
        "textures: outside of their texels' range", tries, static_cast<double>(bad), 0.0);
}

}  // namespace
}  // namespace pharos
