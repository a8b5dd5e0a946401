#include "integrator/light_split.h"

#include "materials/closure_albedo.h"

namespace pharos {

namespace {

enum class LobeClass : std::uint8_t { Diffuse, Glossy };  // what is neither, transmits

[[nodiscard]] bool is_wanted(const RenderContext& context) {
    return context.passes.wants_any(kLightPasses);
}

[[nodiscard]] LobeClass lobe_class(ClosureType type) {
    switch (type) {
        case ClosureType::GgxReflection:
        case ClosureType::GgxRefraction:
        case ClosureType::GgxGlass:
        case ClosureType::Clearcoat:
        case ClosureType::ToonGlossy:
        case ClosureType::Velvet:
            return LobeClass::Glossy;
        default:
            return LobeClass::Diffuse;
    }
}

void add_to(const RenderContext& context,
            FilmPass pass,
            std::uint32_t root,
            const Rgb& value,
            PathBatch& batch) {
    if (!context.passes.wants(pass) || !is_finite(value)) {
        return;
    }
    float* out = &batch.root_passes[std::size_t{root} * context.passes.sample_size() +
                                    context.passes.offset(pass)];
    for (int c = 0; c < 3; ++c) {
        out[c] += value[c];
    }
}

void add_colors(const RenderContext& context, std::size_t s, PathBatch& batch) {
    const std::uint32_t path = batch.surface_path[s];
    Rgb diffuse(0.0f);
    ClosureAlbedo glossy;
    for (const Closure& closure : batch.bsdfs[s].closures) {
        if (closure.type == ClosureType::Transparent) {
            continue;
        }
        const ClosureAlbedo albedo = closure_albedo(closure, batch.bsdfs[s].wo);
        if (lobe_class(closure.type) == LobeClass::Diffuse) {
            diffuse += albedo.reflected + albedo.transmitted;
        } else {
            glossy.reflected += albedo.reflected;
            glossy.transmitted += albedo.transmitted;
        }
    }
    const Rgb& beta = batch.beta[path];
    const std::uint32_t root = batch.root[path];
    add_to(context, FilmPass::DiffuseColor, root, beta * diffuse, batch);
    add_to(context, FilmPass::GlossyColor, root, beta * glossy.reflected, batch);
    add_to(context, FilmPass::TransmissionColor, root, beta * glossy.transmitted, batch);
}

}  // namespace

LightSplit::Shares LightSplit::shares_at(const Bsdf& bsdf, const Vec3& wi) {
    Rgb sum(0.0f);
    Shares shares;
    for (const Closure& closure : bsdf.closures) {
        const Bsdf one{std::span(&closure, 1), bsdf.wo, bsdf.ng, closure.sample_weight};
        const Rgb f = closure.sample_weight > 0.0f ? eval_bsdf(one, wi).f_cos : Rgb(0.0f);
        sum += f;
        if (lobe_class(closure.type) == LobeClass::Diffuse) {
            shares.diffuse += f;
        } else if (glm::dot(bsdf.ng, wi) > 0.0f) {
            shares.glossy += f;
        }
    }
    shares.diffuse = divide_or_zero(shares.diffuse, sum);
    shares.glossy = divide_or_zero(shares.glossy, sum);
    shares.known = true;
    return shares;
}

// What was added to a path since the last look.
Rgb LightSplit::take(std::uint32_t path, const PathBatch& batch) {
    const Rgb light = batch.radiance[path] - seen_[path];
    seen_[path] = batch.radiance[path];
    return light;
}

void LightSplit::add(const RenderContext& context,
                     std::uint32_t root,
                     const Shares& shares,
                     const Rgb& light,
                     bool direct,
                     PathBatch& batch) {
    if (is_zero(light) || !shares.known) {
        return;
    }
    const Rgb transmitted = Rgb(1.0f) - shares.diffuse - shares.glossy;
    const auto part = [&](FilmPass of_direct, FilmPass of_indirect, const Rgb& share) {
        add_to(context, direct ? of_direct : of_indirect, root, light * share, batch);
    };
    part(FilmPass::DiffuseDirect, FilmPass::DiffuseIndirect, shares.diffuse);
    part(FilmPass::GlossyDirect, FilmPass::GlossyIndirect, shares.glossy);
    part(FilmPass::TransmissionDirect, FilmPass::TransmissionIndirect, transmitted);
}

void LightSplit::begin(const RenderContext& context, const PathBatch& batch) {
    if (is_wanted(context)) {
        seen_.assign(batch.capacity, Rgb(0.0f));
        scattered_.assign(batch.roots, Shares{});
        towards_light_.assign(batch.roots, Shares{});
    }
}

void LightSplit::take_hits(const RenderContext& context, PathBatch& batch) {
    if (!is_wanted(context)) {
        return;
    }
    for (const std::uint32_t path : batch.active) {
        const Rgb light = take(path, batch);
        if (!batch.counters[path].from_camera) {
            const std::uint32_t root = batch.root[path];
            const bool direct = batch.counters[path].bounce == 1;
            add(context, root, scattered_[root], light, direct, batch);
        }
    }
    for (std::size_t s = 0; s < batch.surfaces.size(); ++s) {
        if (batch.counters[batch.surface_path[s]].from_camera) {
            add_colors(context, s, batch);
        }
    }
}

void LightSplit::before_shadow_rays(const RenderContext& context, const PathBatch& batch) {
    if (!is_wanted(context)) {
        return;
    }
    // Shadow rays stand in the order of their surfaces, one each at the most.
    std::size_t s = 0;
    for (std::size_t i = 0; i < batch.shadow_rays.size(); ++i) {
        const std::uint32_t path = batch.shadow_rays[i].path;
        while (batch.surface_path[s] != path) {
            ++s;
        }
        if (batch.counters[path].from_camera) {
            towards_light_[batch.root[path]] =
                shares_at(batch.bsdfs[s], batch.shadow_queries[i].direction);
        }
    }
}

void LightSplit::after_shadow_rays(const RenderContext& context, PathBatch& batch) {
    if (!is_wanted(context)) {
        return;
    }
    for (const std::uint32_t path : batch.surface_path) {
        const Rgb light = take(path, batch);
        const std::uint32_t root = batch.root[path];
        const bool direct = batch.counters[path].from_camera;
        add(context, root, direct ? towards_light_[root] : scattered_[root], light, direct, batch);
    }
}

void LightSplit::take_directions(const RenderContext& context, const PathBatch& batch) {
    if (!is_wanted(context)) {
        return;
    }
    // Paths that go on stand in the order of their surfaces; copies are made only later.
    std::size_t s = 0;
    for (std::size_t i = 0; i < batch.active.size(); ++i) {
        const std::uint32_t path = batch.active[i];
        seen_[path] = batch.radiance[path];
        Shares& shares = scattered_[batch.root[path]];
        if (shares.known || batch.counters[path].bounce != 1) {
            continue;
        }
        while (batch.surface_path[s] != path) {
            ++s;
        }
        const Vec3& wi = batch.rays[i].direction;
        if (batch.scatter_pdf[path] > 0.0f) {
            shares = shares_at(batch.bsdfs[s], wi);
        } else {
            shares.glossy = Rgb(glm::dot(batch.bsdfs[s].ng, wi) > 0.0f ? 1.0f : 0.0f);
            shares.known = true;
        }
    }
}

}  // namespace pharos
