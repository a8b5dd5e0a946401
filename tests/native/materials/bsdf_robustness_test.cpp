// Extreme inputs: whatever the nodes deliver, nothing non-finite or negative comes out.
#include <gtest/gtest.h>

#include "native/materials/closure_cases.h"
#include "support/stress.h"

namespace pharos::test {
namespace {

// Mostly extremes, sometimes an ordinary number.
float wild(Random& r) {
    constexpr std::array<float, 16> kExtremes{0.0f,
                                              1e-7f,
                                              1e-5f,
                                              1e-3f,
                                              0.5f,
                                              0.9999f,
                                              1.0f,
                                              1.0001f,
                                              2.0f,
                                              100.0f,
                                              -1.0f,
                                              -1e30f,
                                              1e30f,
                                              kInfinity,
                                              -kInfinity,
                                              std::numeric_limits<float>::quiet_NaN()};
    return r.index(3) == 0 ? r.uniform() : kExtremes[r.index(16)];
}

Rgb wild_color(Random& r) {
    return Rgb(wild(r), wild(r), wild(r));
}

Vec3 wild_normal(Random& r, const Vec3& ns) {
    switch (r.index(6)) {
        case 0:
            return r.direction();
        case 1:
            return wild_color(r);
        case 2:
            return Vec3(0.0f);
        case 3:
            return glm::normalize(ns + 0.3f * r.direction());
        default:
            return ns;
    }
}

// Grazing, straight or ordinary, above the geometric surface.
Vec3 wild_direction(Random& r) {
    constexpr std::array<float, 6> kCosines{1e-7f, 1e-5f, 1e-3f, 0.1f, 0.999999f, 1.0f};
    const float c = r.index(2) == 0 ? kCosines[r.index(6)] : r.uniform(1e-3f, 1.0f);
    return glm::normalize(direction_at(c, r.uniform(0.0f, 6.28f)));
}

ClosureSetupContext wild_context(Random& r) {
    constexpr std::array<std::uint32_t, 4> kVersions{304, 306, 402, 405};
    ClosureSetupContext ctx = make_context(wild_direction(r), kVersions[r.index(4)]);
    ctx.front_face = r.index(2) == 0;
    if (r.index(3) == 0) {
        ctx.ns = glm::normalize(ctx.ng + 0.9f * r.direction());
    }
    if (r.index(4) == 0) {
        ctx.tangent = r.index(2) == 0 ? ctx.ns : Vec3(0.0f);
    }
    return ctx;
}

PrincipledV1Inputs wild_v1(Random& r, const Vec3& ns) {
    PrincipledV1Inputs in;
    in.weight = r.index(3) == 0 ? wild_color(r) : Rgb(1.0f);
    in.base_color = wild_color(r);
    in.subsurface = wild(r);
    in.subsurface_color = wild_color(r);
    in.metallic = wild(r);
    in.specular = wild(r);
    in.specular_tint = wild(r);
    in.roughness = wild(r);
    in.anisotropic = wild(r);
    in.anisotropic_rotation = wild(r);
    in.sheen = wild(r);
    in.sheen_tint = wild(r);
    in.clearcoat = wild(r);
    in.clearcoat_roughness = wild(r);
    in.ior = wild(r);
    in.transmission = wild(r);
    in.transmission_roughness = wild(r);
    in.normal = wild_normal(r, ns);
    in.clearcoat_normal = wild_normal(r, ns);
    in.tangent = wild_normal(r, ns);
    in.distribution = static_cast<Distribution>(r.index(5));
    return in;
}

PrincipledV2Inputs wild_v2(Random& r, const Vec3& ns) {
    PrincipledV2Inputs in;
    in.weight = r.index(3) == 0 ? wild_color(r) : Rgb(1.0f);
    in.base_color = wild_color(r);
    in.metallic = wild(r);
    in.roughness = wild(r);
    in.ior = wild(r);
    in.diffuse_roughness = wild(r);
    in.subsurface_weight = wild(r);
    in.specular_ior_level = wild(r);
    in.specular_tint = wild_color(r);
    in.anisotropic = wild(r);
    in.anisotropic_rotation = wild(r);
    in.transmission_weight = wild(r);
    in.coat_weight = wild(r);
    in.coat_roughness = wild(r);
    in.coat_ior = wild(r);
    in.coat_tint = wild_color(r);
    in.sheen_weight = wild(r);
    in.sheen_roughness = wild(r);
    in.sheen_tint = wild_color(r);
    in.alpha = wild(r);
    in.normal = wild_normal(r, ns);
    in.coat_normal = wild_normal(r, ns);
    in.tangent = wild_normal(r, ns);
    in.distribution = static_cast<Distribution>(r.index(5));
    return in;
}

void wild_setup(Random& r, const ClosureSetupContext& ctx, ClosureSink& sink) {
    using Node = void (*)(const ScatterInputs&, const ClosureSetupContext&, ClosureSink&);
    constexpr std::array<Node, 6> kNodes{setup_diffuse,
                                         setup_glossy,
                                         setup_glass,
                                         setup_refraction,
                                         setup_transparent,
                                         setup_translucent};
    const std::uint32_t kind = r.index(10);
    if (kind < 6) {
        ScatterInputs in;
        in.weight = r.index(3) == 0 ? wild_color(r) : Rgb(1.0f);
        in.color = wild_color(r);
        in.roughness = wild(r);
        in.ior = wild(r);
        in.normal = wild_normal(r, ctx.ns);
        in.distribution = static_cast<Distribution>(r.index(5));
        kNodes[kind](in, ctx, sink);
    } else if (kind < 8) {
        setup_principled_v1(wild_v1(r, ctx.ns), ctx, sink);
    } else {
        const PrincipledV2Inputs in = wild_v2(r, ctx.ns);
        const Rgb emission = setup_principled_v2(in, ctx, sink);
        ASSERT_TRUE(is_finite(emission) && std::min({emission.x, emission.y, emission.z}) >= 0.0f);
        ASSERT_EQ(emission, principled_v2_emission_weight(in, ctx));
    }
}

bool sane(const Rgb& c) {
    return is_finite(c) && c.x >= 0.0f && c.y >= 0.0f && c.z >= 0.0f;
}

TEST(Robustness, MillionExtremeParameters) {
    Random random(1234);
    std::uint64_t sampled = 0;
    const std::uint64_t tries = testing::case_count(1000000, 10000000);
    for (std::uint64_t i = 0; i < tries; ++i) {
        const std::uint64_t seed = random.bits();
        Random r(seed);
        const ClosureSetupContext ctx = wild_context(r);
        Surface surface;
        const Bsdf& bsdf =
            build(surface, ctx, [&r](const auto& c, ClosureSink& sink) { wild_setup(r, c, sink); });
        ASSERT_TRUE(std::isfinite(bsdf.total_sample_weight)) << seed;
        const BsdfTraits traits = bsdf_traits(bsdf);
        ASSERT_TRUE(sane(traits.albedo) && traits.min_alpha >= 0.0f) << seed;
        ASSERT_TRUE(traits.delta_probability >= 0.0f && traits.delta_probability <= 1.0001f)
            << seed;
        ASSERT_TRUE(traits.transmission_probability >= 0.0f &&
                    traits.transmission_probability <= 1.0001f)
            << seed;
        const Vec3 wi = r.index(2) == 0 ? wild_direction(r) : r.direction();
        const BsdfEval e = eval_bsdf(bsdf, wi);
        ASSERT_TRUE(sane(e.f_cos) && std::isfinite(e.pdf) && e.pdf >= 0.0f) << seed;
        const float u = r.index(8) == 0 ? kOneMinusEpsilon : r.uniform();
        const Vec2 u2 = r.index(8) == 0 ? Vec2(0.0f, kOneMinusEpsilon) : r.uniform2();
        const auto s = sample_bsdf(bsdf, u, u2);
        if (s) {
            ++sampled;
            ASSERT_TRUE(sane(s->f_cos) && s->pdf > 0.0f && std::isfinite(s->pdf)) << seed;
            ASSERT_NEAR(length_squared(s->wi), 1.0f, 1e-4f) << seed;
            ASSERT_TRUE(sane(s->f_cos / s->pdf)) << seed;
        }
    }
    EXPECT_GT(sampled, tries / 2);
    testing::say_stress("materials: not finite, negative or over 1 in sum", tries, 0.0, 0.0);
}

// Their half vector is rounding alone, and lay below wo's horizon: the density was negative. One in
// some million of the extreme parameters met it.
TEST(Robustness, ClearcoatOfOppositeGrazingDirections) {
    Surface surface;
    const Vec3 wo = glm::normalize(Vec3(0.00495833f, 0.999988f, 1e-5f));
    const auto ctx = make_context(wo, 304);
    const Bsdf& bsdf = build(surface, ctx, [](const auto& c, ClosureSink& sink) {
        PrincipledV1Inputs in;
        in.weight = Rgb(1.0f);
        in.clearcoat = 1.0f;
        in.clearcoat_roughness = 1.0f;
        in.normal = in.clearcoat_normal = Vec3(0, 0, 1);
        setup_principled_v1(in, c, sink);
    });
    Random r(1);
    for (int i = 0; i < 100000; ++i) {
        const Vec3 opposite(-wo.x + r.uniform(-2e-4f, 2e-4f), -wo.y, r.uniform(0.0f, 1e-6f));
        const BsdfEval e = eval_bsdf(bsdf, glm::normalize(opposite));
        ASSERT_TRUE(sane(e.f_cos) && std::isfinite(e.pdf) && e.pdf >= 0.0f) << i;
    }
}

TEST(Robustness, FullSinkDropsTheLeastImportant) {
    Surface surface;
    const auto ctx = make_context(Vec3(0, 0, 1), 405);
    const Bsdf& bsdf = build(surface, ctx, [](const auto& c, ClosureSink& sink) {
        for (int i = 1; i <= kMaxClosures + 3; ++i) {
            ScatterInputs in;
            in.normal = Vec3(0, 0, 1);
            in.color = Rgb(static_cast<float>(i));
            setup_diffuse(in, c, sink);
        }
    });
    EXPECT_EQ(bsdf.closures.size(), static_cast<std::size_t>(kMaxClosures));
    EXPECT_EQ(surface.dropped, 3u);
    for (const Closure& c : bsdf.closures) {
        EXPECT_GE(c.weight.x, 4.0f);
    }
}

TEST(Robustness, NormalFixKeepsTheMirrorDirectionAbove) {
    Random random(6);
    const Vec3 ng(0, 0, 1);
    for (int i = 0; i < 100000; ++i) {
        const Vec3 wo = wild_direction(random);
        const Vec3 n = random.direction_above(ng);
        const Vec3 fixed = ensure_valid_reflection(ng, wo, n);
        ASSERT_NEAR(glm::length(fixed), 1.0f, 1e-5f);
        const Vec3 mirrored = fixed * (2.0f * glm::dot(fixed, wo)) - wo;
        const float threshold = std::min(0.9f * wo.z, 0.01f);
        ASSERT_GE(mirrored.z, threshold - 2e-6f);
        if (fixed != n) {
            // In the plane of ng and n, just as far as needed.
            ASSERT_NEAR(mirrored.z, threshold, 2e-6f);
            ASSERT_NEAR(glm::dot(fixed, glm::cross(ng, n)), 0.0f, 1e-6f);
        }
    }
}

}  // namespace
}  // namespace pharos::test
