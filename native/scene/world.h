// The world's program made ready to be sampled: constant worlds are found, others become an
// importance map of the evaluated program (internal to scene/).
#pragma once

#include <memory>

#include "core/cancel.h"
#include "core/parallel.h"
#include "scene/scene.h"

namespace pharos {

// Sets scene.environment, constant_world and the needs that speak of the world. The scene's world,
// textures and shading context are complete; throws Cancelled. `kept`: the map of the same world,
// if there is one already.
void prepare_world(Scene& scene,
                   ThreadPool& pool,
                   const CancelFlag& cancel,
                   std::unique_ptr<EnvironmentLight> kept);

}  // namespace pharos
