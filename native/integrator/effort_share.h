// A row of the list of what makes a picture slow (effort.h).
#pragma once

#include <cstdint>
#include <string>

namespace pharos {

enum class EffortKind : std::uint8_t { Object, Light, World };

struct EffortShare {
    EffortKind kind = EffortKind::Object;
    std::string name;
    double share = 0.0;  // of the effort of all objects, or of all that emits
};

}  // namespace pharos
