// What shading costs: closures sampled and evaluated, lights chosen and sampled, node programs run
// over batches of hits, images looked up. None has a limit but the clock's, so that only the time
// of an item is told.
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/limits.h"
#include "lights/light_sampler.h"
#include "materials/material.h"
#include "sampling/sampler.h"
#include "support/description_builders.h"

namespace pharos {
namespace {

constexpr std::uint32_t kCount = 1024;

Vec4 random_at(std::uint32_t i) {
    return sobol_4d(pixel_hash(7, 0, 0), i, 0);
}

// Hits on a floor, seen from above.
std::vector<SurfaceInteraction> make_hits() {
    std::vector<SurfaceInteraction> hits(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        const Vec4 u = random_at(i);
        hits[i].p = Vec3(4.0f * u.x - 2.0f, 4.0f * u.y - 2.0f, 0.0f);
        hits[i].ng = hits[i].ns = Vec3(0.0f, 0.0f, 1.0f);
        hits[i].wo = glm::normalize(Vec3(u.z - 0.5f, u.w - 0.5f, 0.7f));
        hits[i].t = 1.0f;
    }
    return hits;
}

std::vector<std::uint32_t> all_indices() {
    std::vector<std::uint32_t> index(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        index[i] = i;
    }
    return index;
}

Texture checker_texture() {
    constexpr std::uint32_t kSize = 512;
    TexturePixels pixels{kSize, kSize, 3, TexelType::U8, {}};
    pixels.data.resize(std::size_t{kSize} * kSize * 3);
    for (std::size_t i = 0; i < pixels.data.size(); ++i) {
        pixels.data[i] = static_cast<std::uint8_t>(hash_combine(1, static_cast<std::uint32_t>(i)));
    }
    return {std::move(pixels), ImageColorSpace::Srgb, ImageAlpha::None};
}

// One material over all hits, with its closures at the end.
struct Shading {
    std::vector<SurfaceInteraction> hits = make_hits();
    std::vector<std::uint32_t> index = all_indices();
    std::vector<Texture> textures;
    Material material;
    ShadingContext context;
    ShadingScratch scratch;
    ClosureBatch closures;

    explicit Shading(const NodeProgram& program) {
        SceneReport report;
        textures.push_back(checker_texture());
        context.textures = textures;
        material = compile_material("bench", program, report, textures);
        evaluate();
    }

    void evaluate() {
        closures.reset(kCount);
        evaluate_surfaces(material, context, hits, index, scratch, closures);
    }

    [[nodiscard]] Bsdf bsdf(std::uint32_t i) const {
        const std::span<const Closure> mine(closures.closures.data() + closures.first[i],
                                            closures.count[i]);
        float total = 0.0f;
        for (const Closure& closure : mine) {
            total += closure.sample_weight;
        }
        return {mine, hits[i].wo, hits[i].ng, total};
    }
};

NodeProgram textured_program(bool noise) {
    testing::ProgramBuilder b;
    const auto position = static_cast<std::uint16_t>(GeometryOutput::Position);
    const std::int32_t p = b.value(NodeOpCode::Geometry, position, 3, {});
    std::int32_t color = 0;
    if (noise) {
        constexpr std::uint16_t kThreeDimensions = 2;
        color = b.value(NodeOpCode::Noise,
                        kThreeDimensions | kNormalizeNoiseBit | kColorNoiseBit,
                        3,
                        {p,
                         b.scalar(0.0f),
                         b.scalar(5.0f),
                         b.scalar(2.0f),
                         b.scalar(0.5f),
                         b.scalar(2.0f),
                         b.scalar(0.0f),
                         b.scalar(1.0f),
                         b.scalar(0.0f)});
    } else {
        ImageUse use;
        use.image = 0;
        color = b.value(NodeOpCode::Image, b.image(use), 4, {p});
    }
    b.closure(NodeOpCode::Diffuse, 0, {b.color(Vec3(1)), color, b.scalar(0.0f), kDefaultOperand});
    return b.build();
}

NodeProgram program_of(int kind) {
    switch (kind) {
        case 0:
            return testing::diffuse_program(Rgb(0.8f));
        case 1:
            return testing::glossy_program(Rgb(0.8f), 0.3f);
        case 2:
            return testing::glass_program(Rgb(0.9f), 0.3f, 1.45f);
        case 3:
            return textured_program(false);
        default:
            return textured_program(true);
    }
}

void evaluate_nodes(benchmark::State& state, int kind) {
    Shading shading(program_of(kind));
    for (auto _ : state) {
        shading.evaluate();
        benchmark::DoNotOptimize(shading.closures.closures.data());
    }
    bench::set_per_item(state, kCount);
}

void sample_closures(benchmark::State& state, int kind) {
    const Shading shading(program_of(kind));
    for (auto _ : state) {
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const Vec4 u(shading.hits[i].p * 0.25f + 0.5f, 0.37f);
            benchmark::DoNotOptimize(sample_bsdf(shading.bsdf(i), u.w, Vec2(u.x, u.y)));
        }
    }
    bench::set_per_item(state, kCount);
}

void evaluate_closures(benchmark::State& state, int kind) {
    const Shading shading(program_of(kind));
    for (auto _ : state) {
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const Vec3 wi = shading.hits[(i + 17) % kCount].wo;
            benchmark::DoNotOptimize(eval_bsdf(shading.bsdf(i), wi));
        }
    }
    bench::set_per_item(state, kCount);
}

void look_up_texels(benchmark::State& state, ImageInterpolation interpolation) {
    const Texture texture = checker_texture();
    std::vector<float> u(kCount);
    std::vector<float> v(kCount);
    std::vector<float> rgba(4 * kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        u[i] = random_at(i).x;
        v[i] = random_at(i).y;
    }
    for (auto _ : state) {
        texture.lookup(u, v, {interpolation, ImageExtension::Repeat, false}, rgba);
        benchmark::DoNotOptimize(rgba.data());
    }
    bench::set_per_item(state, kCount);
}

// Area lamps under a ceiling, on a grid of about `count`.
std::vector<LightDescription> make_lamps(int count) {
    const int side = std::max(1, static_cast<int>(std::sqrt(static_cast<float>(count))));
    std::vector<LightDescription> lamps;
    for (int i = 0; i < side * side; ++i) {
        LightDescription lamp;
        lamp.name = "lamp " + std::to_string(i);
        lamp.type = LightType::Area;
        lamp.size_u = lamp.size_v = 0.5f / static_cast<float>(side);
        lamp.strength = Rgb(100.0f);
        const float step = 4.0f / static_cast<float>(side);
        const int row = i / side;
        lamp.to_world[3] = Vec4((static_cast<float>(i % side) + 0.5f) * step - 2.0f,
                                (static_cast<float>(row) + 0.5f) * step - 2.0f,
                                2.0f,
                                1.0f);
        lamps.push_back(lamp);
    }
    return lamps;
}

void sample_lights(benchmark::State& state) {
    const std::vector<LightDescription> lamps = make_lamps(static_cast<int>(state.range(0)));
    LightSamplerInput input;
    input.lamps = lamps;
    const LightSampler sampler(input);
    const std::vector<SurfaceInteraction> hits = make_hits();
    for (auto _ : state) {
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const LightSampleContext receiver{hits[i].p, hits[i].ns, false};
            const Vec3 u = hits[(i + 17) % kCount].p * 0.25f + 0.5f;
            benchmark::DoNotOptimize(sampler.sample(receiver, u.x, Vec2(u.y, 0.37f)));
        }
    }
    bench::set_per_item(state, kCount);
}

BENCHMARK_CAPTURE(evaluate_nodes, diffuse, 0);
BENCHMARK_CAPTURE(evaluate_nodes, glossy, 1);
BENCHMARK_CAPTURE(evaluate_nodes, glass, 2);
BENCHMARK_CAPTURE(evaluate_nodes, image, 3);
BENCHMARK_CAPTURE(evaluate_nodes, noise, 4);
BENCHMARK_CAPTURE(sample_closures, diffuse, 0);
BENCHMARK_CAPTURE(sample_closures, glossy, 1);
BENCHMARK_CAPTURE(sample_closures, glass, 2);
BENCHMARK_CAPTURE(evaluate_closures, diffuse, 0);
BENCHMARK_CAPTURE(evaluate_closures, glossy, 1);
BENCHMARK_CAPTURE(evaluate_closures, glass, 2);
BENCHMARK_CAPTURE(look_up_texels, closest, ImageInterpolation::Closest);
BENCHMARK_CAPTURE(look_up_texels, linear, ImageInterpolation::Linear);
BENCHMARK_CAPTURE(look_up_texels, cubic, ImageInterpolation::Cubic);
BENCHMARK(sample_lights)->Arg(1)->Arg(16)->Arg(10000);

}  // namespace
}  // namespace pharos
