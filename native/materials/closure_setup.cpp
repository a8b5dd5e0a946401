#include "materials/closure_setup.h"

#include "materials/closure_albedo.h"
#include "materials/closure_builder.h"
#include "materials/energy.h"
#include "materials/fresnel.h"
#include "materials/lobes/diffuse.h"

namespace pharos {

ClosureSink::ClosureSink(std::span<Closure> storage)
    : storage_(storage.first(std::min<std::size_t>(storage.size(), kMaxClosures))) {}

void ClosureSink::add(const Closure& closure) {
    if (closure.type == ClosureType::Transparent) {
        for (Closure& c : storage_.first(count_)) {
            if (c.type == ClosureType::Transparent) {
                c.weight += closure.weight;
                c.sample_weight += closure.sample_weight;
                return;
            }
        }
    }
    if (count_ < storage_.size()) {
        storage_[count_++] = closure;
        return;
    }
    ++dropped_;
    if (storage_.empty()) {
        return;
    }
    const auto least =
        std::min_element(storage_.begin(), storage_.end(), [](const Closure& a, const Closure& b) {
            return a.sample_weight < b.sample_weight;
        });
    if (least->sample_weight < closure.sample_weight) {
        *least = closure;
    }
}

float ClosureSink::total_sample_weight() const {
    float sum = 0.0f;
    for (const Closure& c : closures()) {
        sum += c.sample_weight;
    }
    return sum;
}

Vec3 ensure_valid_reflection(const Vec3& ng, const Vec3& wo, const Vec3& n) {
    const float io = glm::dot(wo, ng);
    const float threshold = std::min(0.9f * io, 0.01f);
    // Height of the mirror direction above the surface.
    if (2.0f * glm::dot(n, wo) * glm::dot(n, ng) - io >= threshold) {
        return n;
    }
    // In the plane of ng and n the mirror direction of wo's projection is to have just the height
    // `threshold`; its length stays that of the projection. n is half way between the two.
    const Vec3 across = normalize_or(n - ng * glm::dot(n, ng), Vec3(0.0f));
    if (is_zero(across)) {
        return ng;
    }
    const float ix = glm::dot(wo, across);
    const float length = ix * ix + io * io;
    const float rx = safe_sqrt(length - threshold * threshold);
    // ix + rx without cancellation where wo leans away from n.
    const float x = ix < 0.0f ? (io * io - threshold * threshold) / (rx - ix) : ix + rx;
    return normalize_or(across * x + ng * (io + threshold), ng);
}

namespace setup {

Vec3 glossy_normal(const Vec3& n, const ClosureSetupContext& ctx) {
    const Vec3 unit_n = normalize_or(n, ctx.ns);
    return unit_n == ctx.ng ? unit_n : ensure_valid_reflection(ctx.ng, ctx.wo, unit_n);
}

Vec3 diffuse_normal(const Vec3& n, const ClosureSetupContext& ctx) {
    return ctx.blender_version < 306 ? glossy_normal(n, ctx) : normalize_or(n, ctx.ns);
}

void set_bump_terminator(Closure& c, const ClosureSetupContext& ctx) {
    if (c.n == ctx.ns) {
        return;
    }
    c.tangent = ctx.ns;
    c.smith = ctx.blender_version >= 405 ? kBumpMasking : kBumpPolynomial;
    const float cosine = std::max(std::abs(glm::dot(c.n, ctx.ns)), 1e-3f);
    c.alpha_x = saturate(0.125f * (1.0f / (cosine * cosine) - 1.0f));
}

Vec3 tangent_around(const Vec3& n, const Vec3& direction) {
    const Vec3 d = normalize_or(direction, Vec3(0.0f));
    const Vec3 once = d - n * glm::dot(d, n);
    if (!(length_squared(once) > 1e-6f)) {
        return Vec3(0.0f);
    }
    // A second time: what was left of n has grown by the normalisation.
    const Vec3 t = glm::normalize(once);
    return glm::normalize(t - n * glm::dot(t, n));
}

void set_roughness(Closure& c, float roughness) {
    c.alpha_x = c.alpha_y = sqr(unit(roughness));
}

void set_anisotropic_roughness(Closure& c, float roughness, const Anisotropy& anisotropy) {
    set_roughness(c, roughness);
    const float amount = unit(anisotropy.amount);
    const Vec3 tangent = tangent_around(c.n, anisotropy.tangent);
    if (amount == 0.0f || is_zero(tangent)) {
        return;
    }
    const float aspect = std::sqrt(1.0f - 0.9f * amount);
    c.alpha_x = std::min(c.alpha_x / aspect, 1.0f);  // as Cycles
    c.alpha_y *= aspect;
    const SinCos turn = sincos_turns(bounded(anisotropy.rotation, -1e3f, 1e3f));
    c.tangent = glm::normalize(tangent * turn.cos + glm::cross(c.n, tangent) * turn.sin);
}

namespace {

// Kulla and Conty's further bounces on top of a lobe of albedo e (mean average_e).
void compensate(Closure& c, const Rgb& fss, float e, float average_e) {
    const Rgb fms = fss * average_e / (Rgb(1.0f) - fss * (1.0f - average_e));
    c.energy_scale = 1.0f / e;
    c.weight *= e + fms * (1.0f - e);
    c.smith = 0;
}

// Cycles 3 walks from facet to facet at random. Its albedo under a white sky is, within 1e-3, that
// of a walk which goes on with this probability after each bounce but the first, for rough lobes of
// three colours under six angles: a fit to 3.4.1's pictures.
[[nodiscard]] float walk_goes_on(float rough, float mu) {
    return 0.395f * std::pow(rough, 1.9f) * std::sqrt(mu);
}

}  // namespace

void preserve_reflection_energy(Closure& c, const Rgb& fss, const ClosureSetupContext& ctx) {
    if (!is_delta(c)) {
        const float rough = std::sqrt(std::sqrt(c.alpha_x * c.alpha_y));
        const float mu = glm::dot(c.n, ctx.wo);
        const float leaving = ctx.blender_version < 400 ? 1.0f - walk_goes_on(rough, saturate(mu))
                                                        : ggx_average_albedo(rough);
        compensate(c, fss, ggx_albedo(mu, rough), leaving);
    }
}

void preserve_glass_energy(Closure& c, const Rgb& fss, const ClosureSetupContext& ctx) {
    if (!is_delta(c)) {
        const float rough = std::sqrt(std::sqrt(c.alpha_x * c.alpha_y));
        const float e = ggx_glass_albedo(glm::dot(c.n, ctx.wo), rough, c.eta);
        compensate(c, fss, e, ggx_glass_average_albedo(rough, c.eta));
    }
}

Rgb add_closure(Closure& c, const ClosureSetupContext& ctx, ClosureSink& sink) {
    const float weight = average(c.weight);
    if (!(weight >= kWeightCutoff)) {
        return Rgb(0.0f);
    }
    if (c.type <= ClosureType::Transparent) {
        c.sample_weight = weight;
        sink.add(c);
        return c.weight;
    }
    const ClosureAlbedo albedo = closure_albedo(c, ctx.wo);
    const Rgb sum = albedo.reflected + albedo.transmitted;
    // What one bounce loses makes a lobe less likely, but layers below do not see it (as Cycles).
    // The floor keeps every lobe reachable, however low the estimate.
    c.sample_weight = std::max(average(sum) * single_scatter_share(c, ctx.wo), 0.01f * weight);
    sink.add(c);
    return sum;
}

void add_diffuse(const DiffuseInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::Diffuse;
    c.weight = in.weight;
    c.n = in.normal;
    set_bump_terminator(c, ctx);
    const float sigma = unit(in.roughness);
    if (sigma > 1e-5f) {
        c.type = ClosureType::OrenNayar;
        c.parameter = sigma;
        if (ctx.blender_version >= 403) {
            // Kulla-Conty form of the missing energy, its wo part already evaluated.
            const OrenNayarTerms terms = oren_nayar_terms(sigma);
            const float average_e = terms.a * kPi + terms.b * (2.0f * kPi / 3.0f - 28.0f / 15.0f);
            const float e = oren_nayar_albedo(terms, saturate(glm::dot(c.n, ctx.wo)));
            const Rgb rho = clamp_color(in.color);
            const Rgb further = Rgb(1.0f) - rho * (1.0f - average_e);
            c.f0 = rho * rho *
                   (average_e * std::max(1.0f - e, 0.0f) * kInvPi / (1.0f - average_e)) / further;
        }
    }
    add_closure(c, ctx, sink);
}

void make_singular_without_contrast(Closure& c) {
    if (std::abs(c.eta - 1.0f) < 1e-4f) {
        c.alpha_x = c.alpha_y = 0.0f;
    }
}

}  // namespace setup

namespace {

using namespace setup;

[[nodiscard]] Rgb node_weight(const ScatterInputs& in) {
    return safe_color(in.weight) * safe_color(in.color);
}

[[nodiscard]] float node_roughness(const ScatterInputs& in) {
    return in.distribution == Distribution::Sharp ? 0.0f : in.roughness;
}

[[nodiscard]] Closure glossy_closure(ClosureType type,
                                     const ScatterInputs& in,
                                     const ClosureSetupContext& ctx) {
    Closure c;
    c.type = type;
    c.weight = node_weight(in);
    c.n = glossy_normal(in.normal, ctx);
    c.smith = facets_of(in.distribution, ctx);
    set_roughness(c, node_roughness(in));
    return c;
}

}  // namespace

void setup_diffuse(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    add_diffuse(
        {node_weight(in), in.color, in.roughness, diffuse_normal(in.normal, ctx)}, ctx, sink);
}

void setup_glossy(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = glossy_closure(ClosureType::GgxReflection, in, ctx);
    if (multi_scatter(in.distribution)) {
        preserve_reflection_energy(c, clamp_color(in.color), ctx);
    }
    add_closure(c, ctx, sink);
}

void setup_glass(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = glossy_closure(ClosureType::GgxGlass, in, ctx);
    c.eta = relative_eta(in.ior, ctx);
    if (ctx.blender_version >= 400 || multi_scatter(in.distribution)) {
        c.fresnel = FresnelType::Dielectric;
        make_singular_without_contrast(c);
        if (multi_scatter(in.distribution)) {
            preserve_glass_energy(c, clamp_color(in.color), ctx);
        }
        add_closure(c, ctx, sink);
        return;
    }
    // 3.x: two closures, weighed by the reflectance at the shading normal.
    const float f = fresnel_dielectric(glm::dot(c.n, ctx.wo), c.eta);
    const Rgb weight = c.weight;
    c.type = ClosureType::GgxReflection;
    c.weight = weight * f;
    add_closure(c, ctx, sink);
    c.type = ClosureType::GgxRefraction;
    c.weight = weight * (1.0f - f);
    make_singular_without_contrast(c);
    add_closure(c, ctx, sink);
}

void setup_refraction(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c = glossy_closure(ClosureType::GgxRefraction, in, ctx);
    c.eta = relative_eta(in.ior, ctx);
    make_singular_without_contrast(c);
    add_closure(c, ctx, sink);
}

void setup_transparent(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::Transparent;
    c.weight = node_weight(in);
    c.n = ctx.ns;
    add_closure(c, ctx, sink);
}

void setup_translucent(const ScatterInputs& in, const ClosureSetupContext& ctx, ClosureSink& sink) {
    Closure c;
    c.type = ClosureType::Translucent;
    c.weight = node_weight(in);
    // Translucent keeps the reflection fix in every version.
    c.n = glossy_normal(in.normal, ctx);
    set_bump_terminator(c, ctx);
    add_closure(c, ctx, sink);
}

}  // namespace pharos
