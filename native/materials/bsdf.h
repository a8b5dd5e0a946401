// THE scattering contract: a hit's closures and the three functions over them.
//
// wo points to the camera, wi is sampled; both unit, both pointing away from the surface.
// eval_bsdf returns f * |cos(wi, n)| summed over all smooth closures and the pdf of wi per solid
// angle of sample_bsdf's whole choice (closure choice included; delta closures take their share of
// the probability but evaluate to zero). A delta sample returns weight and discrete probability
// instead. Closure choice: probability proportional to sample_weight. Radiance crossing an
// interface is NOT scaled by eta^2 (as Cycles). Transparent closures pass straight through and are
// delta.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/math.h"

namespace pharos {

enum class ClosureType : std::uint8_t {
    Diffuse,
    OrenNayar,
    DisneyDiffuse,  // Burley 2015 with retro-reflection (Principled v1)
    Translucent,
    Transparent,    // delta, straight on
    GgxReflection,  // includes conductors; singular when alpha_x * alpha_y <= 2e-10
    GgxRefraction,
    GgxGlass,   // reflection and refraction with one half vector
    Clearcoat,  // GTR1 (Principled v1)
    Sheen,
    ToonDiffuse,
    ToonGlossy,
    Velvet,
};

enum class FresnelType : std::uint8_t {
    None,                // 1
    Dielectric,          // exact, from eta
    GeneralizedSchlick,  // f0, f90 with the dielectric's shape remapped (cycles-parity 2.6)
    F82Tint,             // f0, b of the F82 model in f90
    PrincipledV1,        // f0 = cspec0, f90 = 1, shape from eta
    ThinFilm,            // f0; f90 = (index of the film, its thickness in nm, -)
};

// Closure::smith of microfacets. Of 4.x and GGX: none of these.
inline constexpr std::uint8_t kSeparableMasking = 1;  // 3.x; else height-correlated
inline constexpr std::uint8_t kBeckmannFacets = 2;
inline constexpr std::uint8_t kAshikhminShirleyFacets = 4;  // reflection only

// One lobe. Plain data; a batch holds them contiguously by path.
struct Closure {
    Rgb weight{0.0f};
    float sample_weight = 0.0f;  // probability before normalisation; >= 0
    Vec3 n;                      // the closure's own shading normal
    float alpha_x = 0.0f;
    Vec3 tangent;  // unit, for alpha_x != alpha_y; more: lobes/diffuse.h, sheen.h, toon.h
    float alpha_y = 0.0f;
    Rgb f0{0.0f};
    float eta = 1.0f;  // transmitted / incident index for wo's side
    Rgb f90{1.0f};
    float energy_scale = 1.0f;  // multi-scatter compensation for wo, 1 where off
    Rgb transmission_tint{1.0f};
    float parameter = 0.0f;  // Oren-Nayar sigma, Disney roughness, sheen roughness
    ClosureType type = ClosureType::Diffuse;
    FresnelType fresnel = FresnelType::None;
    std::uint8_t smith = 0;
};

inline constexpr int kMaxClosures = 12;  // per hit; the least important are dropped and counted

// Bits of the lobe a direction was sampled from.
enum LobeBits : std::uint8_t {
    kLobeDiffuse = 1,
    kLobeGlossy = 2,
    kLobeTransmission = 4,  // with Diffuse (translucent), Glossy (rough) or Delta
    kLobeDelta = 8,
    kLobeTransparent = 16,  // with Delta: not a bounce
};

struct Bsdf {
    std::span<const Closure> closures;
    Vec3 wo;
    Vec3 ng;                           // on wo's side
    float total_sample_weight = 0.0f;  // sum over closures
};

struct BsdfEval {
    Rgb f_cos{0.0f};
    float pdf = 0.0f;  // solid angle
};

struct BsdfSample {
    Rgb f_cos{0.0f};  // delta: f_cos / pdf is the throughput factor
    Vec3 wi;
    float pdf = 0.0f;  // solid angle; delta: discrete probability
    std::uint8_t lobe = 0;
    float eta = 1.0f;        // of a transmission, else 1
    float roughness = 1.0f;  // sqrt(alpha) of the sampled lobe, 1 for diffuse
};

// What sampling may rely on, found once per hit.
struct BsdfTraits {
    float delta_probability = 0.0f;         // share of the closure choice that is delta
    float transmission_probability = 0.0f;  // share of smooth lobes reaching the far hemisphere
    float min_alpha = 1.0f;                 // of the smooth reflecting lobes; 1 for diffuse alone
    Rgb albedo{0.0f};                       // estimate of the directional albedo, for roulette
};

[[nodiscard]] BsdfEval eval_bsdf(const Bsdf& bsdf, const Vec3& wi);
// Of those lobes alone whose rays may see a light of this visibility (core/visibility.h).
[[nodiscard]] BsdfEval eval_bsdf_seeing(const Bsdf& bsdf, const Vec3& wi, std::uint32_t visibility);
[[nodiscard]] std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf,
                                                    float u_closure,
                                                    const Vec2& u);
[[nodiscard]] BsdfTraits bsdf_traits(const Bsdf& bsdf);

// Whether sample_bsdf would choose a delta closure for this u_closure.
[[nodiscard]] bool chooses_delta(const Bsdf& bsdf, float u_closure);

// Bits for a direction that came from elsewhere (a guide): those of the smooth closure u_closure
// picks by sample weight, reflecting or transmitting as wi lies to ng.
[[nodiscard]] std::uint8_t guided_lobe(const Bsdf& bsdf, float u_closure, const Vec3& wi);

}  // namespace pharos
