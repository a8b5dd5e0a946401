// What guiding costs on this machine, by the processor's clock: measured on a field of its own.
#pragma once

#include "guiding/guiding_config.h"

namespace pharos {

struct GuideCosts {
    double vertex = 0.0;  // CPU seconds of asking the field at one vertex
    double record = 0.0;  // CPU seconds of training on one record
};

// Takes some tenths of a CPU second.
[[nodiscard]] GuideCosts measure_guide_costs(const GuidingConfig& config);

}  // namespace pharos
