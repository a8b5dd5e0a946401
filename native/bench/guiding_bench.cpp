// What guiding costs: the field per vertex, training per record, sampling and density per
// direction, on batches as the integrator makes them. One core; items per second are printed as
// time per item.
#include <cmath>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "core/parallel.h"
#include "guiding/guiding_field.h"

namespace {

using namespace pharos;

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

GuidingField trained_field(const GuidingConfig& config) {
    GuidingField field(config, unit_box());
    ThreadPool pool(1);
    for (int pass = 0; pass < 4; ++pass) {
        field.train(make_records(32768), pool);
    }
    return field;
}

void set_per_item(benchmark::State& state, std::size_t items) {
    state.counters["per_item"] = benchmark::Counter(
        static_cast<double>(items),
        benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void evaluate_field(benchmark::State& state) {
    const GuidingField field = trained_field(config_of(state));
    const Vertices vertices(1024);
    std::vector<VmfMixture> mixtures(1024);
    for (auto _ : state) {
        field.evaluate(vertices.query(), mixtures);
        benchmark::ClobberMemory();
    }
    set_per_item(state, mixtures.size());
}

void train_field(benchmark::State& state) {
    const std::vector<RadianceRecord> records = make_records(32768);
    GuidingField field(config_of(state), unit_box());
    ThreadPool pool(static_cast<unsigned>(state.range(3)));
    std::uint64_t trained = 0;
    for (auto _ : state) {
        trained = field.train(records, pool).trained_records;
    }
    set_per_item(state, trained);  // thinned records are not counted, their handling is
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
