// White furnace: directional albedos against what both Blender versions render
// (shared facts, cycles-parity: plane under a world of strength 1; angles 0, 60 and 85 degrees).
#include <gtest/gtest.h>

#include "materials/energy.h"
#include "native/materials/closure_cases.h"

namespace pharos::test {
namespace {

constexpr std::array<float, 4> kRoughness{0.1f, 0.3f, 0.6f, 1.0f};
constexpr std::array<float, 3> kDegrees{0.0f, 60.0f, 85.0f};
using Table = std::array<std::array<float, 3>, 4>;

// Albedo of what `setup` builds for a view at this angle, over an even sequence of random numbers.
float furnace(const SurfaceSetup& setup, float degrees, std::uint32_t version) {
    const float theta = degrees * kPi / 180.0f;
    const Vec3 wo(std::sin(theta), 0.0f, std::cos(theta));
    Surface surface;
    const Bsdf& bsdf = build(surface, make_context(wo, version), setup);
    // Additive recurrence by powers of the root of x^4 = x + 1 (Roberts 2018).
    constexpr int kCount = 60000;
    double sum = 0.0;
    for (int i = 1; i <= kCount; ++i) {
        const glm::dvec3 p =
            glm::fract(static_cast<double>(i) *
                       glm::dvec3(0.8191725133961645, 0.6710436067037893, 0.5497004779019703));
        const auto s = sample_bsdf(
            bsdf, static_cast<float>(p.x) * kOneMinusEpsilon, Vec2(p.y, p.z) * kOneMinusEpsilon);
        sum += s ? static_cast<double>(s->f_cos.x) / static_cast<double>(s->pdf) : 0.0;
    }
    return static_cast<float>(sum / kCount);
}

void expect_table(const std::function<SurfaceSetup(float roughness)>& make,
                  std::uint32_t version,
                  const Table& expected,
                  float tolerance) {
    for (std::size_t r = 0; r < kRoughness.size(); ++r) {
        for (std::size_t a = 0; a < kDegrees.size(); ++a) {
            const float albedo = furnace(make(kRoughness[r]), kDegrees[a], version);
            EXPECT_NEAR(albedo, expected[r][a], tolerance * std::max(expected[r][a], 1.0f))
                << "roughness " << kRoughness[r] << " at " << kDegrees[a];
        }
    }
}

std::function<SurfaceSetup(float)> glossy(Distribution distribution) {
    return [distribution](float roughness) -> SurfaceSetup {
        ScatterInputs in;
        in.color = Rgb(1.0f);
        in.normal = Vec3(0, 0, 1);
        in.roughness = roughness;
        in.distribution = distribution;
        return [in](const ClosureSetupContext& c, ClosureSink& s) { setup_glossy(in, c, s); };
    };
}

std::function<SurfaceSetup(float)> principled_v2(float metallic, float transmission) {
    return [=](float roughness) -> SurfaceSetup {
        PrincipledV2Inputs in;
        in.normal = in.coat_normal = Vec3(0, 0, 1);
        in.base_color = Rgb(1.0f);
        in.roughness = roughness;
        in.metallic = metallic;
        in.transmission_weight = transmission;
        return [in](const ClosureSetupContext& c, ClosureSink& s) {
            EXPECT_EQ(setup_principled_v2(in, c, s).x, 1.0f);
        };
    };
}

constexpr Table kOnes{{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}};

TEST(Furnace, SingleScatterGgx34) {
    expect_table(glossy(Distribution::Ggx),
                 304,
                 {{{.9999f, .9998f, .992f},
                   {.9907f, .975f, .875f},
                   {.8245f, .777f, .829f},
                   {.3069f, .409f, .565f}}},
                 0.002f);
}

TEST(Furnace, SingleScatterGgx45) {
    expect_table(glossy(Distribution::Ggx),
                 405,
                 {{{.9999f, .9998f, .992f},
                   {.9907f, .975f, .886f},
                   {.8245f, .782f, .893f},
                   {.3069f, .451f, .780f}}},
                 0.002f);
}

TEST(Furnace, MultiScatterGgx) {
    expect_table(glossy(Distribution::MultiGgx), 405, kOnes, 0.004f);
    expect_table(glossy(Distribution::MultiGgx), 304, kOnes, 0.004f);
}

std::function<SurfaceSetup(float)> principled_v1(PrincipledV1Inputs in) {
    in.normal = in.clearcoat_normal = Vec3(0, 0, 1);
    return [in](float roughness) -> SurfaceSetup {
        PrincipledV1Inputs rough = in;
        rough.roughness = rough.clearcoat_roughness = roughness;
        return [rough](const ClosureSetupContext& c, ClosureSink& s) {
            setup_principled_v1(rough, c, s);
        };
    };
}

TEST(Furnace, PrincipledV1Dielectric) {
    PrincipledV1Inputs in;
    in.base_color = Rgb(1.0f);
    expect_table(principled_v1(in),
                 304,
                 {{{1.02212f, 1.05956f, 1.33452f},
                   {1.03371f, 1.07608f, 1.21137f},
                   {1.04553f, 1.07219f, 1.21336f},
                   {1.04841f, 1.07774f, 1.44094f}}},
                 0.002f);
}

// 3.4 simulates the walk between microfacets; the tables are an approximation of it. (At normal
// incidence and roughness 0.3 Blender loses most of the reflection: 1.003 there is not matched.)
TEST(Furnace, PrincipledV1DielectricMultiScatter) {
    PrincipledV1Inputs in;
    in.base_color = Rgb(1.0f);
    in.distribution = Distribution::MultiGgx;
    expect_table(principled_v1(in),
                 304,
                 {{{1.016f, 1.060f, 1.338f},
                   {1.034f, 1.079f, 1.259f},
                   {1.050f, 1.086f, 1.231f},
                   {1.066f, 1.095f, 1.477f}}},
                 0.03f);
}

TEST(Furnace, PrincipledV1Sheen) {
    PrincipledV1Inputs in;
    in.base_color = Rgb(0.0f);
    in.specular = 0.0f;
    in.sheen = 1.0f;
    in.sheen_tint = 0.0f;
    const std::array<float, 3> sheen{0.00026f, 0.01558f, 0.06865f};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(furnace(principled_v1(in)(0.5f), kDegrees[i], 304), sheen[i], 3e-4f);
    }
}

// Against a sun in Blender 3.4.1 (its furnace of this lobe is off, because its sampling density
// there is not the one it samples).
TEST(Furnace, PrincipledV1ClearcoatUnderASun) {
    struct Case {
        float roughness, view, light, radiance;
    };

    for (const Case& c : {Case{0.3f, 0, 0, 0.0202347f},
                          Case{0.3f, 60, -60, 0.0826513f},
                          Case{0.3f, 60, -40, 0.0117706f},
                          Case{0.3f, 85, -80, 0.830052f},
                          Case{1.0f, 85, -80, 0.0402493f}}) {
        PrincipledV1Inputs in;
        in.base_color = Rgb(0.0f);
        in.specular = 0.0f;
        in.clearcoat = 1.0f;
        const Vec3 wo = direction_at(std::cos(c.view * kPi / 180.0f), 0.0f);
        const Vec3 wi = direction_at(std::cos(c.light * kPi / 180.0f), kPi);
        Surface surface;
        const Bsdf& bsdf = build(surface, make_context(wo, 304), principled_v1(in)(c.roughness));
        EXPECT_NEAR(eval_bsdf(bsdf, wi).f_cos.x / c.radiance, 1.0f, 1e-4f);
    }
}

TEST(Furnace, PrincipledV2Dielectric) {
    expect_table(principled_v2(0.0f, 0.0f), 405, kOnes, 0.008f);
}

TEST(Furnace, PrincipledV2Metal) {
    expect_table(principled_v2(1.0f, 0.0f), 405, kOnes, 0.004f);
}

TEST(Furnace, PrincipledV2Glass) {
    expect_table(principled_v2(0.0f, 1.0f), 405, kOnes, 0.010f);
}

// The fitted sheen against Blender 4.5: furnace, and a sun at 60 degrees on the camera's side,
// beyond and at 75 degrees across.
TEST(Furnace, PrincipledV2Sheen) {
    struct Case {
        float roughness, cosine, albedo, towards, beyond, across;
    };

    for (const Case& c : {Case{0.3f, 0.1f, 0.434774f, 0.0324587f, 0.0278204f, 0.122879f},
                          Case{0.5f, 0.5f, 0.153873f, 0.0344758f, 0.0285324f, 0.0372864f},
                          Case{1.0f, 0.7f, 0.423166f, 0.0760727f, 0.0760792f, 0.0439328f}}) {
        PrincipledV2Inputs in;
        in.normal = in.coat_normal = Vec3(0, 0, 1);
        in.base_color = Rgb(0.0f);
        in.specular_ior_level = 0.0f;
        in.sheen_weight = 1.0f;
        in.sheen_roughness = c.roughness;
        const SurfaceSetup setup = [in](const ClosureSetupContext& ctx, ClosureSink& sink) {
            EXPECT_LT(setup_principled_v2(in, ctx, sink).x, 1.0f);
        };
        const float degrees = std::acos(c.cosine) * 180.0f / kPi;
        EXPECT_NEAR(furnace(setup, degrees, 405), c.albedo, 0.004f);
        Surface surface;
        const Vec3 wo = direction_at(c.cosine, 0.0f);
        const Bsdf& bsdf = build(surface, make_context(wo, 405), setup);
        const auto radiance = [&bsdf](float angle, float phi) {
            return eval_bsdf(bsdf, direction_at(std::cos(angle * kPi / 180.0f), phi)).f_cos.x;
        };
        EXPECT_NEAR(radiance(60.0f, 0.0f), c.towards, 0.05f * c.towards);
        EXPECT_NEAR(radiance(60.0f, kPi), c.beyond, 0.05f * c.beyond);
        EXPECT_NEAR(radiance(75.0f, 0.5f * kPi), c.across, 0.05f * c.across);
    }
}

TEST(Furnace, EnergyPreservingOrenNayar) {
    const auto make = [](float roughness) -> SurfaceSetup {
        ScatterInputs in;
        in.color = Rgb(1.0f);
        in.normal = Vec3(0, 0, 1);
        in.roughness = roughness;
        return [in](const ClosureSetupContext& c, ClosureSink& s) { setup_diffuse(in, c, s); };
    };
    expect_table(make, 405, kOnes, 0.004f);
}

TEST(Energy, TablesAreQuickAndBounded) {
    for (float rough = 0.0f; rough <= 1.0f; rough += 0.05f) {
        for (float mu = 0.0f; mu <= 1.0f; mu += 0.05f) {
            EXPECT_GT(ggx_albedo(mu, rough), 0.29f);
            EXPECT_LE(ggx_albedo(mu, rough), 1.0001f);
            for (const float eta : {1e-5f, 0.5f, 1.0f, 1.5f, 100.0f}) {
                EXPECT_GT(ggx_glass_albedo(mu, rough, eta), 0.2f);
                EXPECT_LE(ggx_glass_albedo(mu, rough, eta), 1.0001f);
                EXPECT_GE(ggx_dielectric_shape(mu, rough, eta), 0.0f);
                EXPECT_LE(ggx_dielectric_shape(mu, rough, eta), 1.0f);
            }
        }
    }
    EXPECT_NEAR(ggx_average_albedo(0.0f), 1.0f, 1e-3f);
}

}  // namespace
}  // namespace pharos::test
