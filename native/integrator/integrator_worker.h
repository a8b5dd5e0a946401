// What one thread of the integrator owns, for the integrator's own sources.
#pragma once

#include <chrono>
#include <cstdint>

#include "integrator/integrator.h"
#include "integrator/light_split.h"
#include "integrator/path_batch.h"

namespace pharos {

// Large enough for full SIMD groups deep in the path, small enough for a core's L2.
inline constexpr std::uint32_t kBatchPaths = 1024;

struct Integrator::Worker {
    PathBatch batch{kBatchPaths};
    LightSplit split;
    BatchStatistics statistics;
    RecordBuffer records;
};

[[nodiscard]] inline std::uint64_t nanoseconds_now() {
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::steady_clock::now().time_since_epoch())
                                          .count());
}

// Runs a stage and books its items and time.
template <class Function>
void timed(BatchStatistics& statistics, Stage stage, const Function& function) {
    const std::uint64_t begin = nanoseconds_now();
    StageCounter& counter = statistics[stage];
    counter.items += function();
    counter.nanoseconds += nanoseconds_now() - begin;
}

}  // namespace pharos
