// What the film costs: adding samples in the order in which a batch owns its pixels, and reading
// the picture. `of_copy` counts the bytes that have to be read and written, against a plain copy.
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/limits.h"
#include "film/film.h"

namespace pharos {
namespace {

constexpr std::uint32_t kWidth = 256;
constexpr std::uint32_t kHeight = 256;
constexpr std::uint32_t kPixels = kWidth * kHeight;
// Sums of colour and alpha, of half the passes, of features, of weights; depth and count.
constexpr double kBytesOfPixel = 8.0 * (4 + 3 + 9 + 2) + 4.0 + 4.0;

FilmDescription description() {
    FilmDescription film;
    film.width = film.crop_width = kWidth;
    film.height = film.crop_height = kHeight;
    return film;
}

void add_samples(benchmark::State& state) {
    Film film(description());
    FilmSample sample;
    sample.radiance = Rgb(0.5f, 0.25f, 0.125f);
    sample.normal = sample.guide_normal = Vec3(0.0f, 0.0f, 1.0f);
    sample.depth = 2.0f;
    const bench::LoopTime time;
    for (auto _ : state) {
        for (std::uint32_t pixel = 0; pixel < kPixels; ++pixel) {
            film.add(pixel, sample, 1.0, true);
        }
        benchmark::ClobberMemory();
    }
    bench::set_per_item(state, kPixels);
    time.set_of_copy(state, 2.0 * kBytesOfPixel * kPixels);
}

void read_picture(benchmark::State& state) {
    Film film(description());
    for (std::uint32_t pixel = 0; pixel < kPixels; ++pixel) {
        film.add(pixel, FilmSample{}, 1.0, true);
    }
    std::vector<float> out(4 * std::size_t{kPixels});
    const bench::LoopTime time;
    for (auto _ : state) {
        film.read(FilmPass::Combined, out);
        benchmark::DoNotOptimize(out.data());
    }
    bench::set_per_item(state, kPixels);
    time.set_of_copy(state, (8.0 * 5 + 4.0 * 4) * kPixels);
}

BENCHMARK(add_samples);
BENCHMARK(read_picture);

}  // namespace
}  // namespace pharos
