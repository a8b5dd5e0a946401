// Gathers all that emits into the light sampler (internal to scene/).
#pragma once

#include "core/cancel.h"
#include "scene/scene.h"

namespace pharos {

// After materials, instances and world. Throws Cancelled.
void prepare_lights(Scene& scene, const CancelFlag& cancel);

}  // namespace pharos
