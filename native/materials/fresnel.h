// Fresnel reflectances: exact dielectric, generalised Schlick with the dielectric's shape, F82
// tint.
//
// Contract: cosine in [0, 1] is between the direction and the microfacet normal on the incident
// side; eta = transmitted / incident index >= 1e-5. Results are in [0, 1] per channel when f0 and
// f90 are.
//   Dielectric           Walter et al. 2007, eq. 22
//   Generalised Schlick  f0 + (f90 - f0) s, s = (F - F0) / (1 - F0) of the dielectric
//   (cycles-parity 2.6) F82 tint             Kutz, Hasan, Edmondson 2021: Schlick minus b cos (1 -
//   cos)^6
#pragma once

#include "core/math.h"
#include "materials/bsdf.h"
#include "materials/thin_film.h"

namespace pharos {

// Reflectance at normal incidence.
[[nodiscard]] inline float f0_from_eta(float eta) {
    return sqr((eta - 1.0f) / (eta + 1.0f));
}

// Index >= 1 of a reflectance at normal incidence; f0 is kept below one.
[[nodiscard]] inline float eta_from_f0(float f0) {
    const float root = std::sqrt(std::clamp(f0, 0.0f, 0.99f));
    return (1.0f + root) / (1.0f - root);
}

// 1 beyond the critical angle. Negative cosines count as grazing.
[[nodiscard]] inline float fresnel_dielectric(float cosine, float eta) {
    const float c = std::max(cosine, 0.0f);
    const float g_squared = (eta - 1.0f) * (eta + 1.0f) + c * c;
    if (!(g_squared > 0.0f)) {
        return 1.0f;
    }
    const float g = std::sqrt(g_squared);
    const float a = (g - c) / (g + c);
    const float b = (c * (g + c) - 1.0f) / (c * (g - c) + 1.0f);
    return std::min(0.5f * a * a * (1.0f + b * b), 1.0f);
}

// Cosine behind the interface, or a negative number at total reflection.
[[nodiscard]] inline float refracted_cosine(float cosine, float eta) {
    const float squared = 1.0f - (1.0f - cosine * cosine) / (eta * eta);
    return squared > 0.0f ? std::sqrt(squared) : -1.0f;
}

// The dielectric's reflectance remapped to run from 0 at normal incidence to 1.
[[nodiscard]] inline float dielectric_shape(float reflectance, float eta) {
    const float f0 = std::min(f0_from_eta(eta), 0.9999f);
    return saturate((reflectance - f0) / (1.0f - f0));
}

[[nodiscard]] inline Rgb fresnel_f82(float cosine, const Rgb& f0, const Rgb& b) {
    const float m = saturate(1.0f - cosine);
    const float m5 = sqr(sqr(m)) * m;
    return glm::clamp(lerp(f0, Rgb(1.0f), m5) - b * (cosine * m5 * m), 0.0f, 1.0f);
}

// b of the F82 model from the tint at 82 degrees (cos = 1/7).
[[nodiscard]] inline Rgb f82_b_from_tint(const Rgb& f0, const Rgb& tint) {
    constexpr float kSixSevenths = 6.0f / 7.0f;
    constexpr float kPower5 =
        kSixSevenths * kSixSevenths * kSixSevenths * kSixSevenths * kSixSevenths;
    const Rgb schlick = lerp(f0, Rgb(1.0f), kPower5);
    return schlick * (7.0f / (kPower5 * kSixSevenths)) * (Rgb(1.0f) - tint);
}

// Shares reflected and transmitted at a microfacet, tints included.
struct FresnelSplit {
    Rgb reflected{0.0f};
    Rgb transmitted{0.0f};
};

// A dielectric under a film. A colour f0 other than the dielectric's own scales what is reflected,
// the less the nearer that is to everything (as Cycles).
[[nodiscard]] inline Rgb closure_film_reflectance(const Closure& c, float cosine) {
    Rgb f = film_reflectance({c.f90.x, c.eta, c.f90.y}, saturate(cosine));
    const float f0 = f0_from_eta(c.eta);
    for (int i = 0; i < 3 && f0 > 1e-5f; ++i) {
        f[i] *= lerp(1.0f, c.f0[i] / f0, saturate((1.0f - f[i]) / (1.0f - f0)));
    }
    return f;
}

// Reflectance of a reflecting closure.
[[nodiscard]] inline Rgb closure_reflectance(const Closure& c, float cosine) {
    switch (c.fresnel) {
        case FresnelType::None:
            return Rgb(1.0f);
        case FresnelType::Dielectric:
            return Rgb(fresnel_dielectric(cosine, c.eta));
        case FresnelType::F82Tint:
            return fresnel_f82(cosine, c.f0, c.f90);
        case FresnelType::GeneralizedSchlick:
        case FresnelType::PrincipledV1:
            return lerp(c.f0, c.f90, dielectric_shape(fresnel_dielectric(cosine, c.eta), c.eta));
        case FresnelType::ThinFilm:
            return closure_film_reflectance(c, cosine);
    }
    return Rgb(1.0f);
}

// Both shares of a glass closure. PrincipledV1 tints the dielectric's reflection by its remapped
// Schlick colour; FresnelType::None means a pure refraction (nothing reflected).
[[nodiscard]] inline FresnelSplit closure_fresnel_split(const Closure& c, float cosine) {
    const float f = fresnel_dielectric(cosine, c.eta);
    const bool total = f >= 1.0f;
    switch (c.fresnel) {
        case FresnelType::None:
            return {Rgb(0.0f), total ? Rgb(0.0f) : c.transmission_tint};
        case FresnelType::GeneralizedSchlick: {
            const Rgb r = lerp(c.f0, c.f90, dielectric_shape(f, c.eta));
            return {r, total ? Rgb(0.0f) : (Rgb(1.0f) - r) * c.transmission_tint};
        }
        case FresnelType::ThinFilm: {
            const Rgb r = closure_film_reflectance(c, cosine);
            return {r, total ? Rgb(0.0f) : (Rgb(1.0f) - r) * c.transmission_tint};
        }
        case FresnelType::PrincipledV1:
            return {f * lerp(c.f0, c.f90, dielectric_shape(f, c.eta)),
                    (1.0f - f) * c.transmission_tint};
        default:
            return {Rgb(f), (1.0f - f) * c.transmission_tint};
    }
}

// Hemispherical (cosine-weighted) average of the dielectric reflectance: d'Eon's fits (2021).
[[nodiscard]] inline float dielectric_average_reflectance(float eta) {
    if (eta >= 1.0f) {
        return (eta - 1.0f) / (4.08567f + 1.00071f * eta);
    }
    return saturate(0.997118f + eta * (0.1014f + eta * (-0.965241f - 0.130607f * eta)));
}

}  // namespace pharos
