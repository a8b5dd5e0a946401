// Whether an edit changed what is rendered: hosts tell of many that did not.
#pragma once

#include "scene/scene_description.h"

namespace pharos {

// A copy without the content of meshes and images that have a version.
[[nodiscard]] SceneDescription outline(const SceneDescription& description);

// All but camera, film and the number of samples. Meshes and images are equal by their versions;
// such a one without a version is like no other.
[[nodiscard]] bool same_content(const SceneDescription& a, const SceneDescription& b);

}  // namespace pharos
