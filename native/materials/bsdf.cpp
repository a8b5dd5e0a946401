// The dispatch over closures: one switch a function, no virtual calls, lobes inlined.
//
// A direction on different sides of ng and of a closure's shading normal can not be sampled
// (rejected, as in Cycles), so it adds to f but not to the pdf: next-event estimation then weighs
// it fully.
#include "materials/bsdf.h"

#include "core/color.h"
#include "core/visibility.h"
#include "materials/closure_albedo.h"
#include "materials/fresnel.h"
#include "materials/lobes/clearcoat.h"
#include "materials/lobes/diffuse.h"
#include "materials/lobes/ggx.h"
#include "materials/lobes/other_distributions.h"
#include "materials/lobes/sheen.h"
#include "materials/lobes/toon.h"
#include "materials/lobes/velvet.h"
#include "materials/microfacet.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

[[nodiscard]] inline BsdfEval eval_closure(const Closure& c, const Vec3& wo, const Vec3& wi) {
    switch (c.type) {
        case ClosureType::Diffuse:
            return eval_lambert(c, wi);
        case ClosureType::OrenNayar:
            return eval_oren_nayar(c, wo, wi);
        case ClosureType::DisneyDiffuse:
            return eval_disney_diffuse(c, wo, wi);
        case ClosureType::Translucent:
            return eval_translucent(c, wi);
        case ClosureType::Transparent:
            return {};
        case ClosureType::GgxReflection:
            if (c.smith > kSeparableMasking) {
                return c.smith >= kAshikhminShirleyFacets ? eval_ashikhmin_shirley(c, wo, wi)
                                                          : eval_beckmann(c, wo, wi);
            }
            return eval_ggx_reflection(c, wo, wi);
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
            return c.smith > kSeparableMasking ? eval_beckmann(c, wo, wi)
                                               : eval_ggx_glass(c, wo, wi);
        case ClosureType::Clearcoat:
            return eval_clearcoat(c, wo, wi);
        case ClosureType::Sheen:
            return c.smith != 0 ? eval_sheen_v1(c, wo, wi) : eval_sheen_ltc(c, wi);
        case ClosureType::ToonDiffuse:
        case ClosureType::ToonGlossy:
            return eval_toon(c, wo, wi);
        case ClosureType::Velvet:
            return eval_velvet(c, wo, wi);
    }
    return {};
}

// Direction of a smooth closure; u_branch is a random number of its own for glass.
[[nodiscard]] inline std::optional<Vec3> sample_direction(const Closure& c,
                                                          const Vec3& wo,
                                                          float u_branch,
                                                          const Vec2& u) {
    switch (c.type) {
        case ClosureType::GgxReflection:
            return c.smith >= kAshikhminShirleyFacets ? sample_ashikhmin_shirley(c, wo, u)
                                                      : sample_ggx_reflection(c, wo, u);
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
            return sample_ggx_glass(c, wo, u_branch, u);
        case ClosureType::Clearcoat: {
            const Vec3 h = Frame::from_z(c.n).to_world(sample_gtr1(c.alpha_x, u));
            return glm::normalize(h * (2.0f * glm::dot(wo, h)) - wo);
        }
        case ClosureType::Sheen:
            if (c.smith == 0) {
                return sample_sheen_ltc(c, u);
            }
            break;
        case ClosureType::ToonDiffuse:
        case ClosureType::ToonGlossy:
            return sample_toon(c, wo, u);
        case ClosureType::Velvet:
            return Frame::from_z(c.n).to_world(sample_uniform_cone(u, 1.0f));
        case ClosureType::Translucent:
            return Frame::from_z(-c.n).to_world(sample_cosine_hemisphere(u));
        default:
            break;
    }
    return Frame::from_z(c.n).to_world(sample_cosine_hemisphere(u));
}

[[nodiscard]] inline std::uint8_t lobe_bits(const Closure& c, bool transmitted) {
    switch (c.type) {
        case ClosureType::GgxReflection:
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
        case ClosureType::Clearcoat:
            return transmitted ? kLobeGlossy | kLobeTransmission : kLobeGlossy;
        case ClosureType::ToonGlossy:
            return kLobeGlossy;
        case ClosureType::Translucent:
            return kLobeDiffuse | kLobeTransmission;
        default:
            return kLobeDiffuse;
    }
}

[[nodiscard]] inline float lobe_roughness(const Closure& c) {
    switch (c.type) {
        case ClosureType::GgxReflection:
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
            return std::sqrt(std::sqrt(c.alpha_x * c.alpha_y));
        case ClosureType::Clearcoat:
            return std::sqrt(c.alpha_x);
        default:
            return 1.0f;
    }
}

struct ClosureChoice {
    const Closure* closure = nullptr;  // null: none has a sample weight
    float u_branch = 0.0f;  // what is left of u_closure within its interval: fresh in [0, 1)
};

[[nodiscard]] inline ClosureChoice choose_closure(const Bsdf& bsdf, float u_closure) {
    ClosureChoice choice;
    float remaining = u_closure * bsdf.total_sample_weight;
    for (const Closure& c : bsdf.closures) {
        if (!(c.sample_weight > 0.0f)) {
            continue;
        }
        choice.closure = &c;
        choice.u_branch = std::min(remaining / c.sample_weight, kOneMinusEpsilon);
        if (remaining < c.sample_weight) {
            break;
        }
        remaining -= c.sample_weight;
    }
    return choice;
}

// The sample weight is the average albedo, found at set-up; here it gets its colour back.
[[nodiscard]] inline Rgb albedo_from_sample_weight(const Closure& c, const Vec3& wo) {
    Rgb tint = c.weight;
    if (c.type == ClosureType::GgxReflection && c.fresnel != FresnelType::None &&
        c.fresnel != FresnelType::Dielectric) {
        tint *= lerp(c.f0, Rgb(1.0f), schlick_weight(glm::dot(c.n, wo)));
    }
    const float mean = average(tint);
    return mean > 0.0f ? tint * (c.sample_weight / mean) : Rgb(0.0f);
}

// A delta closure chosen with probability `share`.
[[nodiscard]] std::optional<BsdfSample> sample_delta(const Closure& c,
                                                     const Bsdf& bsdf,
                                                     float share,
                                                     float u_branch) {
    BsdfSample s;
    s.roughness = 0.0f;
    if (c.type == ClosureType::Transparent) {
        s.wi = -bsdf.wo;
        s.pdf = share;
        s.f_cos = c.weight;
        s.lobe = kLobeDelta | kLobeTransparent;
        return s;
    }
    const float zo = glm::dot(c.n, bsdf.wo);
    if (!(zo > 0.0f)) {
        return std::nullopt;
    }
    const bool glass = c.type != ClosureType::GgxReflection;
    const FresnelSplit split =
        glass ? closure_fresnel_split(c, zo) : FresnelSplit{closure_reflectance(c, zo), Rgb(0.0f)};
    const float reflect = glass ? detail::reflect_probability(split) : 1.0f;
    if (u_branch < reflect) {
        s.wi = glm::normalize(c.n * (2.0f * zo) - bsdf.wo);
        s.pdf = share * reflect;
        s.f_cos = c.weight * split.reflected * c.energy_scale;
        s.lobe = kLobeDelta;
    } else {
        const float cosine = refracted_cosine(zo, c.eta);
        if (cosine < 0.0f) {
            return std::nullopt;
        }
        s.wi = glm::normalize(c.n * (zo / c.eta - cosine) - bsdf.wo * (1.0f / c.eta));
        s.pdf = share * (1.0f - reflect);
        s.f_cos = c.weight * split.transmitted * c.energy_scale;
        s.lobe = kLobeDelta | kLobeTransmission;
        s.eta = c.eta;
    }
    const bool in_front = glm::dot(s.wi, bsdf.ng) > 0.0f;
    if (in_front != (s.lobe == kLobeDelta) || !(s.pdf > 0.0f)) {
        return std::nullopt;
    }
    return s;
}

[[nodiscard]] inline std::optional<BsdfSample> sample_single_diffuse(const Bsdf& bsdf,
                                                                     const Vec2& u) {
    const Closure& c = bsdf.closures[0];
    BsdfSample s;
    s.wi = Frame::from_z(c.n).to_world(sample_cosine_hemisphere(u));
    const BsdfEval e = eval_lambert(c, s.wi);
    if (!(glm::dot(s.wi, bsdf.ng) > 0.0f) || !(e.pdf > 0.0f)) {
        return std::nullopt;
    }
    s.f_cos = e.f_cos;
    s.pdf = e.pdf;
    s.lobe = kLobeDiffuse;
    return s;
}

}  // namespace

namespace {

// Sum of the smooth closures that `counts` names.
template <class Counts>
[[nodiscard]] BsdfEval eval_closures(const Bsdf& bsdf, const Vec3& wi, const Counts& counts) {
    const bool in_front = glm::dot(wi, bsdf.ng) > 0.0f;
    BsdfEval sum;
    for (const Closure& c : bsdf.closures) {
        if (is_delta(c) || !counts(c)) {
            continue;
        }
        const BsdfEval e = eval_closure(c, bsdf.wo, wi);
        sum.f_cos += e.f_cos;
        if ((glm::dot(c.n, wi) > 0.0f) == in_front) {
            sum.pdf += c.sample_weight * e.pdf;
        }
    }
    sum.pdf = bsdf.total_sample_weight > 0.0f ? sum.pdf / bsdf.total_sample_weight : 0.0f;
    return sum;
}

}  // namespace

BsdfEval eval_bsdf(const Bsdf& bsdf, const Vec3& wi) {
    if (bsdf.closures.size() == 1 && bsdf.closures[0].type == ClosureType::Diffuse) {
        BsdfEval e = eval_lambert(bsdf.closures[0], wi);
        e.pdf = glm::dot(wi, bsdf.ng) > 0.0f ? e.pdf : 0.0f;
        return e;
    }
    return eval_closures(bsdf, wi, [](const Closure&) { return true; });
}

BsdfEval eval_bsdf_seeing(const Bsdf& bsdf, const Vec3& wi, std::uint32_t visibility) {
    return eval_closures(bsdf, wi, [&](const Closure& c) {
        // Translucent lobes are diffuse here, as in Cycles.
        const std::uint8_t lobe = lobe_bits(c, glm::dot(c.n, wi) < 0.0f);
        const std::uint32_t kind = lobe & kLobeDiffuse        ? kVisibleDiffuse
                                   : lobe & kLobeTransmission ? kVisibleTransmission
                                                              : kVisibleGlossy;
        return (visibility & kind) != 0;
    });
}

std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf, float u_closure, const Vec2& u) {
    if (bsdf.closures.size() == 1 && bsdf.closures[0].type == ClosureType::Diffuse) {
        return sample_single_diffuse(bsdf, u);
    }
    const auto [chosen, u_branch] = choose_closure(bsdf, u_closure);
    if (chosen == nullptr) {
        return std::nullopt;
    }
    if (is_delta(*chosen)) {
        return sample_delta(
            *chosen, bsdf, chosen->sample_weight / bsdf.total_sample_weight, u_branch);
    }
    const std::optional<Vec3> wi = sample_direction(*chosen, bsdf.wo, u_branch, u);
    if (!wi) {
        return std::nullopt;
    }
    // The lobe must send the direction to the same side of the shading and the geometric surface.
    const bool above = glm::dot(chosen->n, *wi) > 0.0f;
    const bool transmits = chosen->type == ClosureType::Translucent ||
                           chosen->type == ClosureType::GgxRefraction ||
                           (chosen->type == ClosureType::GgxGlass && !above);
    if (above == transmits || above != (glm::dot(*wi, bsdf.ng) > 0.0f)) {
        return std::nullopt;
    }
    const BsdfEval e = eval_bsdf(bsdf, *wi);
    if (!(e.pdf > 0.0f)) {
        return std::nullopt;
    }
    BsdfSample s;
    s.f_cos = e.f_cos;
    s.wi = *wi;
    s.pdf = e.pdf;
    s.lobe = lobe_bits(*chosen, transmits);
    s.eta = transmits && chosen->type != ClosureType::Translucent ? chosen->eta : 1.0f;
    s.roughness = lobe_roughness(*chosen);
    return s;
}

bool chooses_delta(const Bsdf& bsdf, float u_closure) {
    const Closure* chosen = choose_closure(bsdf, u_closure).closure;
    return chosen != nullptr && is_delta(*chosen);
}

std::uint8_t guided_lobe(const Bsdf& bsdf, float u_closure, const Vec3& wi) {
    const bool transmitted = glm::dot(wi, bsdf.ng) < 0.0f;
    const Closure* chosen = choose_closure(bsdf, u_closure).closure;
    if (chosen == nullptr || is_delta(*chosen)) {
        return transmitted ? kLobeDiffuse | kLobeTransmission : kLobeDiffuse;
    }
    const std::uint8_t kind = lobe_bits(*chosen, false) & (kLobeDiffuse | kLobeGlossy);
    return static_cast<std::uint8_t>(transmitted ? kind | kLobeTransmission : kind);
}

BsdfTraits bsdf_traits(const Bsdf& bsdf) {
    BsdfTraits traits;
    if (bsdf.closures.size() == 1 && bsdf.closures[0].type == ClosureType::Diffuse) {
        traits.albedo = bsdf.closures[0].weight;
        return traits;
    }
    float delta = 0.0f;
    float smooth = 0.0f;
    float transmitted = 0.0f;
    for (const Closure& c : bsdf.closures) {
        traits.albedo += albedo_from_sample_weight(c, bsdf.wo);
        if (is_delta(c)) {
            delta += c.sample_weight;
            continue;
        }
        smooth += c.sample_weight;
        if (c.type == ClosureType::GgxGlass) {
            transmitted +=
                c.sample_weight * (1.0f - fresnel_dielectric(glm::dot(c.n, bsdf.wo), c.eta));
        } else if (c.type == ClosureType::Translucent || c.type == ClosureType::GgxRefraction) {
            transmitted += c.sample_weight;
        }
        if (c.type == ClosureType::GgxReflection || c.type == ClosureType::GgxGlass) {
            traits.min_alpha = std::min(traits.min_alpha, std::min(c.alpha_x, c.alpha_y));
        } else if (c.type == ClosureType::Clearcoat) {
            traits.min_alpha = std::min(traits.min_alpha, c.alpha_x);
        }
    }
    traits.delta_probability =
        bsdf.total_sample_weight > 0.0f ? delta / bsdf.total_sample_weight : 0.0f;
    traits.transmission_probability = smooth > 0.0f ? transmitted / smooth : 0.0f;
    return traits;
}

}  // namespace pharos
