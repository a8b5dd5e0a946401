// A microfacet lobe as a vMF one: it points where the material's directions go and is about as wide
// as they scatter.
#include "integrator/narrow_lobe.h"

#include <gtest/gtest.h>

#include "../materials/closure_cases.h"

namespace pharos::testing {
namespace {

using test::build;
using test::direction_at;
using test::make_context;
using test::Random;
using test::Surface;

// Mean direction of the sampled ones, and the kappa of the vMF lobe of the same mean cosine.
struct Fit {
    Vec3 axis{0.0f};
    float kappa = 0.0f;
};

Fit fit_of(const Bsdf& bsdf, std::uint8_t lobe) {
    constexpr int kDirections = 20000;
    Random random(3);
    glm::dvec3 sum(0.0);
    double count = 0.0;
    for (int i = 0; i < kDirections; ++i) {
        const float u = random.uniform();
        const auto sample = sample_bsdf(bsdf, u, random.uniform2());
        if (sample && (sample->lobe & lobe) == lobe) {
            sum += glm::dvec3(sample->wi);
            count += 1.0;
        }
    }
    const double resultant = glm::length(sum) / count;
    return {normalize_or(Vec3(sum), Vec3(0.0f)), static_cast<float>(1.0 / (1.0 - resultant))};
}

TEST(NarrowLobe, IsThatOfTheRefractedDirections) {
    for (const float roughness : {0.1f, 0.2f, 0.3f}) {
        for (const float ior : {1.2f, 1.5f, 2.0f}) {
            for (const float cosine : {0.3f, 0.7f, 1.0f}) {
                ScatterInputs in;
                in.roughness = roughness;
                in.normal = Vec3(0, 0, 1);
                in.ior = ior;
                Surface surface;
                const Bsdf& bsdf = build(
                    surface, make_context(direction_at(cosine), 450), [&](auto& ctx, auto& sink) {
                        setup_refraction(in, ctx, sink);
                    });
                const NarrowLobe lobe = narrow_lobe(bsdf.closures[0], bsdf.wo);
                const Fit fit = fit_of(bsdf, kLobeTransmission);
                EXPECT_GT(glm::dot(lobe.axis, fit.axis), 0.999f) << roughness << " " << ior;
                EXPECT_LT(lobe.kappa / fit.kappa, 1.15f) << roughness << " " << ior;
                EXPECT_GT(lobe.kappa / fit.kappa, lobe.kappa < 2e4f ? 0.45f : 0.2f)
                    << roughness << " " << ior << " " << cosine;
            }
        }
    }
}

// Reflection's was measured to be best between the width of the peak and that of peak and tails.
TEST(NarrowLobe, IsThatOfTheReflectedDirections) {
    for (const float roughness : {0.1f, 0.2f}) {
        for (const float cosine : {0.5f, 1.0f}) {
            ScatterInputs in;
            in.roughness = roughness;
            in.normal = Vec3(0, 0, 1);
            Surface surface;
            const Bsdf& bsdf = build(surface,
                                     make_context(direction_at(cosine), 450),
                                     [&](auto& ctx, auto& sink) { setup_glossy(in, ctx, sink); });
            const NarrowLobe lobe = narrow_lobe(bsdf.closures[0], bsdf.wo);
            const Fit fit = fit_of(bsdf, kLobeGlossy);
            EXPECT_GT(glm::dot(lobe.axis, fit.axis), 0.999f) << roughness << " " << cosine;
            EXPECT_LT(lobe.kappa / fit.kappa, 4.0f) << roughness << " " << cosine;
            EXPECT_GT(lobe.kappa / fit.kappa, 1.0f) << roughness << " " << cosine;
        }
    }
}

TEST(NarrowLobe, IsNoneWhereTheProductTellsNothing) {
    ScatterInputs in;
    in.normal = Vec3(0, 0, 1);
    in.roughness = 0.9f;
    Surface wide;
    const Bsdf& rough =
        build(wide, make_context(direction_at(0.8f), 450), [&](auto& ctx, auto& sink) {
            setup_glossy(in, ctx, sink);
            setup_refraction(in, ctx, sink);
            setup_translucent(in, ctx, sink);
        });
    ASSERT_EQ(rough.closures.size(), 3u);
    for (const Closure& closure : rough.closures) {
        EXPECT_EQ(narrow_lobe(closure, rough.wo).kappa, 0.0f);
    }
    // Beyond the critical angle glass reflects and a refracting lobe is none; so it is from behind.
    in.roughness = 0.1f;
    in.ior = 1.0f / 1.5f;
    Surface inside;
    const Bsdf& total =
        build(inside, make_context(direction_at(0.3f), 450), [&](auto& ctx, auto& sink) {
            setup_glass(in, ctx, sink);
            setup_refraction(in, ctx, sink);
        });
    ASSERT_EQ(total.closures.size(), 2u);
    EXPECT_GT(narrow_lobe(total.closures[0], total.wo).kappa, 0.0f);
    EXPECT_GT(narrow_lobe(total.closures[0], total.wo).axis.z, 0.0f);
    EXPECT_EQ(narrow_lobe(total.closures[1], total.wo).kappa, 0.0f);
    EXPECT_EQ(narrow_lobe(total.closures[0], -total.wo).kappa, 0.0f);
}

}  // namespace
}  // namespace pharos::testing
