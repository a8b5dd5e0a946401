#include "integrator/stages.h"

namespace pharos {

std::uint64_t intersect_closest(const RenderContext& context, PathBatch& batch) {
    const std::size_t count = batch.rays.size();
    // Camera rays of neighbouring pixels travel together.
    const bool camera = batch.counters[batch.active.front()].depth == 0;
    context.scene.accelerator->intersect(batch.rays,
                                         batch.visibility,
                                         std::span(batch.hits).first(count),
                                         camera ? RayOrder::Coherent : RayOrder::Incoherent);
    return count;
}

}  // namespace pharos
