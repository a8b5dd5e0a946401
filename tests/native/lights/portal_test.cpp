// Portals: closed forms of windows, densities that integrate to one and are those of the samples,
// and pictures that do not change.
#include <array>
#include <functional>

#include "lights_support.h"
#include "sampling/warps.h"

namespace pharos {
namespace {

using test::Random;

constexpr float kHeight = 1.5f;

// A window of 1 x 0.6 m above the receiver, looking down or up.
LightDescription window(float x, bool down = true) {
    LightDescription d = test::lamp_above(LightType::Area, kHeight);
    d.strength = Rgb(0.0f);
    d.is_portal = true;
    d.size_u = 1.0f;
    d.size_v = 0.6f;
    d.to_world[3].x = x;
    if (!down) {
        d.to_world[1] *= -1.0f;
        d.to_world[2] *= -1.0f;
    }
    return d;
}

// Irradiance over pi of a polygon of radiance 1 by the edges as seen from the origin (Lambert).
double window_radiance(float x) {
    const std::array<Vec3, 4> corners = {Vec3(x - 0.5f, -0.3f, kHeight),
                                         Vec3(x + 0.5f, -0.3f, kHeight),
                                         Vec3(x + 0.5f, 0.3f, kHeight),
                                         Vec3(x - 0.5f, 0.3f, kHeight)};
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec3 a = glm::normalize(glm::dvec3(corners[i]));
        const glm::dvec3 b = glm::normalize(glm::dvec3(corners[(i + 1) % 4]));
        sum += std::acos(glm::dot(a, b)) * glm::normalize(glm::cross(a, b)).z;
    }
    return std::abs(sum) / (2.0 * std::numbers::pi);
}

EnvironmentLight constant_world() {
    const Rgb white(1.0f);
    return EnvironmentLight(std::span(&white, 1), 1, 1);
}

// A sky that is twenty times brighter on one side.
Rgb uneven(const Vec3& d) {
    return Rgb(d.x > 0.0f && d.z > 0.0f ? 2.0f : 0.1f);
}

EnvironmentLight uneven_world() {
    constexpr std::uint32_t kWidth = 64;
    std::vector<Rgb> texels;
    for (std::uint32_t i = 0; i < kWidth * kWidth / 2; ++i) {
        const Vec2 uv((static_cast<float>(i % kWidth) + 0.5f) / kWidth,
                      (static_cast<float>(i / kWidth) + 0.5f) / (kWidth / 2));
        texels.push_back(uneven(equirectangular_to_direction(uv)));
    }
    return EnvironmentLight(texels, kWidth, kWidth / 2);
}

// Mean of radiance x cosine / density / pi over samples, by what arrives along each direction.
double reflected(const LightSampler& sampler,
                 const LightSampleContext& context,
                 const std::function<float(const Vec3&)>& arriving) {
    constexpr int kSide = 500;
    Random random(4);
    double sum = 0.0;
    for (int i = 0; i < kSide * kSide; ++i) {
        const Vec2 cell(static_cast<float>(i % kSide), static_cast<float>(i / kSide));
        const Vec2 u = glm::min((cell + random.uniform2()) / float{kSide}, kOneMinusEpsilon);
        const auto s = sampler.sample(context, 0.5f, u);
        if (!s) {
            continue;
        }
        EXPECT_TRUE(s->environment);
        const float again = sampler.pdf_environment(context, s->sample.wi);
        EXPECT_NEAR(again / s->sample.pdf, 1.0f, 2e-3f);
        const float cosine = std::max(glm::dot(s->sample.wi, context.n), 0.0f);
        sum += static_cast<double>(arriving(s->sample.wi) * cosine / s->sample.pdf);
    }
    return sum / kSide / kSide / std::numbers::pi;
}

bool through(const Vec3& wi, float x) {
    const Vec3 q = wi * (kHeight / wi.z);
    return wi.z > 0.0f && std::abs(q.x - x) <= 0.5f && std::abs(q.y) <= 0.3f;
}

// All samples go through the window, and bring what Lambert's formula says.
TEST(Portals, WindowOntoAWhiteSky) {
    const EnvironmentLight world = constant_world();
    for (const float x : {0.0f, 0.8f, 3.0f}) {
        const LightDescription portal = window(x);
        const LightSampler sampler = test::make_sampler(std::span(&portal, 1), 405, &world);
        int outside = 0;
        const double found = reflected(sampler, test::plane_point(), [&](const Vec3& wi) {
            const bool inside = through(wi, x);
            outside += inside ? 0 : 1;
            return inside ? 1.0f : 0.0f;
        });
        EXPECT_NEAR(found / window_radiance(x), 1.0, 2e-3) << x;
        EXPECT_LT(outside, 250) << x;  // of 250 000, on the very edge
    }
}

// Windows share the samples; one that looks away gets none.
TEST(Portals, SeveralWindows) {
    const EnvironmentLight world = constant_world();
    const std::array<LightDescription, 3> portals = {
        window(-1.0f), window(1.2f), window(4.0f, false)};
    const LightSampler sampler = test::make_sampler(portals, 405, &world);
    const double found = reflected(sampler, test::plane_point(), [&](const Vec3& wi) {
        return through(wi, -1.0f) || through(wi, 1.2f) ? 1.0f : 0.0f;
    });
    EXPECT_NEAR(found, window_radiance(-1.0f) + window_radiance(1.2f), 1e-3);
}

// What arrives besides the windows has its place as well: half of the samples look for it.
TEST(Portals, UnevenSkyKeepsItsMean) {
    const EnvironmentLight world = uneven_world();
    const std::array<LightDescription, 2> portals = {window(0.3f), window(-1.5f)};
    const LightSampler with = test::make_sampler(portals, 405, &world);
    const LightSampler without =
        test::make_sampler(std::span<const LightDescription>(), 405, &world);
    LightSampleContext tilted = test::plane_point();
    tilted.n = glm::normalize(Vec3(0.3f, -0.2f, 0.8f));
    const auto sky = [](const Vec3& wi) { return uneven(wi).x; };
    const double expected = reflected(without, tilted, sky);
    EXPECT_NEAR(reflected(with, tilted, sky) / expected, 1.0, 5e-3);
    const auto lit = [](const Vec3& wi) { return through(wi, 0.3f) ? uneven(wi).x : 0.0f; };
    const double window_alone = reflected(without, tilted, lit);
    EXPECT_NEAR(reflected(with, tilted, lit) / window_alone, 1.0, 5e-3);
}

// The density integrates to one over the sphere, wherever the receiver is.
TEST(Portals, DensityIntegratesToOne) {
    const std::array<LightDescription, 2> portals = {window(0.3f), window(-0.4f)};
    for (const EnvironmentLight& world : {constant_world(), uneven_world()}) {
        const LightSampler sampler = test::make_sampler(portals, 405, &world);
        for (const float z : {0.0f, 1.2f, 2.0f}) {
            LightSampleContext context = test::plane_point();
            context.p.z = z;
            Random random(8);
            double sum = 0.0;
            constexpr int kCount = 1 << 20;
            for (int i = 0; i < kCount; ++i) {
                const Vec3 wi = sample_uniform_sphere(random.uniform2());
                sum += static_cast<double>(sampler.pdf_environment(context, wi));
            }
            EXPECT_NEAR(sum * 4.0 * std::numbers::pi / kCount, 1.0, 2e-2) << z;
        }
    }
}

// Behind all windows the world is sampled as if there were none; without a world nothing is.
TEST(Portals, BehindThemAndWithoutAWorld) {
    const EnvironmentLight world = constant_world();
    const LightDescription portal = window(0.0f, false);
    const LightSampler sampler = test::make_sampler(std::span(&portal, 1), 405, &world);
    EXPECT_NEAR(
        reflected(sampler, test::plane_point(), [](const Vec3&) { return 1.0f; }), 1.0, 5e-3);
    EXPECT_TRUE(test::make_sampler(portal, 405).empty());
    EXPECT_FALSE(test::make_sampler(portal, 405).has_hittable_lamps());
}

// A portal without an area opens nothing: a constant world is left to scattering.
TEST(Portals, EmptyOpenings) {
    const EnvironmentLight world = constant_world();
    LightDescription portal = window(0.0f);
    portal.size_u = 0.0f;
    EXPECT_TRUE(test::make_sampler(std::span(&portal, 1), 405, &world).empty());
}

}  // namespace
}  // namespace pharos
