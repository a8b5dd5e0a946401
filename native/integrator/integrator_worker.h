// What one thread of the integrator owns, for the integrator's own sources.
#pragma once

#include <cstdint>

#include "core/work_counter.h"
#include "integrator/effort.h"
#include "integrator/integrator.h"
#include "integrator/light_split.h"
#include "integrator/path_batch.h"

namespace pharos {

// Large enough for full SIMD groups deep in the path, small enough for a core's L2.
inline constexpr std::uint32_t kBatchPaths = 1024;

struct Integrator::Worker {
    PathBatch batch{kBatchPaths};
    LightSplit split;
    EffortMeter effort;
    BatchStatistics statistics;
    RecordBuffer records;

    // Runs a stage and books its items and time; what it spent inside other stages is theirs.
    template <class Function>
    void timed(Stage stage, const Function& function) {
        count_work(statistics[stage], function);
        const WorkCounter textures = batch.scratch.textures.take();
        const WorkCounter transmission = batch.transmission.take();
        statistics[Stage::EvaluateTextures].add(textures);
        statistics[Stage::TransmitShadowRays].add(transmission);
        statistics[stage].nanoseconds -= textures.nanoseconds + transmission.nanoseconds;
    }
};

}  // namespace pharos
