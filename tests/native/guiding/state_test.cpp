// Weights that something overwrote in mid-render: the field keeps giving valid mixtures and
// recovers.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "guiding/network_state.h"
#include "guiding/trainer.h"
#include "support/random.h"

namespace pharos {
namespace {

using test::Random;

std::vector<RadianceRecord> make_records(std::uint64_t seed) {
    Random random(seed);
    std::vector<RadianceRecord> records(2048);
    for (std::size_t i = 0; i < records.size(); ++i) {
        RadianceRecord& r = records[i];
        r.position = random.uniform3();
        r.normal = Vec3(0, 0, 1);
        r.wi = random.direction();
        r.pdf = 0.25f * kInvPi;
        r.radiance_cos = vmf_pdf({Vec3(0.6f, 0.0f, 0.8f), 10.0f}, r.wi);
        r.key = (seed << 32) | i;
    }
    return records;
}

VmfMixture evaluate_one(const NetworkLayout& layout, const NetworkState& state) {
    const float x = 0.5f;
    const float z = 1.0f;
    const std::span<const float> half(&x, 1);
    const std::span<const float> one(&z, 1);
    VmfMixture mixture;
    evaluate_network(
        published_view(layout, state), {half, half, half, half, half, one}, {&mixture, 1});
    return mixture;
}

TEST(NetworkState, OverwrittenWeightsAreHarmlessAndRecover) {
    const NetworkLayout layout = make_network_layout(GuidingConfig::neural());
    Bounds3 box;
    box.extend(Vec3(0.0f));
    box.extend(Vec3(1.0f));
    ThreadPool pool(1);
    for (const float bad : {std::nanf(""), kInfinity, -kInfinity, 3e38f}) {
        NetworkState state = make_network_state(layout, box);
        Trainer trainer(layout);
        for (std::uint64_t pass = 0; pass < 3; ++pass) {
            trainer.train(state, make_records(pass + 1), pool);
        }
        const std::uint64_t generation = state.generation;
        ASSERT_GE(generation, 1u);
        for (AlignedFloats* weights :
             {&state.published, &state.parameters, &state.average, &state.first_moment}) {
            for (std::size_t i = 0; i < weights->size(); i += 7) {
                (*weights)[i] = bad;
            }
        }
        const VmfMixture poisoned = evaluate_one(layout, state);
        EXPECT_TRUE(std::isfinite(mixture_pdf(poisoned, Vec3(0, 0, 1))));
        EXPECT_TRUE(std::isfinite(poisoned.A));
        for (std::uint64_t pass = 0; pass < 4; ++pass) {
            trainer.train(state, make_records(pass + 10), pool);
        }
        if (!(std::abs(bad) < kInfinity)) {
            EXPECT_GT(state.generation, generation);
            EXPECT_TRUE(all_finite(state.published));
            // It has learned the light again.
            const VmfMixture learned = evaluate_one(layout, state);
            EXPECT_GT(mixture_pdf(learned, Vec3(0.6f, 0.0f, 0.8f)), 0.5f);
        }
        EXPECT_TRUE(std::isfinite(mixture_pdf(evaluate_one(layout, state), Vec3(0, 0, 1))));
    }
}

// A snapshot alone is spoiled: training goes on from good weights and replaces it.
TEST(NetworkState, SpoiledSnapshotIsReplaced) {
    const NetworkLayout layout = make_network_layout(GuidingConfig::slides());
    NetworkState state = make_network_state(layout, Bounds3{});
    Trainer trainer(layout);
    ThreadPool pool(2);
    trainer.train(state, make_records(1), pool);
    state.published.assign(state.published.size(), std::nanf(""));
    // Nearly uniform: what NaN becomes after the activations' limits.
    EXPECT_NEAR(mixture_pdf(evaluate_one(layout, state), Vec3(0, 0, 1)), 0.25f * kInvPi, 1e-3f);
    const TrainStatistics statistics = trainer.train(state, make_records(2), pool);
    EXPECT_TRUE(statistics.published);
    EXPECT_TRUE(all_finite(state.published));
}

}  // namespace
}  // namespace pharos
