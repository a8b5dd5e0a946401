// Portals: openings through which the world's light is looked for. They emit nothing and stop
// nothing; where some of them face a point, half of its samples of the world go through them,
// uniformly over an opening's solid angle, and the rest by the world's own density (a world of one
// colour has none worth keeping: all go through the openings). The density is that of both ways
// together, so that light from elsewhere, met by chance, keeps its place.
#pragma once

#include <vector>

#include "lights/environment_light.h"
#include "lights/lamp.h"

namespace pharos {

class Portals {
  public:
    // Adds the opening of an area lamp's description; one without an area opens nothing.
    void add(const LightDescription& description);

    [[nodiscard]] bool empty() const { return openings_.empty(); }

    [[nodiscard]] EnvironmentLight::Sample sample(const EnvironmentLight& world,
                                                  const LightSampleContext& context,
                                                  const Vec2& u) const;

    [[nodiscard]] float pdf(const EnvironmentLight& world,
                            const LightSampleContext& context,
                            const Vec3& wi) const;

  private:
    [[nodiscard]] std::size_t facing(const Vec3& p) const;
    [[nodiscard]] const Lamp& nth_facing(const Vec3& p, std::size_t n) const;

    std::vector<Lamp> openings_;
};

}  // namespace pharos
