// Principled BSDF of Blender 4.x: layers from top to bottom, each taking its albedo from the weight
// left for what lies below (cycles-parity 2.7).
#include <array>

#include "materials/closure_builder.h"
#include "materials/closure_setup.h"
#include "materials/fresnel.h"
#include "materials/thin_film.h"

namespace pharos {

namespace {

using namespace setup;

// What is left below a layer of this albedo.
[[nodiscard]] Rgb below_layer(const Rgb& weight, const Rgb& albedo) {
    float most = 0.0f;
    for (int i = 0; i < 3; ++i) {
        most = weight[i] > 0.0f ? std::max(most, albedo[i] / weight[i]) : most;
    }
    return weight * saturate(1.0f - most);
}

// Weight and normals as the layers are added.
struct Layers {
    Rgb weight;
    Vec3 normal;
    Vec3 coat_normal;
    float coat = 0.0f;
};

void add_sheen(const PrincipledV2Inputs& in,
               Layers& layers,
               const ClosureSetupContext& ctx,
               ClosureSink& sink) {
    const Rgb tint = bounded(in.sheen_weight, 0.0f, 1.0f) * safe_color(in.sheen_tint);
    if (!(average(tint) > kWeightCutoff)) {
        return;
    }
    Closure c;
    c.type = ClosureType::Sheen;
    c.weight = layers.weight * tint;
    c.n = normalize_or(lerp(layers.normal, layers.coat_normal, layers.coat), layers.normal);
    shape_sheen(c, in.sheen_roughness, ctx);
    layers.weight = below_layer(layers.weight, add_closure(c, ctx, sink));
}

void add_coat(const PrincipledV2Inputs& in,
              Layers& layers,
              const ClosureSetupContext& ctx,
              ClosureSink& sink) {
    if (!(layers.coat > kWeightCutoff)) {
        return;
    }
    Closure c;
    c.type = ClosureType::GgxReflection;
    c.fresnel = FresnelType::Dielectric;
    c.weight = layers.weight * layers.coat;
    c.n = glossy_normal(layers.coat_normal, ctx);
    c.eta = bounded(in.coat_ior, 1.0f, 1e5f);
    set_roughness(c, in.coat_roughness);
    preserve_reflection_energy(c, Rgb(dielectric_average_reflectance(c.eta)), ctx);
    layers.weight = below_layer(layers.weight, add_closure(c, ctx, sink));
    // The tint is that of the path through the coat and back, longer at grazing view.
    const Rgb tint = clamp_color(in.coat_tint);
    if (tint != Rgb(1.0f)) {
        const float cosine = saturate(glm::dot(c.n, ctx.wo));
        const float inside = std::sqrt(1.0f - (1.0f - cosine * cosine) / (c.eta * c.eta));
        const float depth = 1.0f / std::max(inside, 1e-4f);
        layers.weight *= lerp(Rgb(1.0f), glm::pow(tint, Vec3(depth)), layers.coat);
    }
}

// Alpha, sheen, coat.
[[nodiscard]] Layers add_upper_layers(const PrincipledV2Inputs& in,
                                      const ClosureSetupContext& ctx,
                                      ClosureSink& sink) {
    Layers layers;
    layers.weight = safe_color(in.weight);
    const float alpha = unit(in.alpha);
    if (alpha < 1.0f) {
        ScatterInputs transparent;
        transparent.weight = layers.weight * (1.0f - alpha);
        transparent.color = Rgb(1.0f);
        setup_transparent(transparent, ctx, sink);
        layers.weight *= alpha;
    }
    layers.normal = normalize_or(in.normal, ctx.ns);
    layers.coat_normal = normalize_or(in.coat_normal, ctx.ns);
    layers.coat = unit(in.coat_weight);
    add_sheen(in, layers, ctx, sink);
    add_coat(in, layers, ctx, sink);
    return layers;
}

void add_metal(const PrincipledV2Inputs& in,
               const Rgb& weight,
               const Vec3& normal,
               const ClosureSetupContext& ctx,
               ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::GgxReflection;
    c.fresnel = FresnelType::F82Tint;
    c.weight = weight;
    c.n = normal;
    c.smith = smith_of(ctx);
    c.f0 = clamp_color(in.base_color);
    c.f90 = f82_b_from_tint(c.f0, clamp_color(in.specular_tint));
    set_anisotropic_roughness(
        c,
        in.roughness,
        {in.anisotropic, in.anisotropic_rotation, is_zero(in.tangent) ? ctx.tangent : in.tangent});
    if (multi_scatter(in.distribution)) {
        const Rgb fss = lerp(c.f0, Rgb(1.0f), 1.0f / 21.0f) - c.f90 * (1.0f / 126.0f);
        preserve_reflection_energy(c, glm::clamp(fss, 0.0f, 1.0f), ctx);
    }
    add_closure(c, ctx, sink);
}

// A film over the closure's dielectric. Seen from inside, indices are relative to it.
void cover_with_film(Closure& c, const PrincipledV2Inputs& in, bool from_inside) {
    const float thickness = bounded(in.thin_film_thickness, 0.0f, 1e6f);
    if (thickness > kThinnestFilm) {
        const float film = bounded(in.thin_film_ior, 1e-5f, 1e5f);
        c.fresnel = FresnelType::ThinFilm;
        c.f90 = Rgb(from_inside ? film * c.eta : film, thickness, 0.0f);
    }
}

void add_transmission(const PrincipledV2Inputs& in,
                      const Rgb& weight,
                      const Vec3& normal,
                      const ClosureSetupContext& ctx,
                      ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::GgxGlass;
    c.fresnel = FresnelType::GeneralizedSchlick;
    c.weight = weight;
    c.n = normal;
    c.smith = smith_of(ctx);
    c.eta = relative_eta(in.ior, ctx);
    c.f0 = glm::min(f0_from_eta(c.eta) * safe_color(in.specular_tint), Rgb(1.0f));
    c.transmission_tint = glm::sqrt(clamp_color(in.base_color));
    set_roughness(c, in.roughness);
    make_singular_without_contrast(c);
    cover_with_film(c, in, !ctx.front_face);
    if (multi_scatter(in.distribution)) {
        preserve_glass_energy(c, c.transmission_tint, ctx);
    }
    add_closure(c, ctx, sink);
}

// The dielectric coat of the base; returns what it lets through.
[[nodiscard]] Rgb add_specular(const PrincipledV2Inputs& in,
                               const Rgb& weight,
                               const Vec3& normal,
                               const ClosureSetupContext& ctx,
                               ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::GgxReflection;
    c.fresnel = FresnelType::GeneralizedSchlick;
    c.weight = weight;
    c.n = normal;
    c.smith = smith_of(ctx);
    c.eta = bounded(in.ior, 1e-5f, 1e5f);
    float f0 = f0_from_eta(c.eta);
    const float level = bounded(in.specular_ior_level, 0.0f, 1e4f);
    if (level != 0.5f) {
        f0 = std::min(2.0f * level * f0, 0.99f);
        c.eta = c.eta < 1.0f ? 1.0f / eta_from_f0(f0) : eta_from_f0(f0);
    }
    cover_with_film(c, in, false);
    if (c.eta == 1.0f && c.fresnel != FresnelType::ThinFilm) {
        return weight;
    }
    c.f0 = glm::min(f0 * safe_color(in.specular_tint), Rgb(1.0f));
    set_anisotropic_roughness(
        c,
        in.roughness,
        {in.anisotropic, in.anisotropic_rotation, is_zero(in.tangent) ? ctx.tangent : in.tangent});
    if (multi_scatter(in.distribution)) {
        const float shape = (dielectric_average_reflectance(c.eta) - f0) / (1.0f - f0);
        preserve_reflection_energy(c, lerp(c.f0, Rgb(1.0f), saturate(shape)), ctx);
    }
    return below_layer(weight, add_closure(c, ctx, sink));
}

void add_base(const PrincipledV2Inputs& in,
              const Rgb& weight,
              const ClosureSetupContext& ctx,
              ClosureSink& sink) {
    // Subsurface scattering is drawn as diffuse; its colour is clamped as Cycles clamps it.
    const float subsurface = unit(in.subsurface_weight);
    const Rgb base = safe_color(in.base_color);
    const Rgb color = base * (1.0f - subsurface) + clamp_color(in.base_color) * subsurface;
    const float roughness = ctx.blender_version >= 403 ? in.diffuse_roughness : 0.0f;
    add_diffuse({weight * color, color, roughness, diffuse_normal(in.normal, ctx)}, ctx, sink);
}

}  // namespace

Rgb setup_principled_v2(const PrincipledV2Inputs& in,
                        const ClosureSetupContext& ctx,
                        ClosureSink& sink) {
    const Layers layers = add_upper_layers(in, ctx, sink);
    Rgb weight = layers.weight;
    const Vec3 normal = glossy_normal(in.normal, ctx);
    const float metallic = unit(in.metallic);
    if (metallic > kWeightCutoff) {
        add_metal(in, weight * metallic, normal, ctx, sink);
        weight *= 1.0f - metallic;
    }
    const float transmission = unit(in.transmission_weight);
    if (transmission > kWeightCutoff && metallic < 1.0f) {
        add_transmission(in, weight * transmission, normal, ctx, sink);
        weight *= 1.0f - transmission;
    }
    if (average(weight) >= kWeightCutoff) {
        add_base(in, add_specular(in, weight, normal, ctx, sink), ctx, sink);
    }
    return layers.weight;
}

Rgb principled_v2_emission_weight(const PrincipledV2Inputs& in, const ClosureSetupContext& ctx) {
    // The upper layers are built into storage that is thrown away: at most three closures.
    std::array<Closure, 3> storage;
    ClosureSink sink(storage);
    return add_upper_layers(in, ctx, sink).weight;
}

}  // namespace pharos
