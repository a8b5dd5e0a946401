// Set-up of the shader nodes that few materials use: anisotropic, metallic, toon, velvet, sheen.
#include <algorithm>

#include "materials/closure_builder.h"
#include "materials/closure_setup.h"
#include "materials/fresnel.h"
#include "materials/sheen_fit.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

using namespace setup;

[[nodiscard]] Closure closure_of(ClosureType type, const ScatterInputs& in, const Vec3& normal) {
    Closure c;
    c.type = type;
    c.weight = safe_color(in.weight) * safe_color(in.color);
    c.n = normal;
    return c;
}

[[nodiscard]] Vec3 tangent_of(const ScatterInputs& in, const ClosureSetupContext& ctx) {
    return is_zero(in.tangent) ? ctx.tangent : in.tangent;
}

// Unpolarised reflectance of a metal in air.
[[nodiscard]] float conductor_reflectance(float cosine, float n, float k) {
    const float c2 = cosine * cosine;
    const float size = n * n + k * k;
    const float parallel = size * c2 - 2.0f * n * cosine + 1.0f;
    const float across = size - 2.0f * n * cosine + c2;
    const float sum_parallel = size * c2 + 2.0f * n * cosine + 1.0f;
    const float sum_across = size + 2.0f * n * cosine + c2;
    return saturate(0.5f * (parallel / sum_parallel + across / sum_across));
}

}  // namespace

// Here the two roughnesses are r (1 - a) and r / (1 - a), and a may be negative.
void setup_anisotropic(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = closure_of(ClosureType::GgxReflection, in, glossy_normal(in.normal, ctx));
    c.smith = facets_of(in.distribution, ctx);
    set_roughness(c, in.distribution == Distribution::Sharp ? 0.0f : in.roughness);
    const Vec3 tangent = tangent_around(c.n, tangent_of(in, ctx));
    const float amount = bounded(in.anisotropy, -0.99f, 0.99f);
    if (amount != 0.0f && !is_zero(tangent)) {
        const float factor = amount < 0.0f ? 1.0f / (1.0f + amount) : 1.0f - amount;
        c.alpha_x *= factor;
        c.alpha_y /= factor;
        const SinCos turn = sincos_turns(bounded(in.rotation, -1e3f, 1e3f));
        c.tangent = glm::normalize(tangent * turn.cos + glm::cross(c.n, tangent) * turn.sin);
    }
    if (multi_scatter(in.distribution)) {
        preserve_reflection_energy(c, clamp_color(in.color), ctx);
    }
    add_closure(c, ctx, sink);
}

// A metal's exact reflectance is replaced by the F82 curve through it at 0 and 82 degrees.
void setup_metallic(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = closure_of(ClosureType::GgxReflection, in, glossy_normal(in.normal, ctx));
    c.weight = safe_color(in.weight);
    c.fresnel = FresnelType::F82Tint;
    c.smith = facets_of(in.distribution, ctx);
    Rgb tint = clamp_color(in.edge);
    c.f0 = clamp_color(in.color);
    if (in.physical) {
        const Rgb n = safe_color(in.color);
        const Rgb k = safe_color(in.edge);
        for (int i = 0; i < 3; ++i) {
            constexpr float kEdge = 1.0f / 7.0f;
            c.f0[i] = conductor_reflectance(1.0f, n[i], k[i]);
            constexpr float kWeight = 0.46266436f;  // (1 - kEdge)^5
            const float schlick = lerp(c.f0[i], 1.0f, kWeight);
            tint[i] = saturate(conductor_reflectance(kEdge, n[i], k[i]) / schlick);
        }
    }
    c.f90 = f82_b_from_tint(c.f0, tint);
    set_anisotropic_roughness(c, in.roughness, {in.anisotropy, in.rotation, tangent_of(in, ctx)});
    if (multi_scatter(in.distribution)) {
        const Rgb fss = lerp(c.f0, Rgb(1.0f), 1.0f / 21.0f) - c.f90 * (1.0f / 126.0f);
        preserve_reflection_energy(c, glm::clamp(fss, 0.0f, 1.0f), ctx);
    }
    add_closure(c, ctx, sink);
}

void setup_toon(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    const Vec3 normal = in.glossy ? glossy_normal(in.normal, ctx) : diffuse_normal(in.normal, ctx);
    Closure c =
        closure_of(in.glossy ? ClosureType::ToonGlossy : ClosureType::ToonDiffuse, in, normal);
    // A cone of no width would be a mirror.
    constexpr float kLeast = 1e-3f;
    c.parameter = bounded(in.roughness, 0.0f, 1.0f) * 0.5f * kPi;
    c.alpha_x = bounded(in.smooth, 0.0f, 1.0f) * 0.5f * kPi;
    c.parameter = c.parameter + c.alpha_x < kLeast ? kLeast : c.parameter;
    add_closure(c, ctx, sink);
}

void setup_velvet(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = closure_of(ClosureType::Velvet, in, diffuse_normal(in.normal, ctx));
    c.parameter = bounded(in.roughness, 0.01f, 1.0f);
    add_closure(c, ctx, sink);
}

void setup_sheen(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = closure_of(ClosureType::Sheen, in, normalize_or(in.normal, ctx.ns));
    shape_sheen(c, in.roughness, ctx);
    add_closure(c, ctx, sink);
}

namespace setup {

void shape_sheen(Closure& c, float roughness, const ClosureSetupContext& ctx) {
    const float mu = saturate(glm::dot(c.n, ctx.wo));
    const SheenLtc ltc = sheen_ltc(mu, bounded(roughness, 1e-3f, 1.0f));
    c.alpha_x = ltc.a;
    c.alpha_y = ltc.b;
    c.energy_scale = ltc.albedo;
    c.tangent = tangent_around(c.n, ctx.wo);
    if (is_zero(c.tangent)) {
        c.tangent = Frame::from_z(c.n).x;
    }
}

}  // namespace setup

}  // namespace pharos
