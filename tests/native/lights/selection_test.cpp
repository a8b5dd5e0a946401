// The choice among lights: probabilities, exactness of chance-hit densities with many lamps, order
// of hits, and extreme input.

#include "lights/lamp_tree.h"
#include "lights/light_selection.h"
#include "lights_support.h"

namespace pharos {

namespace {

using test::lamp_above;
using test::make_sampler;
using test::Random;

std::vector<LightDescription> random_lamps(int count, std::uint64_t seed) {
    Random random(seed);
    std::vector<LightDescription> lamps;
    for (int i = 0; i < count; ++i) {
        LightDescription d = lamp_above(static_cast<LightType>(i % 3));
        const Frame frame = Frame::from_z(random.direction());
        d.to_world[0] = Vec4(frame.x, 0);
        d.to_world[1] = Vec4(frame.y, 0);
        d.to_world[2] = Vec4(frame.z, 0);
        d.to_world[3] = Vec4(random.uniform3() * 8.0f - 4.0f, 1);
        d.radius = random.uniform(0.02f, 0.3f);
        d.size_u = random.uniform(0.05f, 0.6f);
        d.size_v = random.uniform(0.05f, 0.6f);
        d.spread = i % 2 == 0 ? kPi : 1.2f;
        d.spot_angle = random.uniform(0.5f, 3.0f);
        d.spot_blend = 0.2f;
        d.strength = Rgb(random.log_uniform(1.0f, 100.0f));
        lamps.push_back(d);
    }
    return lamps;
}

// Chance hits have exactly the sampler's density, with few lamps and along the tree.
TEST(Selection, ChanceHitDensityIncludesTheChoice) {
    for (const int count : {2, 9, 32, 33, 400}) {
        for (const std::uint32_t version : {304u, 405u}) {
            const std::vector<LightDescription> lamps = random_lamps(count, 3);
            const LightSampler sampler = make_sampler(lamps, version);
            Random random(5);
            int compared = 0;
            for (int i = 0; i < 5000; ++i) {
                const LightSampleContext context{
                    random.uniform3() * 8.0f - 4.0f, random.direction(), random.index(2) == 1};
                const auto s = sampler.sample(context, random.uniform(), random.uniform2());
                if (!s) {
                    continue;
                }
                const float start = s->sample.distance * 0.9999f;
                const auto hit = sampler.intersect_lamps(
                    {context.p, s->sample.wi, start, s->sample.distance * 1.0001f}, &context);
                if (hit && std::abs(hit->distance / s->sample.distance - 1.0f) < 1e-5f &&
                    hit->L == s->sample.L) {
                    EXPECT_NEAR(hit->pdf / s->sample.pdf, 1.0f, 2e-3f);
                    ++compared;
                }
            }
            EXPECT_GT(compared, 300) << count;
        }
    }
}

// Every lamp that reaches a point is chosen there: the sum over all lamps equals one by one.
TEST(Selection, SumOverLampsIsUnbiased) {
    for (const int count : {6, 40}) {
        const std::vector<LightDescription> lamps = random_lamps(count, 8);
        const LightSampler all = make_sampler(lamps, 405);
        Random random(12);
        for (int point = 0; point < 4; ++point) {
            const LightSampleContext context{
                random.uniform3() * 4.0f - 2.0f, random.direction(), false};
            double expected = 0.0;
            for (const LightDescription& lamp : lamps) {
                expected += test::sampled_radiance(make_sampler(lamp, 405), context, 100);
            }
            const double together = test::sampled_radiance(all, context, 700);
            EXPECT_NEAR(together / expected, 1.0, count > 32 ? 0.02 : 0.01) << count;
        }
    }
}

// Transmitting receivers and bumped normals: light from behind n is found, too.
TEST(Selection, NeverZeroWhereLightArrives) {
    std::vector<LightDescription> lamps = {lamp_above(LightType::Point, 2.0f),
                                           lamp_above(LightType::Point, -2.0f)};
    const LightSampler sampler = make_sampler(lamps, 405);
    for (const bool transmits : {false, true}) {
        const LightSampleContext context{Vec3(0.0f), Vec3(0, 0, 1), transmits};
        int below = 0;
        constexpr int kSamples = 10000;
        for (int i = 0; i < kSamples; ++i) {
            const auto s =
                sampler.sample(context, (static_cast<float>(i) + 0.5f) / kSamples, Vec2(0.5f));
            ASSERT_TRUE(s);
            below += s->sample.wi.z < 0.0f ? 1 : 0;
            if (transmits) {
                EXPECT_NEAR(s->sample.pdf, 0.5f, 1e-5f);
            }
        }
        EXPECT_GT(below, kSamples / 100);
        EXPECT_LT(below, transmits ? kSamples * 51 / 100 : kSamples / 20);
    }
}

TEST(Selection, BoundsAreAboveEveryContribution) {
    // Where a lamp contributes, its estimate is positive.
    Random random(77);
    int lit = 0;
    for (const LightDescription& d : random_lamps(60, 21)) {
        for (const std::uint32_t version : {304u, 405u}) {
            const auto lamp = make_lamp(d, version, 0);
            ASSERT_TRUE(lamp);
            LightBound world;
            world.distance = EmitterDistance::Ambient;
            world.strength = 1e-6f;
            const LightSelection selection(std::array{bound_lamp(*lamp), world});
            for (int i = 0; i < 300; ++i) {
                const LightSampleContext context{
                    random.uniform3() * 8.0f - 4.0f, random.direction(), false};
                if (sample_lamp(*lamp, context, random.uniform2())) {
                    ++lit;
                    EXPECT_GT(selection.pmf(context, 0), 0.0f);
                }
            }
        }
    }
    EXPECT_GT(lit, 3000);
}

// Local and distant lights of all shapes and the world.
std::vector<LightBound> random_bounds(int count) {
    std::vector<LightBound> bounds;
    for (LightDescription& d : random_lamps(count, 31)) {
        if (bounds.size() % 50 == 7) {
            d.type = LightType::Sun;
        }
        if (const auto lamp = make_lamp(d, 405, 0)) {
            bounds.push_back(bound_lamp(*lamp));
        }
    }
    LightBound world;
    world.distance = EmitterDistance::Ambient;
    world.center = Vec3(0, 0, 1);
    world.strength = 0.3f;
    bounds.push_back(world);
    return bounds;
}

TEST(LightTree, ProbabilitiesAreThoseOfTheChoiceAndAddUp) {
    Random random(9);
    for (const int count : {40, 600, 5000}) {
        const std::vector<LightBound> bounds = random_bounds(count);
        const LightTree tree(bounds);
        for (int i = 0; i < 6; ++i) {
            const LightSampleContext context{
                random.uniform3() * 8.0f - 4.0f, random.direction(), i % 2 == 0};
            double sum = 0.0;
            for (std::uint32_t light = 0; light < bounds.size(); ++light) {
                sum += static_cast<double>(tree.pmf(context, light));
            }
            // Less where a node promised light that none of its children has.
            EXPECT_LT(sum, 1.0 + 1e-4);
            EXPECT_GT(sum, 0.9);
            std::vector<LightQuery> queries(200);
            for (LightQuery& query : queries) {
                query = {context, static_cast<double>(random.uniform()), Vec2(0.5f), {}};
            }
            tree.choose(queries);
            for (const LightQuery& query : queries) {
                const LightChoice& choice = query.choice;
                if (choice.pmf > 0.0f) {
                    EXPECT_NEAR(choice.pmf / tree.pmf(context, choice.group), 1.0f, 1e-4f);
                    EXPECT_TRUE(choice.u >= 0.0 && choice.u < 1.0);
                }
            }
        }
    }
}

// Receivers that descend together do not get into each other's way.
TEST(LightTree, TogetherAsOneByOne) {
    Random random(19);
    const LightTree tree(random_bounds(3000));
    std::vector<LightQuery> together(61);
    for (std::size_t i = 0; i < together.size(); ++i) {
        together[i].context = {random.uniform3() * 8.0f - 4.0f, random.direction(), i % 3 == 0};
        together[i].u_choice = static_cast<double>(random.uniform());
    }
    std::vector<LightQuery> alone = together;
    tree.choose(together);
    for (std::size_t i = 0; i < alone.size(); ++i) {
        tree.choose(std::span(&alone[i], 1));
        EXPECT_EQ(alone[i].choice.group, together[i].choice.group);
        EXPECT_EQ(alone[i].choice.pmf, together[i].choice.pmf);
        EXPECT_EQ(alone[i].choice.u, together[i].choice.u);
    }
}

// What is chosen how often is what the probability says, also among siblings of unlike strength.
TEST(LightTree, ChoosesAsOftenAsItSays) {
    Random random(23);
    std::vector<LightBound> bounds(50);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        bounds[i].center = random.uniform3() * 6.0f;
        bounds[i].strength = i % 5 == 0 ? 0.0f : std::pow(10.0f, random.uniform(-3.0f, 0.0f));
    }
    const LightTree tree(bounds);
    const LightSampleContext context{Vec3(1.0f, 2.0f, -1.0f), Vec3(0, 0, 1), true};
    constexpr std::size_t kSamples = 1 << 18;
    std::vector<LightQuery> queries(kSamples);
    for (std::size_t i = 0; i < kSamples; ++i) {
        queries[i] = {context, (static_cast<double>(i) + 0.5) / kSamples, Vec2(0.5f), {}};
    }
    tree.choose(queries);
    std::vector<double> share(bounds.size());
    for (const LightQuery& query : queries) {
        share[query.choice.group] += 1.0 / kSamples;
    }
    for (std::uint32_t light = 0; light < bounds.size(); ++light) {
        // Numbers on a grid: each node on the way moves an edge by one of them at most.
        EXPECT_NEAR(share[light], static_cast<double>(tree.pmf(context, light)), 4.0 / kSamples)
            << light;
    }
}

// Whatever a light brings, the nodes above it let it be found.
TEST(LightTree, NeverZeroWhereALightBringsSome) {
    Random random(15);
    const std::vector<LightBound> bounds = random_bounds(700);
    const LightTree tree(bounds);
    int lit = 0;
    for (int i = 0; i < 300; ++i) {
        const LightSampleContext context{
            random.uniform3() * 12.0f - 6.0f, random.direction(), i % 2 == 0};
        for (std::uint32_t light = 0; light < bounds.size(); ++light) {
            LightColumns<8> alone;
            alone.set(0, bounds[light]);
            LightColumns<8>::Column weights;
            if (alone.estimate(context, 1, weights) > 0.0f) {
                ++lit;
                EXPECT_GT(tree.pmf(context, light), 0.0f) << light;
            }
        }
    }
    EXPECT_GT(lit, 50000);
}

// Against a choice by strength alone: a street of lamps seen from beneath one of them.
TEST(LightTree, PrefersWhatIsNear) {
    std::vector<LightBound> street(10000);
    for (std::size_t i = 0; i < street.size(); ++i) {
        street[i].center = Vec3(3.0f * static_cast<float>(i), 0.0f, 4.0f);
        street[i].strength = 1.0f;
    }
    const LightTree tree(street);
    const LightSampleContext below{Vec3(15000.0f, 0.0f, 0.0f), Vec3(0, 0, 1), false};
    double second_moment = 0.0;  // of the irradiance estimate, over that of the best choice
    double irradiance = 0.0;
    double uniform = 0.0;
    for (std::uint32_t light = 0; light < street.size(); ++light) {
        const Vec3 to = street[light].center - below.p;
        const auto brings = static_cast<double>(to.z / std::pow(glm::length(to), 3.0f));
        irradiance += brings;
        second_moment += brings * brings / static_cast<double>(tree.pmf(below, light));
        uniform += brings * brings * static_cast<double>(street.size());
    }
    EXPECT_LT(second_moment / (irradiance * irradiance), 1.6);
    EXPECT_GT(uniform / (irradiance * irradiance), 1000.0);
}

TEST(Selection, TreeFindsWhatBruteForceFinds) {
    const std::vector<LightDescription> descriptions = random_lamps(500, 4);
    for (const std::uint32_t version : {304u, 405u}) {
        std::vector<Lamp> lamps;
        lamps.reserve(descriptions.size());
        for (const LightDescription& d : descriptions) {
            lamps.push_back(*make_lamp(d, version, 0));
        }
        const LampTree tree(lamps);
        Random random(6);
        int hits = 0;
        std::vector<LampRay> rays;
        std::vector<std::optional<LampTree::Nearest>> alone;
        for (int i = 0; i < 5000; ++i) {
            Ray ray{random.uniform3() * 10.0f - 5.0f, random.direction()};
            if (i % 10 == 0) {
                ray.direction = Vec3(0, i % 20 == 0 ? 1.0f : -1.0f, 0);
            }
            float nearest = kInfinity;
            for (const Lamp& lamp : lamps) {
                if (const auto hit = hit_lamp(lamp, ray, nullptr)) {
                    nearest = std::min(nearest, hit->t);
                }
            }
            const auto found = tree.intersect(ray, nullptr);
            rays.push_back({ray, nullptr});
            alone.push_back(found);
            ASSERT_EQ(found.has_value(), nearest < kInfinity);
            if (found) {
                EXPECT_EQ(found->hit.t, nearest);
                ++hits;
            }
        }
        EXPECT_GT(hits, 500);
        std::array<std::optional<LampTree::Nearest>, LampTree::kTogether> together;
        for (std::size_t i = 0; i + together.size() <= rays.size(); i += together.size()) {
            tree.intersect(std::span(rays).subspan(i, together.size()), together);
            for (std::size_t k = 0; k < together.size(); ++k) {
                ASSERT_EQ(together[k].has_value(), alone[i + k].has_value());
                if (together[k]) {
                    EXPECT_EQ(together[k]->lamp, alone[i + k]->lamp);
                    EXPECT_EQ(together[k]->hit.t, alone[i + k]->hit.t);
                }
            }
        }
    }
}

TEST(Selection, SettingsPassThrough) {
    LightDescription lamp = lamp_above(LightType::Area);
    lamp.cast_shadow = false;
    lamp.visibility = kVisibleGlossy;
    lamp.max_bounces = 3;
    lamp.use_mis = false;
    const LightSampler sampler = make_sampler(lamp, 405);
    const auto s = sampler.sample(test::plane_point(), 0.5f, Vec2(0.5f));
    ASSERT_TRUE(s);
    EXPECT_TRUE(s->sample.delta);  // nothing competes with its samples
    EXPECT_FALSE(s->sample.cast_shadow);
    EXPECT_EQ(s->sample.visibility, kVisibleGlossy);
    EXPECT_EQ(s->sample.max_bounces, 3u);
    EXPECT_FALSE(sampler.has_hittable_lamps());
    EXPECT_FALSE(sampler.intersect_lamps({Vec3(0.0f), Vec3(0, 0, 1)}, nullptr));
    lamp.use_mis = true;
    const auto hit = make_sampler(lamp, 405).intersect_lamps({Vec3(0.0f), Vec3(0, 0, 1)}, nullptr);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->pdf, 0.0f);
    EXPECT_EQ(hit->visibility, kVisibleGlossy);
    EXPECT_FLOAT_EQ(hit->distance, 2.0f);
    // Suns are hit when they have an angle and use MIS.
    LightDescription sun = lamp_above(LightType::Sun);
    EXPECT_EQ(make_sampler(sun, 405).sun_count(), 0u);
    sun.angle = 0.1f;
    EXPECT_EQ(make_sampler(sun, 405).sun_count(), 1u);
    sun.use_mis = false;
    EXPECT_EQ(make_sampler(sun, 405).sun_count(), 0u);
}

TEST(Selection, NegativeLampsSubtract) {
    LightDescription lamp = lamp_above(LightType::Area);
    lamp.strength = Rgb(-100.0f);
    EXPECT_NEAR(
        test::sampled_radiance(make_sampler(lamp, 304), test::plane_point(), 300), -1.83694, 2e-3);
}

TEST(Selection, UnusableLampsAreNone) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<LightDescription> bad(6, lamp_above(LightType::Area));
    bad[0].strength = Rgb(nan);
    bad[1].strength = Rgb(0.0f);
    bad[2].size_u = 0.0f;
    bad[3].to_world[3].x = kInfinity;
    bad[4].to_world[0] = Vec4(0.0f);
    bad[5].type = static_cast<LightType>(17);
    for (const std::uint32_t version : {304u, 405u}) {
        const LightSampler sampler = make_sampler(bad, version);
        EXPECT_TRUE(sampler.empty());
        EXPECT_FALSE(sampler.sample(test::plane_point(), 0.5f, Vec2(0.5f)));
    }
}

// Whatever the sizes, distances and random numbers: finite, unit, positive.
TEST(Selection, ExtremeValuesStayFinite) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> sizes = {0.0f, 1e-20f, 1e-6f, 1e-3f, 1.0f, 1e6f, nan, -1.0f};
    const std::vector<float> angles = {0.0f, 1e-7f, 1e-4f, 0.01f, 1.0f, kPi, 7.0f, nan, -1.0f};
    const std::vector<float> distances = {0.0f, 1e-7f, 1.0f, 1e6f};
    const std::vector<float> numbers = {0.0f, 1e-7f, 0.5f, kOneMinusEpsilon};
    for (int combination = 0; combination < 4 * 8 * 9 * 4 * 2; ++combination) {
        int rest = combination;
        const auto digit = [&rest](int base) {
            const int value = rest % base;
            rest /= base;
            return static_cast<std::size_t>(value);
        };
        LightDescription d = lamp_above(static_cast<LightType>(digit(4)));
        d.radius = d.size_u = sizes[digit(8)];
        d.spot_angle = d.spread = d.angle = angles[digit(9)];
        d.spot_blend = d.angle > 0.5f ? 0.0f : d.spot_angle;
        d.to_world[3].z = distances[digit(4)];
        const LightSampler sampler = make_sampler(d, digit(2) == 0 ? 304 : 405);
        for (const float u : numbers) {
            for (const float v : numbers) {
                const LightSampleContext context = test::plane_point();
                const auto s = sampler.sample(context, 0.5f, Vec2(u, v));
                if (s) {
                    ASSERT_TRUE(is_finite(s->sample.L)) << combination;
                    ASSERT_TRUE(s->sample.pdf > 0.0f && s->sample.pdf < kInfinity) << combination;
                    ASSERT_NEAR(glm::length(s->sample.wi), 1.0f, 1e-4f) << combination;
                    ASSERT_GE(s->sample.distance, 0.0f) << combination;
                }
                const Vec3 direction = s ? s->sample.wi : Vec3(0, 0, 1);
                if (const auto hit = test::hit_along(sampler, context, direction)) {
                    ASSERT_TRUE(is_finite(hit->L) && hit->pdf >= 0.0f) << combination;
                }
            }
        }
    }
}

}  // namespace

}  // namespace pharos
