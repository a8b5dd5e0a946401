// Russian roulette and splitting by a weight window around the expected contribution, with the
// field's A as the adjoint (Vorba and Krivanek 2016, "Adjoint-driven Russian roulette and
// splitting").
//
// r = lum(throughput * albedo) * A / pi / I_pixel is the expected contribution of going on relative
// to the pixel. Below the window a path survives with r / lower, above it is split. Either way
// weights stay unbiased: the continuations' weights sum to one in the mean (splitting: always).
#pragma once

#include <algorithm>
#include <cmath>

namespace pharos {

struct WeightWindow {
    float size = 5.0f;  // upper / lower
    float min_survival = 0.4f;
    int max_copies = 4;
};

struct RouletteDecision {
    int copies = 1;       // 0: the path ends; n: continuations
    float weight = 1.0f;  // factor on the throughput of each of them
};

// u in [0, 1) decides; r may be anything (non-finite: no decision, one copy of weight 1).
[[nodiscard]] inline RouletteDecision weight_window(const WeightWindow& window,
                                                    float r,
                                                    bool may_split,
                                                    float u) {
    const float lower = 2.0f / (1.0f + window.size);
    const float upper = window.size * lower;
    if (!(r >= 0.0f) || !std::isfinite(r)) {
        return {};
    }
    if (r < lower) {
        const float survival = std::max(window.min_survival, r / lower);
        return u < survival ? RouletteDecision{1, 1.0f / survival} : RouletteDecision{0, 0.0f};
    }
    if (r > upper && may_split) {
        const float expected = std::min(static_cast<float>(window.max_copies), r / upper);
        const int copies =
            std::clamp(static_cast<int>(std::floor(expected + u)), 1, window.max_copies);
        return {copies, 1.0f / static_cast<float>(copies)};
    }
    return {};
}

}  // namespace pharos
