// How many samples each pass takes: pure, fixed by numbers known before the render.
//
// Passes start at one sample, so that a picture is there early, and grow until a pass holds about
// kPathsPerPass camera samples: fewer barriers, yet a host sees progress and cancels soon.
#pragma once

#include <algorithm>
#include <cstdint>

#include "integrator/render_context.h"

namespace pharos {

inline constexpr std::uint64_t kPathsPerPass = 1u << 19;

// The pass after `done` samples of `total` on a window of `pixels`; samples is 0 at the end.
[[nodiscard]] inline PassSettings next_pass(std::uint32_t done,
                                            std::uint32_t total,
                                            std::uint64_t pixels) {
    const std::uint64_t fitting =
        std::max<std::uint64_t>(1, kPathsPerPass / std::max<std::uint64_t>(1, pixels));
    const auto samples = static_cast<std::uint32_t>(
        std::min<std::uint64_t>({fitting, std::max<std::uint32_t>(1, done), total - done}));
    return {done, samples};
}

}  // namespace pharos
