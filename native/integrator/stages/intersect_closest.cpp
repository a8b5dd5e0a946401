#include "integrator/stages.h"

namespace pharos {

std::uint64_t intersect_closest(const RenderContext& context, PathBatch& batch) {
    const std::size_t count = batch.rays.size();
    context.scene.accelerator->intersect(
        batch.rays, batch.visibility, std::span(batch.hits).first(count));
    return count;
}

}  // namespace pharos
