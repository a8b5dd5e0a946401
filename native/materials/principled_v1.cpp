// Principled BSDF of Blender 3.x (Burley 2012 and 2015): lobes are added, not layered.
// cycles-parity 2.8; emission and alpha are operations of their own.
#include "materials/closure_builder.h"
#include "materials/closure_setup.h"
#include "materials/fresnel.h"
#include "materials/lobes/clearcoat.h"

namespace pharos {

namespace {

using namespace setup;

// Inputs after clamping, and what several lobes need.
struct V1 {
    Rgb weight;
    Rgb base;
    Rgb specular_hue;  // base color over its luminance, by the weights Blender uses there
    Rgb sheen_hue;
    Vec3 normal;
    float metallic;
    float transmission;
    float diffuse_share;
    float roughness;
    bool multi;
};

[[nodiscard]] Rgb hue(const Rgb& color, float lum) {
    return lum > 0.0f ? color / lum : Rgb(1.0f);
}

[[nodiscard]] V1 prepare(const PrincipledV1Inputs& in, const ClosureSetupContext& ctx) {
    V1 v{};
    v.weight = safe_color(in.weight);
    v.base = safe_color(in.base_color);
    v.specular_hue = hue(v.base, 0.3f * v.base.x + 0.6f * v.base.y + 0.1f * v.base.z);
    v.sheen_hue = hue(v.base, luminance(v.base));
    v.normal = glossy_normal(in.normal, ctx);
    v.metallic = unit(in.metallic);
    v.transmission = unit(in.transmission);
    v.diffuse_share = (1.0f - v.metallic) * (1.0f - v.transmission);
    v.roughness = unit(in.roughness);
    v.multi = multi_scatter(in.distribution);
    return v;
}

void add_diffuse_lobes(const PrincipledV1Inputs& in,
                       const V1& v,
                       const ClosureSetupContext& ctx,
                       ClosureSink& sink) {
    if (!(v.diffuse_share > kWeightCutoff)) {
        return;
    }
    // Subsurface scattering is drawn as diffuse of the mixed colour.
    Closure c;
    c.type = ClosureType::DisneyDiffuse;
    c.n = v.normal;
    set_bump_terminator(c, ctx);
    c.parameter = v.roughness;
    c.weight = v.weight * v.diffuse_share *
               lerp(v.base, safe_color(in.subsurface_color), unit(in.subsurface));
    add_closure(c, ctx, sink);

    const float sheen = bounded(in.sheen, 0.0f, 1e4f);
    if (sheen > kWeightCutoff) {
        Closure s;
        s.type = ClosureType::Sheen;
        s.smith = 1;
        s.n = v.normal;
        s.weight = v.weight * (sheen * v.diffuse_share) *
                   lerp(Rgb(1.0f), v.sheen_hue, unit(in.sheen_tint));
        add_closure(s, ctx, sink);
    }
}

void add_specular(const PrincipledV1Inputs& in,
                  const V1& v,
                  const ClosureSetupContext& ctx,
                  ClosureSink& sink) {
    const float specular = bounded(in.specular, 0.0f, 12.0f);
    const float share = 1.0f - v.transmission * (1.0f - v.metallic);
    if (!(share > kWeightCutoff) || !(specular > kWeightCutoff || v.metallic > kWeightCutoff)) {
        return;
    }
    const Rgb tint = lerp(Rgb(1.0f), v.specular_hue, unit(in.specular_tint));
    Closure c;
    c.type = ClosureType::GgxReflection;
    c.fresnel = FresnelType::PrincipledV1;
    c.n = v.normal;
    c.smith = smith_of(ctx);
    c.weight = v.weight * share;
    c.eta = eta_from_f0(0.08f * specular);
    c.f0 = tint * (0.08f * specular * (1.0f - v.metallic)) + v.base * v.metallic;
    set_anisotropic_roughness(
        c,
        v.roughness,
        {in.anisotropic, in.anisotropic_rotation, is_zero(in.tangent) ? ctx.tangent : in.tangent});
    if (v.multi && v.roughness > 0.075f) {
        const float f0 = f0_from_eta(c.eta);
        const float shape = (dielectric_average_reflectance(c.eta) - f0) / (1.0f - f0);
        preserve_reflection_energy(c, clamp_color(lerp(c.f0, Rgb(1.0f), saturate(shape))), ctx);
    }
    add_closure(c, ctx, sink);
}

void add_glass(const PrincipledV1Inputs& in,
               const V1& v,
               const ClosureSetupContext& ctx,
               ClosureSink& sink) {
    const float share = v.transmission * (1.0f - v.metallic);
    if (!(share > kWeightCutoff)) {
        return;
    }
    Closure c;
    c.n = v.normal;
    c.eta = relative_eta(in.ior, ctx);
    c.f0 = lerp(Rgb(1.0f), v.base, unit(in.specular_tint));
    c.fresnel = FresnelType::PrincipledV1;
    c.smith = smith_of(ctx);
    set_roughness(c, v.roughness);
    if (v.multi && v.roughness > 0.05f) {
        c.type = ClosureType::GgxGlass;
        c.weight = v.weight * share;
        c.transmission_tint = v.base;
        make_singular_without_contrast(c);
        preserve_glass_energy(c, clamp_color(v.base), ctx);
        add_closure(c, ctx, sink);
        return;
    }
    const float f = fresnel_dielectric(glm::dot(c.n, ctx.wo), c.eta);
    c.type = ClosureType::GgxReflection;
    c.weight = v.weight * (share * f);
    add_closure(c, ctx, sink);
    // The refraction may be rougher than the reflection; only without multiple scattering.
    const float extra = v.multi ? 0.0f : unit(in.transmission_roughness);
    c.type = ClosureType::GgxRefraction;
    c.fresnel = FresnelType::None;
    c.weight = v.weight * v.base * (share * std::max(1e-4f, 1.0f - f));
    set_roughness(c, 1.0f - (1.0f - v.roughness) * (1.0f - extra));
    make_singular_without_contrast(c);
    add_closure(c, ctx, sink);
}

void add_clearcoat(const PrincipledV1Inputs& in,
                   const V1& v,
                   const ClosureSetupContext& ctx,
                   ClosureSink& sink) {
    const float clearcoat = bounded(in.clearcoat, 0.0f, 1e4f);
    if (!(clearcoat > kWeightCutoff)) {
        return;
    }
    Closure c;
    c.type = ClosureType::Clearcoat;
    c.fresnel = FresnelType::PrincipledV1;
    c.n = glossy_normal(in.clearcoat_normal, ctx);
    c.smith = 1;
    c.weight = v.weight * (0.25f * clearcoat);
    c.eta = 1.5f;
    c.f0 = Rgb(0.04f);
    c.alpha_x = c.alpha_y = std::max(sqr(unit(in.clearcoat_roughness)), kClearcoatMinAlpha);
    add_closure(c, ctx, sink);
}

}  // namespace

void setup_principled_v1(const PrincipledV1Inputs& in,
                         const ClosureSetupContext& ctx,
                         ClosureSink& sink) {
    const V1 v = prepare(in, ctx);
    add_diffuse_lobes(in, v, ctx, sink);
    add_specular(in, v, ctx, sink);
    add_glass(in, v, ctx, sink);
    add_clearcoat(in, v, ctx, sink);
}

}  // namespace pharos
