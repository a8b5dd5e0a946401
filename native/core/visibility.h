// Which rays see a thing (Cycles' ray visibility).
#pragma once

#include <cstdint>

namespace pharos {

inline constexpr std::uint32_t kNone = 0xffffffffu;  // an index that refers to nothing

enum VisibilityBits : std::uint32_t {
    kVisibleCamera = 1,
    kVisibleDiffuse = 2,
    kVisibleGlossy = 4,
    kVisibleTransmission = 8,
    kVisibleShadow = 16,
    kVisibleAll = 31,
    kVisibleByLobe = kVisibleDiffuse | kVisibleGlossy | kVisibleTransmission,
};

}  // namespace pharos
