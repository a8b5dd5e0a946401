// What guiding costs: the field per vertex, training per record, sampling and density per
// direction, on batches as the integrator makes them. `of_peak` counts the multiply-adds of the
// layers alone (three times those of a forward pass for training): encoding, activations, loss and
// optimiser are what is missing to 1.
#include <cmath>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/limits.h"
#include "core/parallel.h"
#include "guiding/encoding.h"
#include "guiding/guiding_field.h"
#include "guiding/network_layout.h"

namespace {

using namespace pharos;
using bench::set_per_item;

// A low-discrepancy sequence is enough for inputs: the golden ratio's fractional parts in d
// dimensions.
float fraction(std::size_t i, int dimension) {
    constexpr double kSteps[8] = {
        .8566749, .7338919, .6287067, .5385973, .4614027, .3952779, .3386257, .2900930};
    const double x = 0.5 + static_cast<double>(i + 1) * kSteps[dimension];
    return static_cast<float>(x - std::floor(x));
}

Vec3 sphere(float u, float v) {
    const float z = 1.0f - 2.0f * u;
    const float r = safe_sqrt(1.0f - z * z);
    const float phi = 2.0f * kPi * v;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

Bounds3 unit_box() {
    Bounds3 box;
    box.extend(Vec3(-1.0f));
    box.extend(Vec3(1.0f));
    return box;
}

// Light from a point above, seen from floor and walls; a third of the records is zero.
std::vector<RadianceRecord> make_records(std::size_t count) {
    std::vector<RadianceRecord> records(count);
    for (std::size_t i = 0; i < count; ++i) {
        RadianceRecord& r = records[i];
        r.position = Vec3(fraction(i, 0), fraction(i, 1), fraction(i, 2)) * 2.0f - 1.0f;
        r.normal = sphere(fraction(i, 3), fraction(i, 4));
        r.wi = sphere(fraction(i, 5), fraction(i, 6));
        const Vec3 to_light =
            normalize_or(Vec3(0.3f, 0.2f, 1.5f) - r.position, Vec3(0.0f, 0.0f, 1.0f));
        const float cosine = std::max(glm::dot(r.normal, r.wi), 0.0f);
        r.radiance_cos = cosine * (0.1f + 5.0f * vmf_pdf({to_light, 40.0f}, r.wi));
        r.pdf = 0.25f * kInvPi;
        r.key = i;
    }
    return records;
}

struct Vertices {
    std::vector<float> column[6];

    explicit Vertices(std::size_t count) {
        for (auto& c : column) {
            c.resize(count);
        }
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 n = sphere(fraction(i, 3), fraction(i, 4));
            for (int axis = 0; axis < 3; ++axis) {
                column[axis][i] = fraction(i, axis) * 2.0f - 1.0f;
                column[3 + axis][i] = n[axis];
            }
        }
    }

    [[nodiscard]] FieldQuery query() const {
        return {column[0], column[1], column[2], column[3], column[4], column[5]};
    }
};

GuidingConfig config_of(const benchmark::State& state) {
    GuidingConfig config;
    config.width = static_cast<int>(state.range(0));
    config.hidden_layers = static_cast<int>(state.range(1));
    config.lobes = static_cast<int>(state.range(2));
    return config;
}

// Of the layers, forwards, for one vertex.
double forward_flops(const GuidingConfig& config) {
    const NetworkLayout layout = make_network_layout(config);
    double flops = 0.0;
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        flops += 2.0 * shape.inputs * shape.outputs;
    }
    return flops;
}

GuidingField trained_field(const GuidingConfig& config) {
    GuidingField field(config, unit_box());
    ThreadPool pool(1);
    for (int pass = 0; pass < 4; ++pass) {
        field.train(make_records(32768), pool);
    }
    return field;
}

void evaluate_field(benchmark::State& state) {
    const GuidingField field = trained_field(config_of(state));
    const Vertices vertices(1024);
    std::vector<VmfMixture> mixtures(1024);
    const bench::LoopTime time;
    for (auto _ : state) {
        field.evaluate(vertices.query(), mixtures);
        benchmark::ClobberMemory();
    }
    set_per_item(state, mixtures.size());
    time.set_of_peak(state, static_cast<double>(mixtures.size()) * forward_flops(config_of(state)));
}

// The hash grid's; the frequencies are part of the network's kernel.
void encode_positions(benchmark::State& state) {
    GuidingConfig config;
    config.encoding = Encoding::HashGrid;
    const NetworkLayout layout = make_network_layout(config);
    const std::vector<float> table(layout.grid_parameters, 0.5f);
    std::vector<float> features(static_cast<std::size_t>(layout.position_inputs));
    const Vertices vertices(1024);
    for (auto _ : state) {
        for (std::size_t i = 0; i < 1024; ++i) {
            const Vec3 p(vertices.column[0][i], vertices.column[1][i], vertices.column[2][i]);
            encode_grid(config, table.data(), p, features.data(), 1);
            benchmark::DoNotOptimize(features.data());
        }
    }
    set_per_item(state, 1024);
}

void train_field(benchmark::State& state) {
    const std::vector<RadianceRecord> records = make_records(32768);
    GuidingField field(config_of(state), unit_box());
    ThreadPool pool(static_cast<unsigned>(state.range(3)));
    std::uint64_t trained = 0;
    const bench::LoopTime time;
    for (auto _ : state) {
        trained = field.train(records, pool).trained_records;
    }
    set_per_item(state, trained);  // thinned records are not counted, their handling is
    if (state.range(3) == 1) {
        time.set_of_peak(state,
                         3.0 * static_cast<double>(trained) * forward_flops(config_of(state)));
    }
}

void sample_directions(benchmark::State& state) {
    const GuidingField field = trained_field(GuidingConfig::neural());
    const Vertices vertices(1024);
    std::vector<VmfMixture> mixtures(1024);
    field.evaluate(vertices.query(), mixtures);
    for (auto _ : state) {
        for (std::size_t i = 0; i < mixtures.size(); ++i) {
            benchmark::DoNotOptimize(
                sample_mixture(mixtures[i], fraction(i, 0), Vec2(fraction(i, 1), fraction(i, 2))));
        }
    }
    set_per_item(state, mixtures.size());
}

void density_of_directions(benchmark::State& state) {
    const GuidingField field = trained_field(GuidingConfig::neural());
    const Vertices vertices(1024);
    std::vector<VmfMixture> mixtures(1024);
    field.evaluate(vertices.query(), mixtures);
    std::vector<Vec3> wi(1024);
    for (std::size_t i = 0; i < wi.size(); ++i) {
        wi[i] = sphere(fraction(i, 5), fraction(i, 6));
    }
    std::vector<float> pdf(1024);
    for (auto _ : state) {
        mixture_pdfs(mixtures, wi, pdf);
        benchmark::ClobberMemory();
    }
    set_per_item(state, mixtures.size());
}

void product_of_mixtures(benchmark::State& state) {
    const GuidingField field = trained_field(GuidingConfig::neural());
    const Vertices vertices(1024);
    std::vector<VmfMixture> mixtures(1024);
    field.evaluate(vertices.query(), mixtures);
    for (auto _ : state) {
        for (const VmfMixture& mixture : mixtures) {
            benchmark::DoNotOptimize(multiply_lobe(mixture, Vec3(0.0f, 0.6f, 0.8f), 200.0f));
        }
    }
    set_per_item(state, mixtures.size());
}

BENCHMARK(evaluate_field)
    ->Args({32, 2, 8})
    ->Args({32, 2, 4})
    ->Args({32, 2, 1})
    ->Args({64, 2, 8})
    ->Args({64, 6, 1});
BENCHMARK(encode_positions);
BENCHMARK(train_field)
    ->Args({32, 2, 8, 1})
    ->Args({32, 2, 8, 2})
    ->Args({32, 2, 4, 1})
    ->Args({64, 2, 8, 1});
BENCHMARK(sample_directions);
BENCHMARK(density_of_directions);
BENCHMARK(product_of_mixtures);

}  // namespace

BENCHMARK_MAIN();
