// What tells one render's scene from another's: for checkpoints and for shards of one picture.
#pragma once

#include <cstdint>

#include "scene/scene_description.h"

namespace pharos {

// Of everything that decides what a sample of a pixel is, images in their files included; not of
// the seed, the number of samples, the time limit and the guide, which their users look at
// themselves. The description is the same on return.
[[nodiscard]] std::uint64_t scene_hash(SceneDescription& description);

}  // namespace pharos
