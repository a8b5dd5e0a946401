#include "materials/closure_albedo.h"

#include "materials/energy.h"
#include "materials/fresnel.h"
#include "materials/lobes/diffuse.h"

namespace pharos {

namespace {

[[nodiscard]] float closure_rough(const Closure& c) {
    return std::sqrt(std::sqrt(c.alpha_x * c.alpha_y));
}

// Mean reflectance of the interface's shape over the lobe; exact for mirrors.
[[nodiscard]] float mean_shape(const Closure& c, float mu) {
    if (is_delta(c)) {
        return dielectric_shape(fresnel_dielectric(mu, c.eta), c.eta);
    }
    return ggx_dielectric_shape(mu, closure_rough(c), c.eta);
}

[[nodiscard]] Rgb mean_reflectance(const Closure& c, float mu) {
    switch (c.fresnel) {
        case FresnelType::None:
            return Rgb(1.0f);
        case FresnelType::F82Tint:
            return fresnel_f82(mu, c.f0, c.f90);
        case FresnelType::Dielectric:
            return Rgb(lerp(f0_from_eta(c.eta), 1.0f, mean_shape(c, mu)));
        case FresnelType::GeneralizedSchlick:
        case FresnelType::PrincipledV1:
            return lerp(c.f0, c.f90, mean_shape(c, mu));
        case FresnelType::ThinFilm:
            return closure_film_reflectance(c, mu);
    }
    return Rgb(1.0f);
}

[[nodiscard]] ClosureAlbedo glass_albedo(const Closure& c, float mu) {
    if (c.type == ClosureType::GgxRefraction) {
        return {Rgb(0.0f), c.weight * c.transmission_tint};
    }
    if (c.fresnel == FresnelType::ThinFilm) {
        const FresnelSplit split = closure_fresnel_split(c, mu);
        return {c.weight * split.reflected, c.weight * split.transmitted};
    }
    const float shape = mean_shape(c, mu);
    const float f = lerp(f0_from_eta(c.eta), 1.0f, shape);
    switch (c.fresnel) {
        case FresnelType::GeneralizedSchlick: {
            const Rgb r = lerp(c.f0, c.f90, shape);
            return {c.weight * r, c.weight * (Rgb(1.0f) - r) * c.transmission_tint};
        }
        case FresnelType::PrincipledV1:
            return {c.weight * f * lerp(c.f0, c.f90, shape),
                    c.weight * (1.0f - f) * c.transmission_tint};
        default:
            return {c.weight * f, c.weight * (1.0f - f) * c.transmission_tint};
    }
}

}  // namespace

ClosureAlbedo closure_albedo(const Closure& c, const Vec3& wo) {
    const float mu = saturate(glm::dot(c.n, wo));
    switch (c.type) {
        case ClosureType::Diffuse:
        case ClosureType::OrenNayar:
        case ClosureType::DisneyDiffuse:
            return {c.weight, Rgb(0.0f)};
        case ClosureType::Translucent:
        case ClosureType::Transparent:
            return {Rgb(0.0f), c.weight};
        case ClosureType::GgxReflection:
            return {c.weight * mean_reflectance(c, mu), Rgb(0.0f)};
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
            return glass_albedo(c, mu);
        case ClosureType::Clearcoat:
            return {c.weight * closure_reflectance(c, mu), Rgb(0.0f)};
        case ClosureType::Sheen:
            return {c.weight * (c.smith != 0 ? schlick_weight(mu) * mu : c.energy_scale),
                    Rgb(0.0f)};
        case ClosureType::ToonDiffuse:
        case ClosureType::ToonGlossy:
        case ClosureType::Velvet:
            return {c.weight, Rgb(0.0f)};
    }
    return {};
}

float single_scatter_share(const Closure& c, const Vec3& wo) {
    if (c.type != ClosureType::GgxReflection || c.energy_scale != 1.0f || is_delta(c)) {
        return 1.0f;
    }
    return ggx_albedo(glm::dot(c.n, wo), closure_rough(c));
}

}  // namespace pharos
