// The scattering contract: consistency, reciprocity, delta lobes, energy, robustness.
#include "materials/bsdf.h"

#include <gtest/gtest.h>

#include "core/color.h"
#include "core/visibility.h"
#include "materials/closure_albedo.h"
#include "materials/lobes/ggx.h"
#include "native/materials/closure_cases.h"

namespace pharos::test {
namespace {

const Vec3 kZ(0, 0, 1);

TEST(Bsdf, LambertIsAlbedoTimesCosineOverPi) {
    Surface surface;
    ScatterInputs in;
    in.color = Rgb(0.8f, 0.5f, 0.1f);
    in.normal = kZ;
    const Bsdf& bsdf = build(surface, make_context(direction_at(0.5f), 405), [&](auto& c, auto& s) {
        setup_diffuse(in, c, s);
    });
    const Vec3 wi = direction_at(0.3f, 2.0f);
    const BsdfEval e = eval_bsdf(bsdf, wi);
    EXPECT_NEAR(e.f_cos.x, 0.8f * 0.3f * kInvPi, 1e-6f);
    EXPECT_NEAR(e.pdf, 0.3f * kInvPi, 1e-6f);
    EXPECT_EQ(eval_bsdf(bsdf, -wi).pdf, 0.0f);
    EXPECT_EQ(bsdf_traits(bsdf).albedo, in.color);
}

TEST(Bsdf, SampleReportsWhatEvalReports) {
    Random random(3);
    for (const LobeCase& lobe : lobe_cases()) {
        for (int i = 0; i < 40; ++i) {
            Surface surface;
            const auto ctx = make_context(random.direction_above(kZ), i % 2 == 0 ? 304 : 405);
            const Bsdf& bsdf = build(surface, ctx, lobe.make(random, 0.05f));
            for (int k = 0; k < 50; ++k) {
                const float u = random.uniform();
                const auto s = sample_bsdf(bsdf, u, random.uniform2());
                if (!s || (s->lobe & kLobeDelta) != 0) {
                    continue;
                }
                const BsdfEval e = eval_bsdf(bsdf, s->wi);
                ASSERT_NEAR(s->pdf, e.pdf, 1e-5f * e.pdf) << lobe.name;
                ASSERT_NEAR(s->f_cos.x, e.f_cos.x, 1e-5f * e.f_cos.x + 1e-20f) << lobe.name;
                ASSERT_NEAR(glm::length(s->wi), 1.0f, 1e-5f);
                ASSERT_EQ((s->lobe & kLobeTransmission) != 0, s->wi.z < 0.0f);
                ASSERT_GT(s->roughness, 0.0f);
            }
        }
    }
}

// Mean of f cos / pdf over samples is the integral of f cos, found here by another way.
TEST(Bsdf, WeightsAverageToTheAlbedo) {
    Random random(9);
    for (const LobeCase& lobe : lobe_cases()) {
        for (int i = 0; i < 3; ++i) {
            Surface surface;
            const auto ctx =
                make_context(direction_at(random.uniform(0.2f, 1.0f)), i == 0 ? 304 : 405);
            const Bsdf& bsdf = build(surface, ctx, lobe.make(random, 0.4f));
            const AlbedoEstimate sampled = sampled_albedo(bsdf, 40000, random.bits());
            // Uniform directions, stratified.
            constexpr int kSide = 500;
            double sum = 0.0;
            for (int y = 0; y < kSide; ++y) {
                for (int x = 0; x < kSide; ++x) {
                    const Vec2 u = (Vec2(x, y) + random.uniform2()) / static_cast<float>(kSide);
                    const Vec3 wi = sample_uniform_sphere(u);
                    // Directions that sampling rejects do not count.
                    if (eval_bsdf(bsdf, wi).pdf > 0.0f) {
                        sum += static_cast<double>(eval_bsdf(bsdf, wi).f_cos.x);
                    }
                }
            }
            const float integral =
                static_cast<float>(sum * 4.0 * std::numbers::pi / (kSide * kSide));
            EXPECT_NEAR(sampled.mean.x, integral, 5.0f * sampled.error + 0.004f * integral)
                << lobe.name << " #" << i;
        }
    }
}

Closure ggx_closure(ClosureType type, float alpha_x, float alpha_y) {
    Closure c;
    c.type = type;
    c.weight = Rgb(1.0f);
    c.sample_weight = 1.0f;
    c.n = kZ;
    c.tangent = Vec3(1, 0, 0);
    c.alpha_x = alpha_x;
    c.alpha_y = alpha_y;
    return c;
}

Bsdf single(const Closure& c, const Vec3& wo) {
    return {std::span<const Closure>(&c, 1), wo, kZ, c.sample_weight};
}

TEST(Bsdf, ReflectionIsReciprocal) {
    Random random(21);
    for (int i = 0; i < 5000; ++i) {
        Closure c = ggx_closure(
            ClosureType::GgxReflection, random.uniform(0.05f, 1.0f), random.uniform(0.05f, 1.0f));
        if (i % 3 == 1) {
            c.alpha_y = c.alpha_x;
        } else if (i % 3 == 2) {
            c.type = i % 2 == 0 ? ClosureType::OrenNayar : ClosureType::DisneyDiffuse;
            c.parameter = random.uniform();
        }
        c.smith = i % 3 == 2 ? 0 : static_cast<std::uint8_t>(i & 1);
        c.fresnel = FresnelType::GeneralizedSchlick;
        c.f0 = Rgb(c.type == ClosureType::OrenNayar ? 0.0f : 0.1f);
        c.eta = 1.4f;
        const Vec3 a = direction_at(random.uniform(0.02f, 1.0f), random.uniform(0, 6));
        const Vec3 b = direction_at(random.uniform(0.02f, 1.0f), random.uniform(0, 6));
        const float ab = eval_bsdf(single(c, a), b).f_cos.x / b.z;
        const float ba = eval_bsdf(single(c, b), a).f_cos.x / a.z;
        ASSERT_NEAR(ab, ba, 2e-4f * ab + 1e-7f) << i;
    }
}

TEST(Bsdf, RefractionIsReciprocalUpToTheSolidAngleFactor) {
    Random random(22);
    int compared = 0;
    for (int i = 0; i < 5000; ++i) {
        Closure c = ggx_closure(ClosureType::GgxGlass, 0.3f, 0.3f);
        c.fresnel = FresnelType::Dielectric;
        c.eta = i % 2 == 0 ? 1.5f : 1.0f / 1.7f;
        Closure back = c;
        back.eta = 1.0f / c.eta;
        const Vec3 a = direction_at(random.uniform(0.1f, 1.0f), random.uniform(0, 6));
        const Vec3 b = -direction_at(random.uniform(0.1f, 1.0f), random.uniform(0, 6));
        // The same interface from below: the frame turned over.
        const float ab = eval_bsdf(single(c, a), b).f_cos.x / std::abs(b.z);
        const float ba = eval_bsdf(single(back, -b), -a).f_cos.x / a.z;
        if (ab > 1e-4f) {
            ++compared;
            ASSERT_NEAR(ab / (c.eta * c.eta), ba, 5e-4f * ba + 2e-6f) << i;
        }
    }
    EXPECT_GT(compared, 1000);
}

TEST(Bsdf, SmoothGlassSplitsByFresnel) {
    Surface surface;
    ScatterInputs in;
    in.color = Rgb(1.0f);
    in.ior = 1.5f;
    in.normal = kZ;
    for (const std::uint32_t version : {304u, 405u}) {
        const Bsdf& bsdf = build(
            surface, make_context(kZ, version), [&](auto& c, auto& s) { setup_glass(in, c, s); });
        EXPECT_FLOAT_EQ(bsdf_traits(bsdf).delta_probability, 1.0f);
        EXPECT_EQ(eval_bsdf(bsdf, kZ).pdf, 0.0f);
        float reflected = 0.0f;
        for (int i = 0; i < 1000; ++i) {
            const auto s = sample_bsdf(bsdf, (static_cast<float>(i) + 0.5f) / 1000.0f, Vec2(0.5f));
            ASSERT_TRUE(s.has_value());
            ASSERT_NEAR(s->f_cos.x / s->pdf, 1.0f, 1e-4f);
            const bool through = (s->lobe & kLobeTransmission) != 0;
            ASSERT_NEAR(s->wi.z, through ? -1.0f : 1.0f, 1e-6f);
            ASSERT_FLOAT_EQ(s->eta, through ? 1.5f : 1.0f);
            reflected += through ? 0.0f : 1e-3f;
        }
        EXPECT_NEAR(reflected, 0.04f, 1.1e-3f);
    }
}

// A slab of index 1.5 at normal incidence lets through (1 - R) / (1 + R) = 12/13.
TEST(Bsdf, DielectricSlabTransmits) {
    ScatterInputs in;
    in.color = Rgb(1.0f);
    in.ior = 1.5f;
    in.normal = kZ;
    const auto setup = [&](const ClosureSetupContext& c, ClosureSink& s) { setup_glass(in, c, s); };
    Surface outside;
    Surface inside;
    ClosureSetupContext from_inside = make_context(kZ, 405);
    from_inside.front_face = false;
    build(outside, make_context(kZ, 405), setup);
    build(inside, from_inside, setup);
    Random random(4);
    double transmitted = 0.0;
    constexpr int kPaths = 400000;
    for (int i = 0; i < kPaths; ++i) {
        double beta = 1.0;
        bool within = false;
        bool upper = true;  // which face is met
        for (int bounce = 0; bounce < 60; ++bounce) {
            const auto s = sample_bsdf(
                within ? inside.bsdf : outside.bsdf, random.uniform(), random.uniform2());
            ASSERT_TRUE(s.has_value());
            beta *= static_cast<double>(s->f_cos.x / s->pdf);
            const bool through = (s->lobe & kLobeTransmission) != 0;
            if (!within && !through) {
                break;
            }
            if (within && through) {
                transmitted += upper ? 0.0 : beta;
                break;
            }
            within = true;
            upper = !upper;
        }
    }
    EXPECT_NEAR(transmitted / kPaths, 12.0 / 13.0, 1.3e-3);
}

TEST(Bsdf, TransparentGoesStraightOnAndMerges) {
    Surface surface;
    ScatterInputs in;
    in.color = Rgb(0.25f, 0.5f, 1.0f);
    in.weight = Rgb(0.5f);
    const Vec3 wo = direction_at(0.4f);
    const Bsdf& bsdf = build(surface, make_context(wo, 304), [&](auto& c, auto& s) {
        setup_transparent(in, c, s);
        setup_transparent(in, c, s);
    });
    ASSERT_EQ(bsdf.closures.size(), 1u);
    const auto s = sample_bsdf(bsdf, 0.3f, Vec2(0.2f, 0.9f));
    ASSERT_TRUE(s.has_value());
    EXPECT_EQ(s->wi, -wo);
    EXPECT_EQ(s->lobe, kLobeDelta | kLobeTransparent);
    EXPECT_NEAR(s->f_cos.y / s->pdf, 0.5f, 1e-6f);
}

// One glossy lobe: no weight above one, or above 1 / E where compensated.
TEST(Bsdf, WeightsAreBounded) {
    Random random(31);
    for (int i = 0; i < 4000; ++i) {
        Surface surface;
        ScatterInputs in = random_scatter(random, 0.0f, Distribution::Ggx);
        in.color = Rgb(1.0f);
        const auto ctx = make_context(random.direction_above(kZ), 405);
        in.normal = ctx.ns;
        const int kind = i % 3;
        in.roughness = kind == 0 ? 0.0f : in.roughness;  // Oren-Nayar peaks in retro-reflection
        const Bsdf& bsdf = build(surface, ctx, [&](auto& c, auto& s) {
            (kind == 0 ? setup_diffuse : kind == 1 ? setup_glossy : setup_glass)(in, c, s);
        });
        for (int k = 0; k < 50; ++k) {
            const float u = random.uniform();
            const auto s = sample_bsdf(bsdf, u, random.uniform2());
            if (s) {
                ASSERT_LE(s->f_cos.x, 1.05f * s->pdf)
                    << "kind " << kind << " roughness " << in.roughness;
            }
        }
    }
}

TEST(Bsdf, SamplesStayOnTheGeometricSide) {
    Random random(41);
    for (const LobeCase& lobe : lobe_cases()) {
        for (int i = 0; i < 40; ++i) {
            ClosureSetupContext ctx = make_context(random.direction_above(kZ), 405);
            ctx.ns = glm::normalize(kZ + 0.6f * random.direction());
            Surface surface;
            const Bsdf& bsdf = build(surface, ctx, lobe.make(random, 0.0f));
            for (int k = 0; k < 30; ++k) {
                const float u = random.uniform();
                const auto s = sample_bsdf(bsdf, u, random.uniform2());
                if (s && (s->lobe & kLobeTransparent) == 0) {
                    ASSERT_EQ(s->wi.z < 0.0f, (s->lobe & kLobeTransmission) != 0) << lobe.name;
                }
            }
        }
    }
}

TEST(Bsdf, TraitsSeeDeltaTransmissionAndAlpha) {
    Surface surface;
    const Bsdf& bsdf = build(surface, make_context(kZ, 405), [&](auto& c, auto& s) {
        ScatterInputs in;
        in.normal = kZ;
        in.color = Rgb(1.0f);
        in.weight = Rgb(0.5f);
        setup_translucent(in, c, s);
        in.weight = Rgb(0.25f);
        in.roughness = 0.5f;
        setup_glossy(in, c, s);
        in.roughness = 0.0f;
        setup_glossy(in, c, s);
    });
    const BsdfTraits traits = bsdf_traits(bsdf);
    EXPECT_NEAR(traits.delta_probability, 0.25f, 0.01f);
    EXPECT_NEAR(traits.transmission_probability, 0.5f / 0.75f, 0.02f);
    EXPECT_FLOAT_EQ(traits.min_alpha, 0.25f);
    EXPECT_NEAR(traits.albedo.x, 1.0f, 0.03f);
}

// A light that some rays do not see is seen by the lobes of the others alone.
TEST(Bsdf, LobesAreTakenByWhatTheySee) {
    Surface surface;
    const Bsdf& bsdf = build(surface, make_context(kZ, 405), [&](auto& c, auto& s) {
        ScatterInputs in;
        in.normal = kZ;
        in.roughness = 0.5f;
        in.weight = Rgb(0.3f);
        setup_diffuse(in, c, s);
        setup_glossy(in, c, s);
        setup_translucent(in, c, s);
        setup_refraction(in, c, s);
    });
    Random random(11);
    for (int i = 0; i < 200; ++i) {
        const Vec3 wi = random.direction();
        const BsdfEval all = eval_bsdf(bsdf, wi);
        const BsdfEval diffuse = eval_bsdf_seeing(bsdf, wi, kVisibleDiffuse);
        const BsdfEval glossy = eval_bsdf_seeing(bsdf, wi, kVisibleGlossy);
        const BsdfEval refracted = eval_bsdf_seeing(bsdf, wi, kVisibleTransmission);
        const float sum = diffuse.f_cos.x + glossy.f_cos.x + refracted.f_cos.x;
        EXPECT_NEAR(sum, all.f_cos.x, 1e-5f * all.f_cos.x);
        EXPECT_NEAR(diffuse.pdf + glossy.pdf + refracted.pdf, all.pdf, 1e-5f * all.pdf);
        EXPECT_EQ(wi.z < 0.0f ? glossy.f_cos.x : refracted.f_cos.x, 0.0f);
        EXPECT_TRUE(is_zero(eval_bsdf_seeing(bsdf, wi, kVisibleCamera).f_cos));
    }
}

}  // namespace
}  // namespace pharos::test
