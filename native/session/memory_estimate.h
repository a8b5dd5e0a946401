// What a render will need, before any of it is asked for: a scene that cannot fit ends with a
// sentence instead of a machine that swaps.
#pragma once

#include <cstdint>

#include "scene/scene_description.h"

namespace pharos {

// Bytes beyond the description itself: acceleration structures, films, images (decoded ones by
// what their files hold at least). Lower than the truth rather than higher.
[[nodiscard]] std::uint64_t estimate_memory(const SceneDescription& description);

}  // namespace pharos
