// Ten thousand lights against a choice among them that knows nothing, and a million triangles.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "lights/lamp.h"
#include "lights/light_sampler.h"
#include "support/description_builders.h"
#include "support/random.h"
#include "support/stress.h"

namespace pharos {
namespace {

using namespace pharos::testing;
using test::Random;

constexpr int kRow = 100;  // lamps; squared in all

std::vector<LightDescription> street_lamps() {
    std::vector<LightDescription> lamps;
    Random random(5);
    for (int i = 0; i < kRow * kRow; ++i) {
        const Vec3 p(static_cast<float>(i % kRow), static_cast<float>(i / kRow), 3.0f);
        const Rgb strength(5.0f * random.uniform() + 1.0f);
        lamps.push_back(i % 2 == 0 ? area_lamp(look_at(p, p - Vec3(0, 0, 1)), strength, 0.1f, 0.1f)
                                   : point_lamp(p, strength, 0.05f));
    }
    return lamps;
}

struct Efficiency {
    double mean = 0.0;
    double variance = 0.0;  // relative, of one sample at a receiver
    double seconds = 0.0;   // of one sample
};

// `sample` answers all queries with what arrives of each, over the receiver's own mean.
Efficiency measure(const std::function<void(std::span<LightQuery>, std::span<double>)>& sample) {
    constexpr int kReceivers = 64;
    constexpr std::size_t kSamples = 4096;
    Random random(11);
    Efficiency all;
    std::vector<LightQuery> queries(kSamples);
    std::vector<double> arrives(kSamples);
    for (int receiver = 0; receiver < kReceivers; ++receiver) {
        const LightSampleContext context{
            Vec3(random.uniform(10, 90), random.uniform(10, 90), 0), Vec3(0, 0, 1), false};
        for (LightQuery& query : queries) {
            const Vec2 u = random.uniform2();
            query = {context, static_cast<double>(random.uniform()), u, {}};
        }
        const Stopwatch watch;
        sample(queries, arrives);
        all.seconds += watch.seconds() / kReceivers / kSamples;
        double sum = 0.0;
        double squares = 0.0;
        for (const double a : arrives) {
            sum += a / kSamples;
            squares += a * a / kSamples;
        }
        all.mean += sum / kReceivers;
        all.variance += (squares - sum * sum) / (sum * sum) / kReceivers;
    }
    return all;
}

double irradiance(const Rgb& L, const Vec3& wi, double pdf) {
    return pdf > 0.0 && wi.z > 0.0f ? static_cast<double>(L.x * wi.z) / pdf : 0.0;
}

TEST(ManyLights, FarLessErrorThanUniformChoiceAtEqualTime) {
    const std::vector<LightDescription> descriptions = street_lamps();
    LightSamplerInput input;
    input.lamps = descriptions;
    input.blender_version = 405;
    const LightSampler sampler(input);
    std::vector<Lamp> lamps;
    for (const LightDescription& description : descriptions) {
        lamps.push_back(*make_lamp(description, 405, 0));
    }
    const Efficiency tree = measure([&](std::span<LightQuery> queries, std::span<double> arrives) {
        sampler.choose(queries);
        for (std::size_t i = 0; i < queries.size(); ++i) {
            const auto s = sampler.sample(queries[i]);
            arrives[i] =
                s ? irradiance(s->sample.L, s->sample.wi, static_cast<double>(s->sample.pdf)) : 0.0;
        }
    });
    const Efficiency uniform =
        measure([&](std::span<LightQuery> queries, std::span<double> arrives) {
            const auto count = static_cast<double>(lamps.size());
            for (std::size_t i = 0; i < queries.size(); ++i) {
                const LightQuery& q = queries[i];
                const auto index = static_cast<std::size_t>(q.u_choice * count);
                const auto s = sample_lamp(lamps[index], q.context, q.u);
                arrives[i] = s ? irradiance(s->L, s->wi, static_cast<double>(s->pdf) / count) : 0.0;
            }
        });
    EXPECT_NEAR(tree.mean / uniform.mean, 1.0, 0.2) << "both see the same light";
    const double left = tree.variance * tree.seconds / (uniform.variance * uniform.seconds);
    say_stress("10 000 lamps: error over that of uniform choice, equal time",
               descriptions.size(),
               left,
               0.2);
    say_stress("10 000 lamps: nanoseconds of a light sample",
               descriptions.size(),
               1e9 * tree.seconds,
               1000.0);
    EXPECT_LE(left, 0.2);
}

TEST(ManyLights, AMillionEmissiveTrianglesAreReadySoon) {
    const auto triangles = static_cast<std::uint32_t>(case_count(1000000, 1000000));
    const auto rings = static_cast<std::uint32_t>(std::sqrt(0.5 * triangles)) + 1;
    const Mesh mesh = sphere_mesh("ball", Vec3(0.0f), 1.0f, rings, rings);
    Instance instance;
    instance.materials = {0};
    std::vector<EmissiveTriangle> emitters(mesh.triangles.size());
    for (std::uint32_t i = 0; i < emitters.size(); ++i) {
        emitters[i] = {0, i, Rgb(1.0f)};
    }
    LightSamplerInput input;
    input.triangles = emitters;
    input.meshes = std::span(&mesh, 1);
    input.instances = std::span(&instance, 1);
    constexpr double kBar = 3.0;
    const double seconds = least_of(kBar, [&] {
        const Stopwatch watch;
        const LightSampler sampler(input);
        EXPECT_FALSE(sampler.empty());
        return watch.seconds();
    });
    say_stress("emissive triangles: seconds to be ready", emitters.size(), seconds, kBar);
    EXPECT_LE(seconds, kBar * kSlowdown);
}

}  // namespace
}  // namespace pharos
