// How fast a live picture settles with and without the guide: the error of what a viewport would
// show, by seconds of all processors since the scene was handed over.
//
// Seconds are CPU time of the process divided by the threads: on a machine with nothing else to do
// these are wall seconds, and on a busy one other programs do not count.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene_description.h"
#include "session/live_session.h"

namespace pharos {

struct SettlingSettings {
    std::vector<std::uint32_t> seconds{1, 2, 4, 8};
    std::uint32_t turns = 2;        // guided and unguided take turns, so many each
    std::uint32_t reference = 256;  // samples of the reference
    FrameBudget budget;             // of the guide
    unsigned threads = 0;
};

struct Settling {
    std::vector<double> guided;  // error at each of the seconds
    std::vector<double> unguided;
    // Of the guided pictures, a camera sample.
    double guided_vertices = 0.0;
    double records = 0.0;
};

[[nodiscard]] Settling measure_settling(const SceneDescription& description,
                                        const SettlingSettings& settings);

}  // namespace pharos
