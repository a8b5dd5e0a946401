// Lamps of any parameters, seen from anywhere: nothing that is no number comes out (lamps of
// negative strength take light away, as in Cycles).
#include <array>

#include <gtest/gtest.h>

#include "native/lights/lights_support.h"
#include "support/stress.h"

namespace pharos {
namespace {

using namespace pharos::test;
using pharos::testing::case_count;
using pharos::testing::say_stress;

float wild(Random& r) {
    constexpr std::array<float, 18> kExtremes{0.0f,
                                              -0.0f,
                                              1e-38f,
                                              1e-20f,
                                              1e-7f,
                                              1e-4f,
                                              0.5f,
                                              1.0f,
                                              3.14f,
                                              6.3f,
                                              100.0f,
                                              1e6f,
                                              1e20f,
                                              1e38f,
                                              -1.0f,
                                              -1e30f,
                                              kInfinity,
                                              NAN};
    return r.index(2) == 0 ? r.uniform() : kExtremes[r.index(18)];
}

LightDescription wild_lamp(Random& r) {
    LightDescription d = lamp_above(static_cast<LightType>(r.index(4)), r.uniform(0.01f, 4.0f));
    if (r.index(4) != 0) {
        // Watts beyond this have no square any more.
        const auto watts = [&r] { return glm::clamp(wild(r), -1e18f, 1e18f); };
        d.strength = Rgb(watts(), r.uniform(), watts());
    }
    d.radius = wild(r);
    d.spot_angle = wild(r);
    d.spot_blend = wild(r);
    d.shape = static_cast<AreaShape>(r.index(2));
    d.size_u = wild(r);
    d.size_v = wild(r);
    d.spread = wild(r);
    d.angle = wild(r);
    d.soft_falloff = r.index(2) == 0;
    d.normalize = r.index(2) == 0;
    if (r.index(3) == 0) {
        const auto column = static_cast<int>(r.index(4));
        const auto row = static_cast<int>(r.index(3));
        d.to_world[column][row] = wild(r);
    }
    return d;
}

LightSampleContext wild_context(Random& r) {
    LightSampleContext context = plane_point();
    context.n = r.direction();
    if (r.index(2) == 0) {
        context.p = r.direction() * r.log_uniform(1e-6f, 1e6f);
    }
    return context;
}

TEST(Lights, AnyParametersGiveNumbers) {
    constexpr std::uint64_t kLooks = 16;
    const std::uint64_t lamps = case_count(20000, 640000);
    std::uint64_t bad = 0;
    std::uint64_t sampled = 0;
    Random random(99);
    for (std::uint64_t i = 0; i < lamps; ++i) {
        const std::uint64_t seed = random.bits();
        Random r(seed);
        const std::array<LightDescription, 2> d{wild_lamp(r), wild_lamp(r)};
        const LightSampler sampler =
            make_sampler(std::span(d).first(1 + r.index(2)), r.index(2) == 0 ? 304 : 405);
        for (std::uint64_t k = 0; k < kLooks; ++k) {
            const LightSampleContext context = wild_context(r);
            const Vec2 u = r.index(8) == 0 ? Vec2(0.0f, kOneMinusEpsilon) : r.uniform2();
            const auto s = sampler.sample(context, r.uniform(), u);
            if (s) {
                ++sampled;
                const bool good = is_finite(s->sample.L) && s->sample.pdf > 0.0f &&
                                  s->sample.pdf < kInfinity && s->sample.distance >= 0.0f &&
                                  std::abs(length_squared(s->sample.wi) - 1.0f) < 1e-3f;
                bad += good ? 0 : 1;
                EXPECT_TRUE(good) << "seed " << seed << ", look " << k << ", pdf " << s->sample.pdf
                                  << ", distance " << s->sample.distance << ", length^2 "
                                  << length_squared(s->sample.wi) << ", L " << s->sample.L.y
                                  << ", lamp " << static_cast<int>(d[0].type) << " radius "
                                  << d[0].radius << " u " << d[0].size_u << " v " << d[0].size_v
                                  << " at " << glm::length(context.p);
            }
            const Vec3 direction = s && r.index(2) == 0 ? s->sample.wi : r.direction();
            if (const auto hit = hit_along(sampler, context, direction)) {
                const bool good = is_finite(hit->L) && hit->pdf >= 0.0f && hit->pdf <= kInfinity;
                bad += good ? 0 : 1;
                EXPECT_TRUE(good) << "seed " << seed << ", look " << k << ", hit pdf " << hit->pdf
                                  << ", L " << hit->L.y;
            }
            ASSERT_LT(bad, 5u);
        }
    }
    EXPECT_GT(sampled, lamps * kLooks / 50);
    say_stress("lamps: samples and hits that are no numbers",
               lamps * kLooks,
               static_cast<double>(bad),
               0.0);
}

}  // namespace
}  // namespace pharos
