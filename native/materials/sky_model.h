// Clear skies: Preetham, Shirley, Smits 1999 ("A Practical Analytic Model for Daylight") and single
// scattering in a spherical atmosphere (Nishita et al. 1993, with an ozone layer), summed over
// wavelengths and stored by direction.
//
// z is up. The sun stands at `elevation` above the horizon and `rotation` from +y towards +x. Solar
// light is that of a black body of 5778 K.
#pragma once

#include <vector>

#include "core/math.h"

namespace pharos {

enum class SkyType : std::uint32_t { Preetham, SingleScattering };

struct SkyParameters {
    SkyType type = SkyType::SingleScattering;
    Vec3 sun_direction{0.0f, 0.0f, 1.0f};  // Preetham
    float turbidity = 2.2f;
    float elevation = 0.26f;
    float rotation = 0.0f;
    float altitude = 0.0f;  // metres
    float air = 1.0f;       // densities, 1: earth's on a clear day
    float dust = 1.0f;
    float ozone = 1.0f;
    bool sun_disc = true;
    float sun_size = 0.0095f;  // its diameter, radians
    float sun_intensity = 1.0f;
};

class SkyModel {
  public:
    explicit SkyModel(const SkyParameters& parameters);

    // Radiance from a unit direction.
    [[nodiscard]] Rgb radiance(const Vec3& direction) const;

    [[nodiscard]] bool has_disc() const {
        return in_.type == SkyType::SingleScattering && in_.sun_disc;
    }

  private:
    void prepare_preetham();
    void prepare_scattering();
    [[nodiscard]] Rgb preetham(const Vec3& direction) const;
    [[nodiscard]] Rgb scattered(const Vec3& direction) const;

    SkyParameters in_;
    Vec3 sun_;
    float perez_[3][5] = {};  // luminance and chromaticity: distribution over the dome
    Vec3 zenith_{0.0f};       // divided by the distribution there
    std::vector<Rgb> dome_;   // by elevation (finer near the horizon) and angle from the sun
    Rgb disc_low_{0.0f};      // of the sun's lower and upper edge
    Rgb disc_high_{0.0f};
};

}  // namespace pharos
