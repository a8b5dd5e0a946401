// What the guide did and whether it pays: for the statistics line and the panels.
#pragma once

#include <cstdint>

namespace pharos {

struct GuideStatus {
    bool enabled = false;       // guiding was asked for
    bool closed = false;        // it does not pay here: nothing is guided or recorded
    double guided_share = 0.0;  // of the vertices judged last
    double moment_ratio = 1.0;  // second moment with the guide over that without
    float loss = 0.0f;
    std::uint64_t snapshots = 0;
    std::uint64_t records = 0;
    std::uint64_t skipped_steps = 0;
};

}  // namespace pharos
