// The light of a picture by what its paths met first: diffuse, glossy or transmitting lobes, direct
// or indirect, as Cycles divides it.
//
// A path's light is split by the shares that the lobes of its first vertex have of f at the
// direction taken there (for next-event estimation: at the light's). It is found from outside, as
// what the stages add to a path's radiance between two looks, so that they know nothing of it. All
// functions return at once where no such pass is wanted.
#pragma once

#include <cstdint>
#include <vector>

#include "integrator/path_batch.h"
#include "integrator/render_context.h"

namespace pharos {

class LightSplit {
  public:
    // Before the first stage after the camera rays.
    void begin(const RenderContext& context, const PathBatch& batch);

    // After emission, lamps and world were added; also what the camera sees of the lobes' colours.
    void take_hits(const RenderContext& context, PathBatch& batch);

    // Around the stage that traces shadow rays.
    void before_shadow_rays(const RenderContext& context, const PathBatch& batch);
    void after_shadow_rays(const RenderContext& context, PathBatch& batch);

    // After scattering.
    void take_directions(const RenderContext& context, const PathBatch& batch);

  private:
    struct Shares {
        Rgb diffuse{0.0f};
        Rgb glossy{0.0f};
        bool known = false;
    };

    [[nodiscard]] static Shares shares_at(const Bsdf& bsdf, const Vec3& wi);
    [[nodiscard]] Rgb take(std::uint32_t path, const PathBatch& batch);
    static void add(const RenderContext& context,
                    std::uint32_t root,
                    const Shares& shares,
                    const Rgb& light,
                    bool direct,
                    PathBatch& batch);

    std::vector<Rgb> seen_;              // radiance of each path at the last look
    std::vector<Shares> scattered_;      // of each root's first vertex, in the direction taken
    std::vector<Shares> towards_light_;  // in that of its shadow ray
};

}  // namespace pharos
