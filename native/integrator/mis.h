// Weights between next-event estimation and chance hits, in one place for every stage.
#pragma once

#include "integrator/path_batch.h"
#include "integrator/render_context.h"
#include "sampling/mis.h"

namespace pharos {

// Weight of emission met by scattering with `scatter_pdf` that next-event estimation would have
// sampled with `light_pdf` (both per solid angle). Camera rays and delta scattering have no rival.
[[nodiscard]] inline float chance_hit_weight(const RenderContext& context,
                                             float scatter_pdf,
                                             float light_pdf) {
    if (scatter_pdf == 0.0f || !context.settings().use_nee) {
        return 1.0f;
    }
    return power_heuristic(scatter_pdf, light_pdf);
}

// The vertex a chance hit is weighed at, or null where next-event estimation had no part.
[[nodiscard]] inline const LightSampleContext* rival_context(const PathBatch& batch,
                                                             std::uint32_t path) {
    return batch.scatter_pdf[path] > 0.0f ? &batch.origin[path] : nullptr;
}

}  // namespace pharos
