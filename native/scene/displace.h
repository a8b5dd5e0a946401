// True displacement: moves the vertices of meshes by what their materials' programs say (internal
// to scene/).
#pragma once

#include "core/cancel.h"
#include "scene/scene.h"

namespace pharos {

// Textures, materials and the shading context are ready. Meshes that stand with several sets of
// materials are copied for each. True when some mesh has changed: what refers to meshes is to be
// made again.
[[nodiscard]] bool displace_meshes(Scene& scene, const CancelFlag& cancel);

}  // namespace pharos
