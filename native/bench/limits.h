// What figures are held against: the machine's peak of multiply-adds and of memory, measured once,
// on one core; and the counters every benchmark prints: `per_item`, seconds of an item, and a share
// of the limit that binds it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <benchmark/benchmark.h>

namespace pharos::bench {

// Floating-point operations a second of fused multiply-adds in registers (two each), in the widest
// vectors that this machine has.
[[nodiscard]] double fma_peak();

// Bytes a second, read and written, of copying as much memory as a small film has.
[[nodiscard]] double copy_peak();

// Time of one of the items that each iteration handles.
void set_per_item(benchmark::State& state, std::size_t items);

// CPU time of the calling thread: other work on the machine does not count.
[[nodiscard]] double thread_seconds();

// Made just before a benchmark's loop; tells after it what share of the loop's time a limit
// explains.
class LoopTime {
  public:
    LoopTime() : begin_(thread_seconds()) {}

    // Share of the multiply-add peak; `flops` of an iteration, a multiply-add counts two.
    void set_of_peak(benchmark::State& state, double flops) const;

    // Share of the copying peak; bytes read and written in an iteration.
    void set_of_copy(benchmark::State& state, double bytes) const;

    // Share of a bare loop that does the least there is to do, and takes so long for an iteration.
    void set_of_bare(benchmark::State& state, double seconds) const;

  private:
    struct Limit {
        const char* name;
        double amount;     // of an iteration
        double (*peak)();  // amount a second
    };

    void set_share(benchmark::State& state, const Limit& limit) const;

    double begin_;
};

// The least time of some calls of `work`, in seconds.
template <class Work>
[[nodiscard]] double least_seconds(const Work& work, int calls = 7) {
    double least = std::numeric_limits<double>::infinity();
    for (int call = 0; call < calls; ++call) {
        const double begin = thread_seconds();
        work();
        least = std::min(least, thread_seconds() - begin);
    }
    return least;
}

}  // namespace pharos::bench
