// What fits into a frame: records and vertices are counted, first bounces and proven regions come
// first, and a picture whose guide is limited keeps its mean.
#include "session/guide_budget.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "integrator/integrator.h"
#include "session/guide_controller.h"
#include "support/test_scenes.h"
#include "support/timing.h"

namespace pharos {
namespace {

using namespace pharos::testing;

constexpr GuideCosts kCosts{1e-7, 4e-7};
constexpr std::uint64_t kPixels = 100000;

GuideRates some_rates() {
    GuideRates rates;
    rates.vertices = 5.0;
    for (std::uint32_t bounce = 0; bounce < 5; ++bounce) {
        rates.demand[guide_rank(bounce, 0.75f)] = 0.25;
        rates.demand[guide_rank(bounce, 0.25f)] = 0.25;
        rates.demand[guide_rank(bounce, 0.0f)] = 0.5;
    }
    return rates;
}

GuideWish all_of_it() {
    return {kPixels, 0.5f, true, true};
}

GuideBudget frame_of(double seconds) {
    GuideBudget budget;
    budget.guide = seconds;
    budget.costs = kCosts;
    return budget;
}

// Seconds of a pass that follows the plan.
double cost_of(const GuidePlan& plan, const GuideRates& rates) {
    double served = 0.0;
    double all = 0.0;
    for (std::uint32_t rank = 0; rank < kGuideRanks; ++rank) {
        all += rates.demand[rank];
        served += rank < plan.limit.whole ? rates.demand[rank]
                  : rank == plan.limit.whole
                      ? rates.demand[rank] * static_cast<double>(plan.limit.part)
                      : 0.0;
    }
    const auto recorded = static_cast<double>(plan.record_probability);
    const double asked = recorded * all + (1.0 - recorded) * served;
    return kPixels * (asked * kCosts.vertex + recorded * all * kCosts.record);
}

TEST(GuideBudget, WithoutOneNothingIsLeftOut) {
    const GuidePlan plan = plan_guide(GuideBudget{}, some_rates(), all_of_it());
    EXPECT_FALSE(plan.limit.active());
    EXPECT_EQ(plan.record_probability, 0.5f);
    EXPECT_EQ(plan.fitting, 1.0);
    EXPECT_EQ(plan_guide(frame_of(1.0), some_rates(), all_of_it()).fitting, 1.0);
}

TEST(GuideBudget, IsSpentAndNotExceeded) {
    const GuideRates rates = some_rates();
    const double all = cost_of(plan_guide(GuideBudget{}, rates, all_of_it()), rates);
    for (const double part : {0.9, 0.5, 0.2, 0.05, 0.001}) {
        const GuidePlan plan = plan_guide(frame_of(part * all), rates, all_of_it());
        EXPECT_NEAR(cost_of(plan, rates) / (part * all), 1.0, 1e-3) << part;
        EXPECT_LT(plan.fitting, 1.0);
        EXPECT_LE(static_cast<double>(plan.visits) * kCosts.record, part * all);
    }
}

TEST(GuideBudget, FirstBouncesAndProvenRegionsComeFirst) {
    EXPECT_LT(guide_rank(0, 0.75f), guide_rank(0, 0.25f));
    EXPECT_LT(guide_rank(0, 0.25f), guide_rank(0, 0.0f));
    EXPECT_LT(guide_rank(0, 0.0f), guide_rank(1, 0.75f));
    EXPECT_LT(guide_rank(1000, 0.0f), kGuideRanks);
    GuideLimit limit;
    limit.whole = guide_rank(1, 0.25f);
    limit.part = 0.5f;
    EXPECT_TRUE(limit.admits(guide_rank(1, 0.5f), 0xffffffffu));
    EXPECT_TRUE(limit.admits(guide_rank(1, 0.25f), 0x7fffffffu));
    EXPECT_FALSE(limit.admits(guide_rank(1, 0.25f), 0x80000000u));
    EXPECT_FALSE(limit.admits(guide_rank(1, 0.0f), 0u));
}

// A sample that takes as long as four redraws has four frames' budgets.
TEST(GuideBudget, GrowsWithTheRedrawsOfASample) {
    GuideBudget budget = frame_of(0.01);
    budget.vertex = 1e-6;
    budget.frame = kPixels * some_rates().vertices * budget.vertex / 4.0;
    const GuidePlan plan = plan_guide(budget, some_rates(), all_of_it());
    EXPECT_NEAR(cost_of(plan, some_rates()), 0.04, 1e-4);
}

struct Learned {
    double mean = 0.0;         // of the picture
    double first = 0.0;        // most counted seconds of a pass while splitting starts
    double most = 0.0;         // and after that
    double last = 0.0;         // and of the last
    double fitting = 1.0;      // of the last
    std::uint64_t guided = 0;  // vertices asked about
};

// Passes of one sample, with a guide that learns within a budget.
Learned learn(const SceneDescription& description, std::uint32_t samples, double seconds) {
    const FilmDescription frame = description.film;
    const CancelFlag cancel;
    SceneReport report;
    const auto scene = build_scene(SceneDescription(description), cancel, report);
    ThreadPool pool(2);
    Integrator integrator(*scene, pool);
    SharedFilm film(frame);
    const std::uint64_t pixels = std::uint64_t{frame.crop_width} * frame.crop_height;
    GuideController guide(GuidingMode::Neural, scene->bounds, pixels);
    guide.set_budget(frame_of(seconds));
    Learned out;
    for (std::uint32_t i = 0; i < samples; ++i) {
        const BatchStatistics before = integrator.statistics();
        PassSettings pass{i, 1};
        pass.weight = guide.weight(i);
        EXPECT_TRUE(integrator.render_pass(pass, guide.next_pass(), film, {cancel, {}}));
        guide.see(film.film, i + 1);
        BatchStatistics after = integrator.statistics();
        BatchStatistics earlier = before;
        const std::uint64_t asked =
            after[Stage::QueryGuidingField].items - earlier[Stage::QueryGuidingField].items;
        RecordBuffer records = integrator.take_records();
        out.last = static_cast<double>(asked) * kCosts.vertex +
                   static_cast<double>(records.radiance.size()) * kCosts.record;
        double& most = i < 5 ? out.first : out.most;
        most = std::max(most, out.last);
        out.guided += asked;
        SelectionPass work;
        work.paths = static_cast<double>(after.camera_samples - before.camera_samples);
        work.vertices = static_cast<double>(after.vertices - before.vertices);
        if (guide.learning()) {
            guide.learn(std::move(records), work, film.film, pool);
        } else {
            guide.rest();
        }
        out.fitting = std::min(out.fitting, guide.status().fitting);
    }
    std::vector<float> picture(std::size_t{4} * pixels);
    film.film.read(FilmPass::Combined, picture);
    for (std::size_t i = 0; i < picture.size(); i += 4) {
        out.mean += static_cast<double>(picture[i]) / static_cast<double>(pixels);
    }
    return out;
}

TEST(GuideBudget, PassesStayWithinIt) {
    const SceneDescription description = two_rooms(96, 72, 1);
    const Learned without = learn(description, 12, std::numeric_limits<double>::infinity());
    const double budget = 0.25 * without.most;
    const Learned within = learn(description, 12, budget);
    EXPECT_EQ(without.fitting, 1.0);
    EXPECT_LT(within.fitting, 0.5);
    EXPECT_GT(within.guided, 0u);
    // What a pass will ask for is foreseen from the one before.
    EXPECT_LT(within.first, 1.5 * budget);
    EXPECT_LT(within.most, 1.1 * budget);
    EXPECT_GT(within.last, 0.5 * budget);
}

TEST(GuideBudgetStatistics, ALimitedGuideKeepsTheClosedForm) {
    SceneDescription description = emitting_box(48, 32);
    const double exact = exact_radiance(description.settings.max_bounces);
    const Learned within = learn(description, 256, 2e-4);
    EXPECT_LT(within.fitting, 0.5);
    EXPECT_NEAR(within.mean / exact, 1.0, 2e-3);
}

}  // namespace
}  // namespace pharos
