// How fast a guide follows a lamp that moves: the error of every frame afterwards, of the guide
// that was kept, of one that starts from nothing, and without a guide.
//
// A frame is one sample a pixel; its error is relMSE (mean of (I-R)^2 / (R^2 + 0.01)) without the
// worst thousandth of the pixels, against a reference made here.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/scene_description.h"

namespace pharos {

struct AdaptationSettings {
    std::string lamp;  // its name; empty: the first
    Vec3 offset{0.0f};
    std::uint32_t frames = 24;
    std::uint32_t learned = 64;     // frames before the lamp moves
    std::uint32_t reference = 256;  // samples of the reference
    std::uint32_t seeds = 3;        // errors are means over so many
    unsigned threads = 0;
};

struct Adaptation {
    std::vector<double> kept;  // by frame after the move
    std::vector<double> fresh;
    std::vector<double> unguided;
    // A frame of another picture, as old as the last of these, by a guide that has learned all
    // along where the lamp is now.
    double settled = 0.0;

    // The first frame from which two in a row are within `factor` of the settled error; the number
    // of frames where there is none.
    [[nodiscard]] std::size_t frames_until(const std::vector<double>& errors, double factor) const;
};

// The lamp of this name, the first for none. Throws std::invalid_argument without such a lamp.
[[nodiscard]] LightDescription& find_lamp(SceneDescription& description, const std::string& name);

// Throws as find_lamp().
[[nodiscard]] Adaptation measure_adaptation(const SceneDescription& description,
                                            const AdaptationSettings& settings);

}  // namespace pharos
