// What shading knows of the camera (internal to scene/).
#pragma once

#include "scene/scene.h"

namespace pharos {

// Fills scene.shading from the description's camera and film.
void prepare_view(Scene& scene);

// Whether a program's values follow the camera: with it an importance map has to be made anew.
[[nodiscard]] bool asks_view(const NodeProgram& program);

}  // namespace pharos
