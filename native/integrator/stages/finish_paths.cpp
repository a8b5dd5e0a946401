#include "integrator/stages.h"

namespace pharos {

std::uint64_t finish_paths(PathBatch& batch) {
    std::uint64_t dropped = 0;
    for (std::uint32_t path = 0; path < batch.paths; ++path) {
        if (is_finite(batch.radiance[path])) {
            batch.root_sample[batch.root[path]].radiance += batch.radiance[path];
        } else {
            ++dropped;
        }
    }
    return dropped;
}

}  // namespace pharos
