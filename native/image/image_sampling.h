// How a texture is read between its texels and beyond its border (Blender's names and order).
#pragma once

#include <cstdint>

namespace pharos {

enum class ImageInterpolation : std::uint32_t { Linear, Closest, Cubic, Smart };
enum class ImageExtension : std::uint32_t { Repeat, Extend, Clip, Mirror };

}  // namespace pharos
