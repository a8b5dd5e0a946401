// Scene descriptions in a file: versioned, checksummed, little-endian; images are embedded, so that
// a dump renders the same anywhere. Written as AtomicFile does.
//
// Errors: std::runtime_error with the path and what is wrong (truncated, foreign, damaged, newer);
// WriteError where it cannot be written.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/scene_description.h"

namespace pharos {

void write_dump(const SceneDescription& description, const std::string& path);
[[nodiscard]] SceneDescription read_dump(const std::string& path);

// The same format in memory.
[[nodiscard]] std::vector<std::uint8_t> dump_to_bytes(const SceneDescription& description);
[[nodiscard]] SceneDescription dump_from_bytes(std::span<const std::uint8_t> bytes);

}  // namespace pharos
