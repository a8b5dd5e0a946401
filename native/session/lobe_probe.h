// What the guide of a picture under way believes at one point of it: for an overlay.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "session/guide_status.h"

namespace pharos {

struct Scene;
class GuideController;

struct GuideLobe {
    Vec3 direction{0.0f};
    float kappa = 0.0f;
    float weight = 0.0f;
};

struct LobeProbe {
    std::uint64_t question = 0;  // which one it answers; 0: none yet
    bool hit = false;            // the camera sees a surface there
    Vec3 position{0.0f};
    Vec3 normal{0.0f};  // on the camera's side
    float irradiance = 0.0f;
    float diffuse_share = 0.0f;  // of the guide in the sampling there
    float glossy_share = 0.0f;
    GuideState state = GuideState::Off;
    std::vector<GuideLobe> lobes;  // by weight, the largest first; empty: nothing learned yet
};

// At the first hit of the ray through `place`, fractions of the rendered window from its bottom
// left. The guide must be between two passes.
[[nodiscard]] LobeProbe probe_lobes(const Scene& scene,
                                    const GuideController& guide,
                                    const Vec2& place);

}  // namespace pharos
