// What it is worth that a guide goes on from frame to frame: an animation in which a lamp moves,
// each frame rendered with what the one before has learned, and from nothing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/scene_description.h"

namespace pharos {

struct AnimationSettings {
    std::string lamp;  // its name; empty: the first
    Vec3 offset{0.0f};
    bool cut = false;  // all of the offset at once, in the middle; else a part in every frame
    std::uint32_t frames = 24;
    std::uint32_t reference = 256;  // samples of each frame's reference
    unsigned threads = 0;
};

// Errors as trimmed_error() of picture_error.h.
struct FrameFigures {
    double error = 0.0;
    double cpu_seconds = 0.0;  // of passes and training

    // A frame's cost at equal error: error falls as one over time.
    [[nodiscard]] double work() const { return error * cpu_seconds; }
};

struct AnimatedFrame {
    FrameFigures going_on;  // with what the frame before has learned
    FrameFigures anew;
    FrameFigures unguided;
};

// The description's samples and seed, in every frame. Throws std::invalid_argument without such a
// lamp, std::runtime_error where a frame cannot be rendered.
[[nodiscard]] std::vector<AnimatedFrame> measure_animation(const SceneDescription& description,
                                                           const AnimationSettings& settings);

}  // namespace pharos
