// Closures for tests: a hit in a simple frame, the set-up functions behind one call, random inputs.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "materials/bsdf.h"
#include "materials/closure_setup.h"
#include "support/random.h"

namespace pharos::test {

// Storage and the view of it.
struct Surface {
    std::array<Closure, kMaxClosures> storage;
    Bsdf bsdf;
    std::size_t dropped = 0;
};

using SurfaceSetup = std::function<void(const ClosureSetupContext&, ClosureSink&)>;

inline ClosureSetupContext make_context(const Vec3& wo, std::uint32_t version) {
    ClosureSetupContext ctx;
    ctx.wo = wo;
    ctx.ns = ctx.ng = Vec3(0, 0, 1);
    ctx.tangent = Vec3(1, 0, 0);
    ctx.blender_version = version;
    return ctx;
}

// Fills `surface`, which must stay where it is while its bsdf is used.
inline const Bsdf& build(Surface& surface,
                         const ClosureSetupContext& ctx,
                         const SurfaceSetup& setup) {
    ClosureSink sink(surface.storage);
    setup(ctx, sink);
    surface.bsdf = {sink.closures(), ctx.wo, ctx.ng, sink.total_sample_weight()};
    surface.dropped = sink.dropped();
    return surface.bsdf;
}

// Direction above z at this cosine.
inline Vec3 direction_at(float cosine, float phi = 0.7f) {
    const float s = safe_sqrt(1.0f - cosine * cosine);
    return Vec3(s * std::cos(phi), s * std::sin(phi), cosine);
}

// Directional albedo by sampling, with its standard error.
struct AlbedoEstimate {
    Vec3 mean{0.0f};
    float error = 0.0f;
};

inline AlbedoEstimate sampled_albedo(const Bsdf& bsdf, int count, std::uint64_t seed) {
    Random random(seed);
    glm::dvec3 sum(0.0);
    double squares = 0.0;
    for (int i = 0; i < count; ++i) {
        const float u = random.uniform();
        const auto s = sample_bsdf(bsdf, u, random.uniform2());
        if (s) {
            const glm::dvec3 w = glm::dvec3(s->f_cos) / static_cast<double>(s->pdf);
            sum += w;
            squares += w.x * w.x;
        }
    }
    const double n = count;
    const glm::dvec3 mean = sum / n;
    const double variance = std::max(squares / n - mean.x * mean.x, 0.0);
    return {Vec3(mean), static_cast<float>(std::sqrt(variance / n))};
}

// One kind of lobe with random, ordinary parameters: roughness in [roughness_min, 1].
struct LobeCase {
    std::string name;
    std::function<SurfaceSetup(Random&, float roughness_min)> make;
};

inline ScatterInputs random_scatter(Random& r, float roughness_min, Distribution distribution) {
    ScatterInputs in;
    in.normal = glm::normalize(Vec3(0, 0, 1) + 0.2f * r.direction());
    in.color = Rgb(0.2f) + 0.8f * r.uniform3();
    in.roughness = r.uniform(roughness_min, 1.0f);
    in.ior = r.uniform(1.05f, 2.5f);
    in.distribution = distribution;
    return in;
}

inline PrincipledV1Inputs random_principled_v1(Random& r, float roughness_min) {
    PrincipledV1Inputs in;
    in.normal = in.clearcoat_normal = Vec3(0, 0, 1);
    in.base_color = r.uniform3();
    in.roughness = r.uniform(roughness_min, 1.0f);
    in.metallic = r.uniform();
    in.specular_tint = r.uniform();
    in.anisotropic = r.uniform(0.0f, 0.8f);
    in.anisotropic_rotation = r.uniform();
    in.sheen = r.uniform();
    in.clearcoat = r.uniform();
    in.clearcoat_roughness = r.uniform(roughness_min, 1.0f);
    in.ior = r.uniform(1.05f, 2.0f);
    in.transmission = r.uniform();
    in.transmission_roughness = r.uniform();
    in.distribution = r.index(2) == 0 ? Distribution::Ggx : Distribution::MultiGgx;
    return in;
}

inline PrincipledV2Inputs random_principled_v2(Random& r, float roughness_min) {
    PrincipledV2Inputs in;
    in.normal = in.coat_normal = Vec3(0, 0, 1);
    in.base_color = r.uniform3();
    in.roughness = r.uniform(roughness_min, 1.0f);
    in.metallic = r.uniform();
    in.ior = r.uniform(1.05f, 2.0f);
    in.diffuse_roughness = r.uniform();
    in.specular_ior_level = r.uniform();
    in.specular_tint = r.uniform3();
    in.anisotropic = r.uniform(0.0f, 0.8f);
    in.anisotropic_rotation = r.uniform();
    in.transmission_weight = r.uniform();
    in.coat_weight = r.uniform();
    in.coat_roughness = r.uniform(roughness_min, 1.0f);
    in.coat_tint = r.uniform3();
    in.sheen_weight = r.uniform();
    in.sheen_roughness = r.uniform();
    in.distribution = r.index(2) == 0 ? Distribution::Ggx : Distribution::MultiGgx;
    return in;
}

inline std::vector<LobeCase> lobe_cases() {
    using Node = void (*)(const ScatterInputs&, const ClosureSetupContext&, ClosureSink&);
    const auto node = [](Node setup, Distribution distribution) {
        return [setup, distribution](Random& r, float roughness_min) -> SurfaceSetup {
            const ScatterInputs in = random_scatter(r, roughness_min, distribution);
            return [in, setup](const ClosureSetupContext& ctx, ClosureSink& sink) {
                setup(in, ctx, sink);
            };
        };
    };
    std::vector<LobeCase> cases{
        {"diffuse", node(setup_diffuse, Distribution::Ggx)},
        {"translucent", node(setup_translucent, Distribution::Ggx)},
        {"glossy", node(setup_glossy, Distribution::Ggx)},
        {"glossy multi", node(setup_glossy, Distribution::MultiGgx)},
        {"glass", node(setup_glass, Distribution::Ggx)},
        {"glass multi", node(setup_glass, Distribution::MultiGgx)},
        {"refraction", node(setup_refraction, Distribution::Ggx)},
        {"glossy beckmann", node(setup_glossy, Distribution::Beckmann)},
        {"glass beckmann", node(setup_glass, Distribution::Beckmann)},
        {"refraction beckmann", node(setup_refraction, Distribution::Beckmann)},
        {"glossy ashikhmin", node(setup_glossy, Distribution::AshikhminShirley)},
    };
    const auto special = [](Node setup, Distribution distribution, bool flag) {
        return [setup, distribution, flag](Random& r, float roughness_min) -> SurfaceSetup {
            ScatterInputs in = random_scatter(r, roughness_min, distribution);
            in.anisotropy = r.uniform(-0.6f, 0.6f);
            in.rotation = r.uniform();
            in.edge = r.uniform3() * (flag ? 4.0f : 1.0f);
            in.smooth = r.uniform();
            in.physical = in.glossy = flag;
            return [in, setup](const ClosureSetupContext& ctx, ClosureSink& sink) {
                setup(in, ctx, sink);
            };
        };
    };
    cases.push_back({"anisotropic", special(setup_anisotropic, Distribution::Ggx, false)});
    cases.push_back({"long beckmann", special(setup_anisotropic, Distribution::Beckmann, false)});
    cases.push_back(
        {"long ashikhmin", special(setup_anisotropic, Distribution::AshikhminShirley, false)});
    cases.push_back({"metallic", special(setup_metallic, Distribution::Ggx, false)});
    cases.push_back({"conductor", special(setup_metallic, Distribution::MultiGgx, true)});
    cases.push_back({"toon diffuse", special(setup_toon, Distribution::Ggx, false)});
    cases.push_back({"toon glossy", special(setup_toon, Distribution::Ggx, true)});
    cases.push_back({"velvet", special(setup_velvet, Distribution::Ggx, false)});
    cases.push_back({"sheen", special(setup_sheen, Distribution::Ggx, false)});
    cases.push_back({"principled v1", [](Random& r, float roughness_min) -> SurfaceSetup {
                         const PrincipledV1Inputs in = random_principled_v1(r, roughness_min);
                         return [in](const ClosureSetupContext& ctx, ClosureSink& sink) {
                             setup_principled_v1(in, ctx, sink);
                         };
                     }});
    cases.push_back({"principled v2", [](Random& r, float roughness_min) -> SurfaceSetup {
                         const PrincipledV2Inputs in = random_principled_v2(r, roughness_min);
                         return [in](const ClosureSetupContext& ctx, ClosureSink& sink) {
                             static_cast<void>(setup_principled_v2(in, ctx, sink));
                         };
                     }});
    return cases;
}

}  // namespace pharos::test
