// The field as a whole: it learns known fields, is bit-equal for any thread count, survives
// attacks, and its file is what it says.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "guiding/guiding_field.h"
#include "support/chi_square.h"
#include "support/random.h"
#include "support/stress.h"

namespace pharos {
namespace {

using test::Random;

Bounds3 unit_box() {
    Bounds3 box;
    box.extend(Vec3(-1.0f));
    box.extend(Vec3(1.0f));
    return box;
}

// Two lights whose directions and strengths move with the position; the normal's cosine goes with
// it.
float two_lights(const Vec3& p, const Vec3& n, const Vec3& wi) {
    const Vec3 first = normalize_or(Vec3(0.5f, 0.0f, 2.0f) - p, Vec3(0, 0, 1));
    const Vec3 second = normalize_or(Vec3(-2.5f, 1.0f, 0.0f) - p, Vec3(-1, 0, 0));
    const float L =
        2.0f * vmf_pdf({first, 80.0f}, wi) + (1.0f + p.x) * vmf_pdf({second, 20.0f}, wi) + 0.01f;
    return L * std::max(glm::dot(n, wi), 0.0f);
}

using Radiance = std::function<float(const Vec3&, const Vec3&, const Vec3&)>;

// Records as a path tracer would make them: half from the field, half from the cosine lobe.
std::vector<RadianceRecord> record_pass(const GuidingField& field,
                                        const Radiance& radiance,
                                        std::size_t count,
                                        std::uint64_t seed) {
    Random random(seed);
    std::vector<RadianceRecord> records(count);
    std::vector<float> columns[6];
    for (auto& c : columns) {
        c.resize(count);
    }
    for (std::size_t i = 0; i < count; ++i) {
        records[i].position = random.uniform3() * 2.0f - 1.0f;
        records[i].normal = normalize_or(Vec3(0, 0, 1) + 0.3f * random.direction(), Vec3(0, 0, 1));
        for (int axis = 0; axis < 3; ++axis) {
            columns[axis][i] = records[i].position[axis];
            columns[3 + axis][i] = records[i].normal[axis];
        }
    }
    std::vector<VmfMixture> mixtures(count);
    field.evaluate({columns[0], columns[1], columns[2], columns[3], columns[4], columns[5]},
                   mixtures);
    for (std::size_t i = 0; i < count; ++i) {
        RadianceRecord& r = records[i];
        if (random.uniform() < 0.5f) {
            r.wi = sample_mixture(mixtures[i], random.uniform(), random.uniform2());
        } else {
            const Vec2 u = random.uniform2();
            const float z = std::sqrt(1.0f - u.x);
            const float phi = 2.0f * kPi * u.y;
            r.wi = Frame::from_z(r.normal).to_world(
                Vec3(std::sqrt(u.x) * std::cos(phi), std::sqrt(u.x) * std::sin(phi), z));
        }
        r.pdf = 0.5f * mixture_pdf(mixtures[i], r.wi) +
                0.5f * kInvPi * std::max(glm::dot(r.normal, r.wi), 0.0f);
        r.radiance_cos = radiance(r.position, r.normal, r.wi);
        r.key = (seed << 32) | i;
    }
    return records;
}

VmfMixture mixture_at(const GuidingField& field, const Vec3& p, const Vec3& n) {
    VmfMixture mixture;
    const FieldQuery query{std::span(&p.x, 1),
                           std::span(&p.y, 1),
                           std::span(&p.z, 1),
                           std::span(&n.x, 1),
                           std::span(&n.y, 1),
                           std::span(&n.z, 1)};
    field.evaluate(query, std::span(&mixture, 1));
    return mixture;
}

struct Quality {
    double variance = 0.0;  // relative, of estimating the integral by sampling the guide alone
    double integral = 0.0;  // mean relative error of A
};

// Over random vertices: E[(f / p)^2] / E[f / p]^2 - 1 with directions from the mixture defensively
// mixed.
Quality quality(const GuidingField& field, const Radiance& radiance) {
    Random random(99);
    Quality out;
    constexpr int kVertices = 60;
    for (int v = 0; v < kVertices; ++v) {
        const Vec3 p = random.uniform3() * 1.8f - 0.9f;
        const Vec3 n(0, 0, 1);
        const VmfMixture mixture = mixture_at(field, p, n);
        double sum = 0.0;
        double sum2 = 0.0;
        constexpr int kSamples = 4000;
        for (int i = 0; i < kSamples; ++i) {
            const Vec3 wi = random.uniform() < 0.9f
                                ? sample_mixture(mixture, random.uniform(), random.uniform2())
                                : random.direction();
            const float pdf = 0.9f * mixture_pdf(mixture, wi) + 0.1f * 0.25f * kInvPi;
            const auto f = static_cast<double>(radiance(p, n, wi) / pdf);
            sum += f;
            sum2 += f * f;
        }
        const double mean = sum / kSamples;
        out.variance += (sum2 / kSamples / (mean * mean) - 1.0) / kVertices;
        out.integral += std::abs(static_cast<double>(mixture.A) / mean - 1.0) / kVertices;
    }
    return out;
}

void train_passes(GuidingField& field, const Radiance& radiance, int passes, ThreadPool& pool) {
    for (int pass = 0; pass < passes; ++pass) {
        const auto records =
            record_pass(field, radiance, 16384, static_cast<std::uint64_t>(100 + pass));
        const TrainStatistics statistics = field.train(records, pool);
        ASSERT_EQ(statistics.invalid_records, 0u);
        ASSERT_EQ(statistics.skipped_steps, 0u);
    }
}

TEST(Field, LearnsTwoMovingLights) {
    ThreadPool pool(2);
    GuidingField field(GuidingConfig::neural(), unit_box());
    const Quality before = quality(field, two_lights);
    train_passes(field, two_lights, 12, pool);
    const Quality after = quality(field, two_lights);
    EXPECT_GE(field.generation(), 5u);
    EXPECT_LT(after.variance, 0.12 * before.variance) << before.variance;
    EXPECT_LT(after.variance, 0.6);
    EXPECT_LT(after.integral, 0.2);
    // What it learned is still sampled by its own density.
    const VmfMixture mixture = mixture_at(field, Vec3(0.3f, -0.2f, 0.1f), Vec3(0, 0, 1));
    test::ChiSquareOptions options;
    options.frame = Frame::from_z(Vec3(0.0f, 1.0f, 0.0f));
    const auto result = test::chi_square_sphere(
        [&](Random& r) {
            const float u = r.uniform();
            return std::optional<Vec3>(sample_mixture(mixture, u, r.uniform2()));
        },
        [&](const Vec3& w) { return mixture_pdf(mixture, w); },
        options);
    EXPECT_TRUE(result.passed) << result.message;
    EXPECT_NEAR(result.total_mass, 1.0, 1e-3);
}

TEST(Field, ScaleOfTheLightDoesNotMatter) {
    ThreadPool pool(1);
    for (const float scale : {1e-12f, 1e12f}) {
        GuidingField field(GuidingConfig::neural(), unit_box());
        const Radiance scaled = [scale](const Vec3& p, const Vec3& n, const Vec3& w) {
            return scale * two_lights(p, n, w);
        };
        train_passes(field, scaled, 6, pool);
        const Quality after = quality(field, scaled);
        EXPECT_LT(after.variance, 1.2) << scale;
        EXPECT_LT(after.integral, 0.3) << scale;
    }
}

TEST(Field, EveryPresetLearns) {
    ThreadPool pool(2);
    const Radiance one_light = [](const Vec3& p, const Vec3&, const Vec3& wi) {
        const Vec3 to_light = normalize_or(Vec3(0.5f, 0.3f, 2.5f) - p, Vec3(0, 0, 1));
        return (vmf_pdf({to_light, 50.0f}, wi) + 0.01f) * std::abs(wi.z);
    };
    std::vector<GuidingConfig> configs = {GuidingConfig::slides(), GuidingConfig::slides(false)};
    configs.emplace_back();
    configs.back().encoding = Encoding::HashGrid;
    configs.back().grid_levels = 4;
    configs.back().grid_features = 2;
    configs.back().grid_log2_size = 10;
    configs.emplace_back();
    configs.back().kappa = KappaActivation::Quadratic;
    configs.back().mu = MuActivation::Sigmoid;
    for (const GuidingConfig& config : configs) {
        GuidingField field(config, unit_box());
        const Quality before = quality(field, one_light);
        train_passes(field, one_light, 8, pool);
        const Quality after = quality(field, one_light);
        EXPECT_LT(after.variance, 0.5 * before.variance);
    }
}

std::vector<std::byte> train_with(unsigned threads, bool reversed, Encoding encoding) {
    ThreadPool pool(threads);
    GuidingConfig config;
    config.encoding = encoding;
    config.grid_log2_size = 10;
    GuidingField field(config, unit_box());
    for (int pass = 0; pass < 3; ++pass) {
        auto records = record_pass(field, two_lights, 5000, static_cast<std::uint64_t>(pass + 1));
        if (reversed) {
            std::reverse(records.begin(), records.end());
            std::rotate(records.begin(), records.begin() + 777, records.end());
        }
        field.train(records, pool);
    }
    return field.save();
}

TEST(Field, BitEqualForAnyThreadCountAndOrderOfRecords) {
    for (const Encoding encoding : {Encoding::Frequency, Encoding::HashGrid}) {
        const std::vector<std::byte> one = train_with(1, false, encoding);
        EXPECT_EQ(one, train_with(2, false, encoding));
        EXPECT_EQ(one, train_with(8, false, encoding));
        EXPECT_EQ(one, train_with(2, true, encoding));
    }
}

TEST(Field, GateKeepsAWorseSnapshotOut) {
    ThreadPool pool(1);
    GuidingField field(GuidingConfig::neural(), unit_box());
    train_passes(field, two_lights, 8, pool);
    const std::uint64_t generation = field.generation();
    const VmfMixture before = mixture_at(field, Vec3(0.2f), Vec3(0, 0, 1));
    // Training records lie, held-out ones tell the truth: found by trying each record alone. A
    // record whose pass has no steps was held out.
    auto records = record_pass(field, two_lights, 4000, 500);
    for (RadianceRecord& r : records) {
        GuidingField probe(GuidingConfig::neural(), unit_box());
        r.radiance_cos = std::max(r.radiance_cos, 1e-3f);
        if (probe.train(std::span(&r, 1), pool).trained_records > 0) {
            r.radiance_cos = 100.0f * (1.0f + r.wi.x) * (1.0f + r.wi.x) * (1.0f - r.wi.z);
        }
    }
    TrainStatistics statistics;
    for (int i = 0; i < 5; ++i) {
        statistics = field.train(records, pool);
        EXPECT_FALSE(statistics.published);
        EXPECT_GT(statistics.held_out_loss, statistics.held_out_loss_before);
    }
    EXPECT_EQ(field.generation(), generation);
    const VmfMixture after = mixture_at(field, Vec3(0.2f), Vec3(0, 0, 1));
    EXPECT_EQ(std::memcmp(&before, &after, sizeof(before)), 0);
}

void expect_valid(const GuidingField& field) {
    Random random(7);
    for (int i = 0; i < 200; ++i) {
        const VmfMixture m = mixture_at(field, random.uniform3() * 4.0f - 2.0f, random.direction());
        float sum = 0.0f;
        for (int k = 0; k < m.lobe_count; ++k) {
            sum += m.weight[k];
            ASSERT_NEAR(length_squared(m.lobe(k).mu), 1.0f, 1e-4f);
            ASSERT_TRUE(m.kappa[k] >= 0.0f && m.kappa[k] <= 3.1e4f) << m.kappa[k];
        }
        ASSERT_NEAR(sum, 1.0f, 1e-4f);
        ASSERT_TRUE(std::isfinite(m.A) && m.A >= 0.0f);
        const Vec3 w = sample_mixture(m, random.uniform(), random.uniform2());
        const float pdf = mixture_pdf(m, w);
        ASSERT_TRUE(std::isfinite(pdf) && pdf > 0.0f);
    }
}

TEST(Field, AttacksLeaveItFinite) {
    ThreadPool pool(1);
    const float nan = std::nanf("");
    using Attack = std::function<void(RadianceRecord&, std::size_t)>;
    const std::vector<Attack> attacks = {
        [](RadianceRecord& r, std::size_t) { r.radiance_cos = 0.0f; },
        [](RadianceRecord& r, std::size_t) { r.radiance_cos = 1e-30f; },
        [](RadianceRecord& r, std::size_t) { r.radiance_cos = 1e30f; },
        [](RadianceRecord& r, std::size_t) { r.radiance_cos = kInfinity; },
        [nan](RadianceRecord& r, std::size_t) { r.radiance_cos = nan; },
        [](RadianceRecord& r, std::size_t i) { r.radiance_cos = i == 77 ? 1e30f : r.radiance_cos; },
        [](RadianceRecord& r, std::size_t i) { r.radiance_cos = i % 2 == 0 ? 1e30f : 1e-30f; },
        [](RadianceRecord& r, std::size_t i) {
            r.radiance_cos = (r.key >> 32) % 2 == 0 ? 1e30f : 1e-30f;
            r.position.x += static_cast<float>(i % 2);
        },
        [](RadianceRecord& r, std::size_t) { r.position = Vec3(0.25f); },
        [](RadianceRecord& r, std::size_t i) { r.position *= i % 2 == 0 ? 1e9f : 1.0f; },
        [nan](RadianceRecord& r, std::size_t i) { (i % 2 == 0 ? r.position : r.normal).y = nan; },
        [](RadianceRecord& r, std::size_t i) { r.pdf = i % 3 == 0 ? 1e-38f : 1e38f; },
        [nan](RadianceRecord& r, std::size_t i) { r.pdf = i % 2 == 0 ? nan : -1.0f; },
        [](RadianceRecord& r, std::size_t) { r.wi = Vec3(0.0f); },
        [](RadianceRecord& r, std::size_t) {
            r.wi = Vec3(0, 0, 1);
            r.radiance_cos = 1.0f;
        },
        [](RadianceRecord& r, std::size_t) { r.key = 5; },
    };
    // The long form: more than 10 000 steps each.
    const std::uint64_t passes = testing::case_count(6, 2600);
    std::uint64_t given = 0;
    for (const GuidingConfig& config : {GuidingConfig::neural(), GuidingConfig::slides()}) {
        for (const Attack& attack : attacks) {
            GuidingField field(config, unit_box());
            for (std::uint64_t pass = 0; pass < passes; ++pass) {
                auto records = record_pass(field, two_lights, 2048, pass + 1);
                for (std::size_t i = 0; i < records.size(); ++i) {
                    attack(records[i], i);
                }
                const TrainStatistics statistics = field.train(records, pool);
                ASSERT_TRUE(std::isfinite(statistics.loss));
                given += records.size();
            }
            expect_valid(field);
            // And it still learns afterwards.
            const std::uint64_t generation = field.generation();
            for (std::uint64_t pass = 0; pass < 3; ++pass) {
                field.train(record_pass(field, two_lights, 4096, 50 + pass), pool);
            }
            EXPECT_GT(field.generation(), generation) << "attack " << (&attack - attacks.data());
            expect_valid(field);
        }
    }
    testing::say_stress("training on lies: weights and densities that are no numbers",
                        given,
                        HasFailure() ? 1.0 : 0.0,
                        0.0);
}

TEST(Field, CancelledTrainingPublishesNothing) {
    ThreadPool pool(2);
    GuidingField field(GuidingConfig::neural(), unit_box());
    CancelFlag cancel;
    const auto records = record_pass(field, two_lights, 4096, 1);
    EXPECT_TRUE(field.train(records, pool, &cancel).published);
    cancel.cancel();
    const TrainStatistics statistics = field.train(records, pool, &cancel);
    EXPECT_EQ(statistics.steps, 0u);
    EXPECT_FALSE(statistics.published);
    EXPECT_EQ(field.generation(), 1u);
}

TEST(Field, EmptyAndTinyPassesAreHarmless) {
    ThreadPool pool(2);
    GuidingField field(GuidingConfig::neural(), unit_box());
    EXPECT_EQ(field.train({}, pool).steps, 0u);
    EXPECT_EQ(field.generation(), 0u);
    const auto records = record_pass(field, two_lights, 3, 1);
    field.train(records, pool);
    expect_valid(field);
    GuidingField flat(GuidingConfig::neural(), Bounds3{});
    expect_valid(flat);
    field.evaluate({}, {});
}

TEST(Field, QueriesOutsideOfAllLimitsGiveValidMixtures) {
    ThreadPool pool(1);
    GuidingField field(GuidingConfig::neural(), unit_box());
    train_passes(field, two_lights, 2, pool);
    const float nan = std::nanf("");
    for (const float bad : {nan, kInfinity, -kInfinity, 3e38f, -3e38f, 1e-45f}) {
        const VmfMixture m = mixture_at(field, Vec3(bad, 0.0f, bad), Vec3(0.0f, bad, bad));
        const float pdf = mixture_pdf(m, Vec3(0, 0, 1));
        EXPECT_TRUE(std::isfinite(pdf) && std::isfinite(m.A)) << bad;
    }
}

// Any batch size gives the same mixtures: lanes and tails do not matter.
TEST(Field, BatchesOfAnySizeAgree) {
    ThreadPool pool(1);
    GuidingField field(GuidingConfig::neural(), unit_box());
    train_passes(field, two_lights, 2, pool);
    Random random(3);
    for (const std::size_t count : {1u, 2u, 15u, 31u, 32u, 33u, 63u, 64u, 65u, 97u, 1000u}) {
        std::vector<float> columns[6];
        for (auto& c : columns) {
            for (std::size_t i = 0; i < count; ++i) {
                c.push_back(random.uniform(-1.0f, 1.0f));
            }
        }
        std::vector<VmfMixture> mixtures(count);
        field.evaluate({columns[0], columns[1], columns[2], columns[3], columns[4], columns[5]},
                       mixtures);
        for (std::size_t i = 0; i < count; ++i) {
            const VmfMixture single = mixture_at(field,
                                                 Vec3(columns[0][i], columns[1][i], columns[2][i]),
                                                 Vec3(columns[3][i], columns[4][i], columns[5][i]));
            ASSERT_EQ(std::memcmp(&single, &mixtures[i], 24 * 8 + 4), 0) << count << " " << i;
            ASSERT_EQ(single.A, mixtures[i].A);
        }
    }
}

TEST(Field, FileRestoresEverything) {
    ThreadPool pool(1);
    GuidingField first(GuidingConfig::neural(), unit_box());
    train_passes(first, two_lights, 2, pool);
    const std::vector<std::byte> file = first.save();
    EXPECT_LE(file.size(), 64u * 1024u);
    GuidingField second(GuidingConfig::neural(), unit_box());
    second.load(file);
    EXPECT_EQ(second.generation(), first.generation());
    EXPECT_EQ(second.save(), file);
    const auto records = record_pass(first, two_lights, 4096, 9);
    first.train(records, pool);
    second.train(records, pool);
    EXPECT_EQ(first.save(), second.save());
}

TEST(Field, BrokenFilesAreRefused) {
    ThreadPool pool(1);
    GuidingField field(GuidingConfig::neural(), unit_box());
    train_passes(field, two_lights, 1, pool);
    const std::vector<std::byte> good = field.save();
    GuidingField other(GuidingConfig::neural(), unit_box());
    const std::vector<std::byte> untouched = other.save();
    Random random(5);
    for (int i = 0; i < 300; ++i) {
        std::vector<std::byte> bad = good;
        if (i % 3 == 0) {
            bad.resize(random.index(static_cast<std::uint32_t>(bad.size())));
        } else if (i % 3 == 1) {
            bad[random.index(static_cast<std::uint32_t>(bad.size()))] ^= std::byte{0x10};
        } else {
            bad.push_back(std::byte{0});
        }
        EXPECT_THROW(other.load(bad), std::invalid_argument);
    }
    GuidingField small(GuidingConfig::slides(), unit_box());
    EXPECT_THROW(small.load(good), std::invalid_argument);
    EXPECT_THROW(other.load({}), std::invalid_argument);
    EXPECT_EQ(other.save(), untouched);
}

TEST(Field, RestartAdaptsToMovedLight) {
    ThreadPool pool(2);
    GuidingField field(GuidingConfig::neural(), unit_box());
    train_passes(field, two_lights, 10, pool);
    const Radiance moved = [](const Vec3& p, const Vec3& n, const Vec3& wi) {
        const Vec3 to_light = normalize_or(Vec3(-1.5f, -2.0f, 1.5f) - p, Vec3(0, 0, 1));
        return (vmf_pdf({to_light, 80.0f}, wi) + 0.01f) * std::max(glm::dot(n, wi), 0.0f);
    };
    const Quality stale = quality(field, moved);
    field.restart_optimizer();
    train_passes(field, moved, 8, pool);
    EXPECT_LT(quality(field, moved).variance, 0.2 * stale.variance);
}

}  // namespace
}  // namespace pharos
