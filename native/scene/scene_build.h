// Builds a scene, with what an earlier one has left where there is any (internal to scene/).
#pragma once

#include <memory>

#include "scene/scene.h"

namespace pharos {

class ScenePieces;

// As build_scene() of scene.h; `pieces`: every mesh is instanced and kept there, null: none is.
[[nodiscard]] std::unique_ptr<Scene> build_scene(SceneDescription description,
                                                 const CancelFlag& cancel,
                                                 SceneReport& report,
                                                 ScenePieces* pieces);

}  // namespace pharos
