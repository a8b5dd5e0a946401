// Film weights of the passes: where light is hard to find, passes taken while the guide knows
// little count for less.
//
// A weight that follows what a pixel has shown is biased: its bright samples would lower their own
// weight. The pixels are therefore a checkerboard of two colours, and the passes 0 and 1, which are
// never guided, of one colour decide for the other. Samples of different pixels are independent, so
// the weights are independent of everything they multiply, and the picture stays unbiased at any
// number of passes. (Sample splitting, as cross-fitting does in statistics.)
//
// Where light is easy to find all passes count alike: unequal weights would break the low
// discrepancy of a pixel's samples.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/state_archive.h"
#include "film/film.h"

namespace pharos {

// Two samples a pixel, as luminances: what the first two passes showed.
struct FirstPasses {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<float> first;
    std::vector<float> second;
};

// Variance of one sample relative to the square of what the neighbourhood shows, at least a tenth
// of the usual brightness (the mean, what is much brighter left out), as the mean over the pixels
// of each colour in whose neighbourhood there is light (a picture where light is so rare that most
// of it is black is a hard one), from these pixels alone. One pixel counts for at most 2000. 0 for
// a black picture.
[[nodiscard]] std::array<double, 2> relative_variance(const FirstPasses& passes);

class PassWeights {
  public:
    // Looks at the picture after `done` samples; only the first two matter.
    void see(const Film& film, std::uint32_t done);

    // Light is easy to find, as far as one sample a pixel can tell; known after the first.
    [[nodiscard]] bool quiet() const { return quiet_; }

    // Of the pass that starts with sample `first`, by the colour of the pixel: (x + y) % 2.
    [[nodiscard]] std::array<double, 2> of(std::uint32_t first) const;

    // Light is hard to find, by the pixels of both colours; known after two samples.
    [[nodiscard]] bool hard() const { return hard_[0] && hard_[1]; }

    template <class Archive>
    friend void state_fields(Archive& archive, PassWeights& weights) {
        FirstPasses& passes = weights.passes_;
        archive(passes.width, passes.height, passes.first, passes.second, weights.hard_);
        archive(weights.quiet_);
    }

    // What was loaded fits a picture of this size.
    [[nodiscard]] bool fits(std::uint64_t pixels) const;

  private:
    FirstPasses passes_;
    bool quiet_ = false;
    std::array<bool, 2> hard_{};  // by the pixels of this colour
};

}  // namespace pharos
