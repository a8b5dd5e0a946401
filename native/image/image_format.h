// What kind of image file a run of bytes is (internal to image/).
#pragma once

#include <cstdint>
#include <span>

namespace pharos::detail {

// Bytes of a file's beginning that identify_image() needs.
inline constexpr std::size_t kImageHeaderBytes = 64;

// The reader's name of an allowed format ("png", "openexr" ...), or null.
[[nodiscard]] const char* identify_image(std::span<const std::uint8_t> header);

}  // namespace pharos::detail
