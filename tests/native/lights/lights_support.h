// What the tests of lights share: descriptions, a receiver on a plane, and its reflected radiance
// found by sampling and by brute force over chance hits.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lights/light_sampler.h"
#include "support/random.h"

namespace pharos::test {

// The receiver of all closed forms: a white plane at the origin, lights 2 m above, 100 W.
inline LightSampleContext plane_point() {
    return {Vec3(0.0f), Vec3(0, 0, 1), false};
}

inline LightDescription lamp_above(LightType type, float height = 2.0f) {
    LightDescription d;
    d.name = "lamp";
    d.type = type;
    d.to_world[3] = Vec4(0, 0, height, 1);
    d.strength = Rgb(type == LightType::Sun ? 1.0f : 100.0f);
    d.spot_angle = kPi / 4;
    d.soft_falloff = false;
    return d;
}

inline LightSampler make_sampler(std::span<const LightDescription> lamps,
                                 std::uint32_t version,
                                 const EnvironmentLight* environment = nullptr) {
    LightSamplerInput input;
    input.lamps = lamps;
    input.blender_version = version;
    input.environment = environment;
    return LightSampler(input);
}

inline LightSampler make_sampler(const LightDescription& lamp, std::uint32_t version) {
    return make_sampler(std::span(&lamp, 1), version);
}

// Radiance a white Lambertian plane reflects, by light sampling on a jittered n x n grid.
inline double sampled_radiance(const LightSampler& sampler,
                               const LightSampleContext& context,
                               int n) {
    Random random(17);
    double sum = 0.0;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const Vec2 jitter = random.uniform2();
            const Vec2 u((static_cast<float>(x) + jitter.x) / static_cast<float>(n),
                         (static_cast<float>(y) + jitter.y) / static_cast<float>(n));
            const auto s = sampler.sample(context, random.uniform(), glm::min(u, kOneMinusEpsilon));
            if (s) {
                const float cosine = std::max(glm::dot(s->sample.wi, context.n), 0.0f);
                sum += static_cast<double>(s->sample.L.x * cosine / s->sample.pdf);
            }
        }
    }
    return sum / n / n / std::numbers::pi;
}

// The same through rays: cosine-weighted directions and what they meet.
inline double hit_radiance(const LightSampler& sampler, const LightSampleContext& context, int n) {
    Random random(23);
    const Frame frame = Frame::from_z(context.n);
    double sum = 0.0;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const Vec2 jitter = random.uniform2();
            const float r2 = (static_cast<float>(x) + jitter.x) / static_cast<float>(n);
            const float phi =
                2.0f * kPi * (static_cast<float>(y) + jitter.y) / static_cast<float>(n);
            const float r = std::sqrt(r2);
            const Vec3 local(r * std::cos(phi), r * std::sin(phi), safe_sqrt(1.0f - r2));
            const Vec3 wi = frame.to_world(local);
            if (const auto hit = sampler.intersect_lamps({context.p, wi}, &context)) {
                sum += static_cast<double>(hit->L.x);
            }
            for (std::uint32_t sun = 0; sun < sampler.sun_count(); ++sun) {
                if (const auto hit = sampler.sun_hit(sun, wi, &context)) {
                    sum += static_cast<double>(hit->L.x);
                }
            }
        }
    }
    return sum / n / n;
}

// Emission along wi as next-event estimation and chance hits see it: nearest lamp or first sun.
inline std::optional<LightHit> hit_along(const LightSampler& sampler,
                                         const LightSampleContext& context,
                                         const Vec3& wi) {
    if (auto hit = sampler.intersect_lamps({context.p, wi}, &context)) {
        return hit;
    }
    return sampler.sun_count() > 0 ? sampler.sun_hit(0, wi, &context) : std::nullopt;
}

}  // namespace pharos::test
