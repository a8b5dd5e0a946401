// The world's program made ready to be sampled: constant worlds are found, others become an
// importance map of the evaluated program (internal to scene/).
#pragma once

#include "core/cancel.h"
#include "core/parallel.h"
#include "scene/scene.h"

namespace pharos {

// Sets scene.environment, constant_world and the needs that speak of the world. The scene's world,
// textures and shading context are complete; throws Cancelled.
void prepare_world(Scene& scene, ThreadPool& pool, const CancelFlag& cancel);

}  // namespace pharos
