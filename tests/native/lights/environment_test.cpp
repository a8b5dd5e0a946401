// The world as a light: densities, sampling, mapping, mean.

#include "lights/environment_light.h"
#include "lights_support.h"
#include "support/chi_square.h"

namespace pharos {

namespace {

using test::Random;

struct Map {
    std::vector<Rgb> texels;
    std::uint32_t width = 0;
    std::uint32_t height = 0;

    Rgb& at(std::uint32_t x, std::uint32_t y) { return texels[y * width + x]; }
};

Map flat_map(std::uint32_t width, std::uint32_t height, float value) {
    return {std::vector<Rgb>(std::size_t{width} * height, Rgb(value)), width, height};
}

// A dim sky with a bright sun and some structure.
Map peaky_map() {
    Map map = flat_map(64, 32, 0.1f);
    for (std::uint32_t y = 16; y < 32; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
            map.at(x, y) = Rgb(0.2f, 0.4f, 0.6f) * (1.0f + 0.5f * std::sin(static_cast<float>(x)));
        }
    }
    map.at(63, 25) = Rgb(2000.0f, 1800.0f, 1500.0f);
    map.at(5, 0) = Rgb(50.0f);
    map.at(40, 31) = Rgb(80.0f);
    return map;
}

EnvironmentLight make(const Map& map) {
    return EnvironmentLight(map.texels, map.width, map.height);
}

// Cells are texels split in two along u, so that none straddles a step of the density; each is
// integrated over its true solid angle.
test::ChiSquareResult chi_square(const Map& map, const test::ChiSquareOptions& options) {
    constexpr int kSteps = 8;
    const EnvironmentLight light = make(map);
    const int columns = 2 * static_cast<int>(map.width);
    const int rows = static_cast<int>(map.height);
    const auto cells = static_cast<std::size_t>(columns * rows);
    std::vector<double> observed(cells, 0.0);
    std::vector<double> expected(cells, 0.0);
    Random random(options.seed);
    for (int i = 0; i < options.samples; ++i) {
        const Vec2 uv = direction_to_equirectangular(light.sample(random.uniform2()).wi);
        const int x = static_cast<int>(uv.x * static_cast<float>(columns));
        const int y = static_cast<int>(uv.y * static_cast<float>(rows));
        ++observed[static_cast<std::size_t>(y * columns + x)];
    }
    for (int y = 0; y < rows * kSteps; ++y) {
        const double step = std::numbers::pi / (rows * kSteps);
        const double measure = 2.0 * std::sin((y + 0.5) * step) * std::sin(0.5 * step) * 2.0 *
                               std::numbers::pi / columns;
        for (int x = 0; x < columns; ++x) {
            const Vec3 wi = equirectangular_to_direction(
                Vec2((static_cast<float>(x) + 0.5f) / static_cast<float>(columns),
                     (static_cast<float>(y) + 0.5f) / static_cast<float>(rows * kSteps)));
            expected[static_cast<std::size_t>(y / kSteps * columns + x)] +=
                static_cast<double>(light.pdf(wi)) * measure * options.samples;
        }
    }
    test::ChiSquareResult result = test::compare_histograms(observed, expected, options);
    for (const double e : expected) {
        result.total_mass += e / options.samples;
    }
    return result;
}

TEST(Environment, ChiSquare) {
    test::ChiSquareOptions options;
    options.tests = 4;
    options.samples = 200000;
    for (const Map& map :
         {peaky_map(), flat_map(7, 5, 1.0f), flat_map(1, 1, 3.0f), flat_map(8, 4, 0.0f)}) {
        const test::ChiSquareResult result = chi_square(map, options);
        EXPECT_TRUE(result.passed) << map.width << ": " << result.message;
        EXPECT_NEAR(result.total_mass, 1.0, 1e-4);
    }
}

TEST(Environment, DensityOfASampleIsThatOfItsDirection) {
    const EnvironmentLight light = make(peaky_map());
    Random random(3);
    int different = 0;
    for (int i = 0; i < 100000; ++i) {
        const auto s = light.sample(random.uniform2());
        ASSERT_NEAR(glm::length(s.wi), 1.0f, 1e-5f);
        // Directions at a texel's edge may round into the neighbour.
        different += std::abs(light.pdf(s.wi) / s.pdf - 1.0f) > 1e-4f ? 1 : 0;
    }
    EXPECT_LT(different, 50);
}

// Integral of the bilinearly interpolated sun: nearly all of its energy lies where samples go.
TEST(Environment, InterpolatedSunIsSampledWithLowVariance) {
    const Map map = peaky_map();
    const EnvironmentLight light = make(map);
    const auto bilinear = [&map](const Vec3& wi) {
        const Vec2 uv = direction_to_equirectangular(wi);
        const float x = uv.x * 64.0f - 0.5f;
        const float y = uv.y * 32.0f - 0.5f;
        const int x0 = static_cast<int>(std::floor(x));
        const int y0 = static_cast<int>(std::floor(y));
        const auto texel = [&map](int i, int j) {
            const auto column = static_cast<std::size_t>((i + 64) % 64);
            return map.texels[static_cast<std::size_t>(std::clamp(j, 0, 31)) * 64 + column].x;
        };
        const float fx = x - static_cast<float>(x0);
        const float fy = y - static_cast<float>(y0);
        return lerp(lerp(texel(x0, y0), texel(x0 + 1, y0), fx),
                    lerp(texel(x0, y0 + 1), texel(x0 + 1, y0 + 1), fx),
                    fy);
    };
    Random random(4);
    double sum = 0.0;
    double sum2 = 0.0;
    constexpr int kSamples = 200000;
    for (int i = 0; i < kSamples; ++i) {
        const auto s = light.sample(random.uniform2());
        const auto v = static_cast<double>(bilinear(s.wi) / s.pdf);
        sum += v;
        sum2 += v * v;
    }
    const double mean = sum / kSamples;
    EXPECT_LT(sum2 / kSamples / mean / mean - 1.0, 2.0);
}

TEST(Environment, Mapping) {
    EXPECT_NEAR(direction_to_equirectangular(Vec3(1, 0, 0)).x, 0.5f, 1e-6f);
    EXPECT_NEAR(direction_to_equirectangular(Vec3(0, -1, 0)).x, 0.75f, 1e-6f);
    EXPECT_NEAR(direction_to_equirectangular(Vec3(0, 1, 0)).x, 0.25f, 1e-6f);
    EXPECT_NEAR(direction_to_equirectangular(Vec3(0, 0, 1)).y, 1.0f, 1e-6f);
    EXPECT_NEAR(direction_to_equirectangular(Vec3(0, 0, -1)).y, 0.0f, 1e-6f);
    Random random(8);
    for (int i = 0; i < 10000; ++i) {
        const Vec3 d = random.direction();
        const Vec3 back = equirectangular_to_direction(direction_to_equirectangular(d));
        ASSERT_LT(glm::length(back - d), 2e-6f);
    }
}

TEST(Environment, MeanRadiance) {
    EXPECT_NEAR(make(flat_map(16, 8, 2.5f)).mean_radiance().y, 2.5f, 1e-5f);
    EXPECT_EQ(make(flat_map(1, 1, 2.5f)).mean_radiance().y, 2.5f);
    // One texel of the equator of 4 x 2: an eighth of the sphere.
    Map map = flat_map(4, 2, 0.0f);
    map.at(1, 1) = Rgb(8.0f);
    EXPECT_NEAR(make(map).mean_radiance().x, 1.0f, 1e-5f);
}

// A white plane under a world of radiance 1 reflects 1.
TEST(Environment, WhiteWorldThroughTheSampler) {
    const EnvironmentLight light = make(flat_map(32, 16, 1.0f));
    const LightSampler sampler =
        test::make_sampler(std::span<const LightDescription>(), 405, &light);
    ASSERT_FALSE(sampler.empty());
    const LightSampleContext context = test::plane_point();
    Random random(2);
    double sum = 0.0;
    constexpr int kSide = 400;
    for (int i = 0; i < kSide * kSide; ++i) {
        const int row = i / kSide;
        const Vec2 cell(static_cast<float>(i % kSide), static_cast<float>(row));
        const auto s = sampler.sample(context, 0.5f, (cell + random.uniform2()) / float{kSide});
        ASSERT_TRUE(s && s->environment);
        EXPECT_EQ(s->sample.distance, kInfinity);
        sum += static_cast<double>(std::max(s->sample.wi.z, 0.0f) / s->sample.pdf);
        if (i % 97 == 0) {
            EXPECT_NEAR(
                sampler.pdf_environment(context, s->sample.wi) / s->sample.pdf, 1.0f, 1e-3f);
        }
    }
    EXPECT_NEAR(sum / kSide / kSide / std::numbers::pi, 1.0, 2e-3);
}

// A world of one color leaves all samples to the lamps; its own light comes by scattering alone.
TEST(Environment, ConstantWorldIsNotSampled) {
    const EnvironmentLight light = make(flat_map(1, 1, 1.0f));
    const LightSampleContext context = test::plane_point();
    const LightSampler alone = test::make_sampler(std::span<const LightDescription>(), 405, &light);
    EXPECT_TRUE(alone.empty());
    EXPECT_EQ(alone.pdf_environment(context, Vec3(0.0f, 0.0f, 1.0f)), 0.0f);

    LightDescription lamp;
    lamp.type = LightType::Point;
    lamp.to_world[3] = Vec4(0.0f, 0.0f, 2.0f, 1.0f);
    lamp.strength = Rgb(1.0f);
    const LightSampler sampler = test::make_sampler(std::span(&lamp, 1), 405, &light);
    Random random(3);
    for (int i = 0; i < 1000; ++i) {
        const auto s = sampler.sample(context, random.uniform(), random.uniform2());
        ASSERT_TRUE(s && !s->environment);
    }
}

TEST(Environment, BadTexelsAreBlack) {
    Map map = flat_map(8, 4, 1.0f);
    map.at(2, 1) = Rgb(std::numeric_limits<float>::quiet_NaN());
    map.at(3, 1) = Rgb(kInfinity);
    map.at(4, 1) = Rgb(-2.0f);
    const EnvironmentLight light = make(map);
    EXPECT_TRUE(is_finite(light.mean_radiance()));
    Random random(6);
    for (int i = 0; i < 1000; ++i) {
        const auto s = light.sample(random.uniform2());
        ASSERT_TRUE(is_finite(s.wi) && s.pdf > 0.0f && std::isfinite(s.pdf));
    }
    EXPECT_THROW(EnvironmentLight(map.texels, 3, 4), std::invalid_argument);
}

TEST(Environment, BlackIsNoLight) {
    const EnvironmentLight light = make(flat_map(8, 4, 0.0f));
    const LightSampler sampler =
        test::make_sampler(std::span<const LightDescription>(), 405, &light);
    EXPECT_TRUE(sampler.empty());
    EXPECT_EQ(sampler.pdf_environment(test::plane_point(), Vec3(0, 0, 1)), 0.0f);
}

}  // namespace

}  // namespace pharos
