// What the Light Path node is told: the kind of the ray that asks, and how often its path has
// scattered.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/visibility.h"
#include "geometry/surface_interaction.h"
#include "integrator/path_batch.h"
#include "lights/light.h"
#include "materials/bsdf.h"
#include "materials/material.h"
#include "scene/scene.h"

namespace pharos {

[[nodiscard]] constexpr std::uint8_t ray_kind_bit(LightPathOutput output) {
    return static_cast<std::uint8_t>(1u << static_cast<unsigned>(output));
}

// The kind of the ray that leaves a scattering which is not straight transparency. Sharp lobes
// count as glossy too.
[[nodiscard]] inline std::uint8_t ray_kind_after(std::uint8_t lobe) {
    using enum LightPathOutput;
    unsigned kind = ray_kind_bit(lobe & kLobeTransmission ? IsTransmissionRay : IsReflectionRay);
    if (lobe & kLobeDiffuse) {
        kind |= ray_kind_bit(IsDiffuseRay);
    } else {
        kind |= ray_kind_bit(IsGlossyRay);
        kind |= lobe & kLobeDelta ? ray_kind_bit(IsSingularRay) : 0u;
    }
    return static_cast<std::uint8_t>(kind);
}

[[nodiscard]] inline PathInfo path_info(const PathCounters& counters) {
    const auto small = [](std::uint16_t count) {
        return static_cast<std::uint8_t>(std::min<std::uint16_t>(count, 255));
    };
    return {counters.ray_kind,
            small(counters.bounce),
            small(counters.diffuse),
            small(counters.glossy),
            small(counters.transparent),
            small(counters.transmission),
            counters.straight_length};
}

// The world, light and shadow are asked for one bounce further on.
[[nodiscard]] inline PathInfo world_path_info(const PathCounters& counters) {
    PathInfo info = path_info(counters);
    info.depth = static_cast<std::uint8_t>(std::min(info.depth + 1, 255));
    return info;
}

[[nodiscard]] inline PathInfo light_path_info(const PathCounters& counters, bool shadow) {
    PathInfo info = world_path_info(counters);
    info.kind = shadow ? ray_kind_bit(LightPathOutput::IsShadowRay) : 0;
    return info;
}

// What a lamp's nodes are asked about, its position the world's; its material is the lamp's
// program.
[[nodiscard]] inline SurfaceInteraction lamp_interaction(const Scene& scene,
                                                         const LampPoint& point,
                                                         const Vec3& wi,
                                                         float distance,
                                                         std::uint32_t program) {
    constexpr float kFar = 1e18f;  // its square is still a number
    SurfaceInteraction hit;
    hit.p = distance < kFar ? point.p + scene.shading.origin : point.p;
    hit.ng = hit.ns = point.n;
    hit.wo = -wi;
    hit.t = std::min(distance, kFar);
    hit.u = point.u;
    hit.v = point.v;
    hit.instance = hit.triangle = kNone;
    hit.material = program;
    return hit;
}

// The scene's shading context, which knows the paths where some program asks for them:
// info(i) tells of hit or direction i.
template <class Info>
[[nodiscard]] ShadingContext shading_with_paths(const Scene& scene,
                                                std::size_t count,
                                                std::vector<PathInfo>& storage,
                                                const Info& info) {
    ShadingContext context = scene.shading;
    if (scene.needs.light_path) {
        storage.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            storage[i] = info(i);
        }
        context.paths = storage;
    }
    return context;
}

}  // namespace pharos
