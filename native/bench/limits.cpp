#include "bench/limits.h"

#include <cstring>
#include <ctime>
#include <vector>

#include <immintrin.h>

namespace pharos::bench {

namespace {

constexpr int kChains = 12;  // more than latency x units of any core that has AVX2
constexpr int kSteps = 200000;

[[gnu::target("avx2,fma")]] void multiply_add_8() {
    __m256 sum[kChains];
    const __m256 factor = _mm256_set1_ps(0.999f);
    for (__m256& s : sum) {
        s = _mm256_set1_ps(1.0f);
    }
    for (int step = 0; step < kSteps; ++step) {
        for (__m256& s : sum) {
            s = _mm256_fmadd_ps(s, factor, factor);
        }
    }
    for (__m256& s : sum) {
        benchmark::DoNotOptimize(s);
    }
}

[[gnu::target("avx512f")]] void multiply_add_16() {
    __m512 sum[kChains];
    const __m512 factor = _mm512_set1_ps(0.999f);
    for (__m512& s : sum) {
        s = _mm512_set1_ps(1.0f);
    }
    for (int step = 0; step < kSteps; ++step) {
        for (__m512& s : sum) {
            s = _mm512_fmadd_ps(s, factor, factor);
        }
    }
    for (__m512& s : sum) {
        benchmark::DoNotOptimize(s);
    }
}

[[nodiscard]] double rate(double amount, double seconds) {
    return amount / seconds;
}

}  // namespace

double fma_peak() {
    static const double peak = [] {
        constexpr double kPerLane = 2.0 * kChains * kSteps;
        const double narrow = rate(8.0 * kPerLane, least_seconds(multiply_add_8));
        if (!__builtin_cpu_supports("avx512f")) {
            return narrow;
        }
        return std::max(narrow, rate(16.0 * kPerLane, least_seconds(multiply_add_16)));
    }();
    return peak;
}

double copy_peak() {
    static const double peak = [] {
        constexpr std::size_t kBytes = std::size_t{5} << 20;  // and as many again: a small film
        std::vector<unsigned char> from(kBytes, 1);
        std::vector<unsigned char> to(kBytes, 2);
        const double seconds = least_seconds([&] {
            std::memcpy(to.data(), from.data(), kBytes);
            benchmark::DoNotOptimize(to.data());
            benchmark::ClobberMemory();
        });
        return rate(2.0 * kBytes, seconds);
    }();
    return peak;
}

void set_per_item(benchmark::State& state, std::size_t items) {
    state.counters["per_item"] = benchmark::Counter(
        static_cast<double>(items),
        benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

double thread_seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void LoopTime::set_share(benchmark::State& state, const Limit& limit) const {
    const double elapsed = thread_seconds() - begin_;  // before a peak is measured
    state.counters[limit.name] =
        static_cast<double>(state.iterations()) * limit.amount / limit.peak() / elapsed;
}

void LoopTime::set_of_peak(benchmark::State& state, double flops) const {
    set_share(state, {"of_peak", flops, fma_peak});
}

void LoopTime::set_of_copy(benchmark::State& state, double bytes) const {
    set_share(state, {"of_copy", bytes, copy_peak});
}

void LoopTime::set_of_bare(benchmark::State& state, double seconds) const {
    set_share(state, {"of_bare", seconds, [] { return 1.0; }});
}

namespace {

// The limits themselves, beside what is held against them.
void machine_limits(benchmark::State& state) {
    for (auto _ : state) {
        multiply_add_8();
    }
    state.counters["fma_flops"] = fma_peak();
    state.counters["copy_bytes"] = copy_peak();
}

BENCHMARK(machine_limits);

}  // namespace

}  // namespace pharos::bench
