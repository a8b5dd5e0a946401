// Steps shared by the set-up of all closures: safe inputs, normals, roughness, energy compensation.
// Internal to closure_setup.cpp and the two Principled versions.
#pragma once

#include "core/color.h"
#include "core/math.h"
#include "materials/closure_setup.h"

namespace pharos::setup {

inline constexpr float kWeightCutoff = 1e-5f;

// x within [lower, upper]; NaN becomes `lower`.
[[nodiscard]] inline float bounded(float x, float lower, float upper) {
    return x > lower ? std::min(x, upper) : lower;
}

[[nodiscard]] inline float unit(float x) {
    return bounded(x, 0.0f, 1.0f);
}

// Non-negative and finite; the bound leaves room for products.
[[nodiscard]] inline Rgb safe_color(const Rgb& c) {
    constexpr float kHuge = 1e8f;
    return Rgb(bounded(c.x, 0.0f, kHuge), bounded(c.y, 0.0f, kHuge), bounded(c.z, 0.0f, kHuge));
}

[[nodiscard]] inline Rgb clamp_color(const Rgb& c) {
    return Rgb(unit(c.x), unit(c.y), unit(c.z));
}

[[nodiscard]] inline bool multi_scatter(Distribution d) {
    return d == Distribution::MultiGgx;
}

// 4.x masks by height correlation, 3.x separably.
[[nodiscard]] inline std::uint8_t smith_of(const ClosureSetupContext& ctx) {
    return ctx.blender_version >= 400 ? 0 : kSeparableMasking;
}

// The same with the facets of a distribution.
[[nodiscard]] inline std::uint8_t facets_of(Distribution d, const ClosureSetupContext& ctx) {
    const int facets = d == Distribution::Beckmann           ? kBeckmannFacets
                       : d == Distribution::AshikhminShirley ? kAshikhminShirleyFacets
                                                             : 0;
    return static_cast<std::uint8_t>(smith_of(ctx) | facets);
}

// Unit normal of a closure. Mirror-like closures always get the reflection fix, diffuse ones before
// version 3.6.
[[nodiscard]] Vec3 glossy_normal(const Vec3& n, const ClosureSetupContext& ctx);
[[nodiscard]] Vec3 diffuse_normal(const Vec3& n, const ClosureSetupContext& ctx);

// Lets a diffuse closure know that its normal is bumped (lobes/diffuse.h).
void set_bump_terminator(Closure& c, const ClosureSetupContext& ctx);

// Unit vector across n towards `direction`; zero where that is (nearly) along n.
[[nodiscard]] Vec3 tangent_around(const Vec3& n, const Vec3& direction);

// Sets the closure's alphas from a roughness.
void set_roughness(Closure& c, float roughness);

// Anisotropy of the Principled nodes; rotation in turns. Isotropic when there is no tangent.
struct Anisotropy {
    float amount = 0.0f;
    float rotation = 0.0f;
    Vec3 tangent;
};

void set_anisotropic_roughness(Closure& c, float roughness, const Anisotropy& anisotropy);

// Makes up for what one bounce loses: the lobe is scaled by 1 / E for wo, and coloured by the mean
// reflectance `fss` of the further bounces (Kulla, Conty 2017): f *= 1 + Fms (1 - E) / E.
void preserve_reflection_energy(Closure& c, const Rgb& fss, const ClosureSetupContext& ctx);
// For glass Blender colours them by the transmission tint.
void preserve_glass_energy(Closure& c, const Rgb& fss, const ClosureSetupContext& ctx);

// The microfibre sheen of 4.x as seen along wo: its transformed cosine and its albedo.
void shape_sheen(Closure& c, float roughness, const ClosureSetupContext& ctx);

// Fills the sample weight and adds the closure, unless its weight is negligible. Returns its
// directional albedo, weight included.
Rgb add_closure(Closure& c, const ClosureSetupContext& ctx, ClosureSink& sink);

// Lambert or Oren-Nayar; `color` colours the multiple scattering of 4.3 and later.
struct DiffuseInputs {
    Rgb weight{0.0f};
    Rgb color{0.0f};  // weight is to include it
    float roughness = 0.0f;
    Vec3 normal;  // ready
};

void add_diffuse(const DiffuseInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink);

// Index seen from wo's side.
[[nodiscard]] inline float relative_eta(float ior, const ClosureSetupContext& ctx) {
    const float safe = bounded(ior, 1e-5f, 1e5f);
    return ctx.front_face ? safe : 1.0f / safe;
}

// Interfaces without contrast let light straight through.
void make_singular_without_contrast(Closure& c);

}  // namespace pharos::setup
