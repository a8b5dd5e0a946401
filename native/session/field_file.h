// What a guide has learned in one render, kept for others: frozen, so that the samples of one
// picture can be taken on several machines and still be those of a single run.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "session/guide_controller.h"

namespace pharos {

[[nodiscard]] std::vector<std::byte> field_to_bytes(const GuideController& guide, GuidingMode mode);

// The controller has to be new. Throws StateError; it is then to be thrown away.
void freeze_field(std::span<const std::byte> bytes, GuidingMode mode, GuideController& guide);

}  // namespace pharos
