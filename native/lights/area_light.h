// Sampling of rectangular and elliptic area lamps from a point.
//
// Rectangles: uniformly over the solid angle (Urena, Fajardo, King 2013, "An Area-Preserving
// Parametrization for Spherical Rectangles"), its excess as a sum of arc sines; small, far or
// grazing ones uniformly over the area, which is as good there, faster, and exact in float32.
// Ellipses: uniformly over the area. With spread only the part is sampled from which light can
// arrive.
#pragma once

#include <optional>

#include "lights/lamp.h"

namespace pharos {

[[nodiscard]] std::optional<LampSample> sample_area_light(const Lamp& lamp,
                                                          const Vec3& p,
                                                          const Vec2& u);

// Density per solid angle at p of sampling `q` (a point of the lamp).
[[nodiscard]] float area_light_pdf(const Lamp& lamp, const Vec3& p, const Vec3& q);

[[nodiscard]] std::optional<LampHit> hit_area_light(const Lamp& lamp,
                                                    const Ray& ray,
                                                    const LightSampleContext* context);

// Spread factor for light that leaves along -wi.
[[nodiscard]] float spread_factor(const Lamp& lamp, const Vec3& wi);

}  // namespace pharos
