// What a guide has learned in one render, kept for others: frozen, so that the samples of one
// picture can be taken on several machines and still be those of a single run; or learning on, so
// that the next frame of an animation does not start from nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "session/guide_controller.h"

namespace pharos {

[[nodiscard]] std::vector<std::byte> field_to_bytes(const GuideController& guide, GuidingMode mode);

// The controller has to be new. Throws StateError; it is then to be thrown away.
void freeze_field(std::span<const std::byte> bytes, GuidingMode mode, GuideController& guide);

// Where a guide of an earlier picture goes on, and what its next picture is like.
struct NextPicture {
    GuidingMode mode = GuidingMode::Off;
    Bounds3 scene_box;
    std::uint64_t pixels = 0;
};

// The guide that made these bytes, to learn on. Throws StateError, also where its field cannot tell
// the places of this scene apart.
[[nodiscard]] GuideController continue_field(std::span<const std::byte> bytes,
                                             const NextPicture& next);

}  // namespace pharos
