#include "session/guide_budget.h"

#include <algorithm>
#include <numeric>

namespace pharos {

namespace {

constexpr double kRecordsShare = 0.5;  // of the budget, where vertices and records compete
// Before anything was counted: what a path of a closed room has, far from the camera's scattering.
constexpr double kUnknownVertices = 5.0;
constexpr std::uint32_t kUnprovenOfRank = 3;  // rank % 4 of vertices that nothing speaks for

[[nodiscard]] bool is_guided(std::uint32_t rank, const GuideWish& wish) {
    return rank % 4 == kUnprovenOfRank ? wish.guides_unproven : wish.guides_proven;
}

[[nodiscard]] GuideRates or_unknown(const GuideRates& rates) {
    if (rates.vertices > 0.0) {
        return rates;
    }
    GuideRates unknown;
    unknown.vertices = kUnknownVertices;
    for (std::uint32_t bounce = 0; bounce < static_cast<std::uint32_t>(kUnknownVertices);
         ++bounce) {
        unknown.demand[guide_rank(bounce, 0.0f)] = 1.0;
    }
    return unknown;
}

// Ranks one after the other, a vertex at `cost`, as far as `seconds` reach; what it takes.
double fill_ranks(const GuideRates& rates,
                  const GuideWish& wish,
                  double cost,
                  double seconds,
                  GuideLimit& limit) {
    double spent = 0.0;
    for (std::uint32_t rank = 0; rank < kGuideRanks; ++rank) {
        const double all = is_guided(rank, wish) ? rates.demand[rank] * cost : 0.0;
        if (spent + all > seconds) {
            limit.whole = rank;
            limit.part = static_cast<float>((seconds - spent) / all);
            return seconds;
        }
        spent += all;
    }
    return spent;
}

}  // namespace

GuidePlan plan_guide(const GuideBudget& budget, const GuideRates& counted, const GuideWish& wish) {
    GuidePlan plan;
    plan.record_probability = wish.record_probability;
    plan.visits = wish.visits;
    if (!budget.limited() || wish.pixels == 0) {
        return plan;
    }
    // All of the following is of one path.
    const GuideRates rates = or_unknown(counted);
    const auto paths = static_cast<double>(wish.pixels);
    const double frames = std::max(1.0, paths * rates.vertices * budget.vertex / budget.frame);
    const double allowed = budget.guide * frames / paths;
    const double recorded = static_cast<double>(wish.record_probability) *
                            std::accumulate(rates.demand.begin(), rates.demand.end(), 0.0);
    const double visits = std::max(recorded,
                                   std::min(static_cast<double>(wish.visits) / paths,
                                            static_cast<double>(kMaxVisitsOfRecord) * recorded));
    const double records = recorded * budget.costs.vertex + visits * budget.costs.record;
    // Vertices of recorded paths are asked about as it is.
    const auto vertex_cost = [&](float probability) {
        return (1.0 - static_cast<double>(probability)) * budget.costs.vertex;
    };
    GuideLimit none;
    const double guided = fill_ranks(rates,
                                     wish,
                                     vertex_cost(wish.record_probability),
                                     std::numeric_limits<double>::infinity(),
                                     none);
    if (records + guided <= allowed) {
        return plan;
    }
    const double for_records =
        std::min(records, std::max(kRecordsShare * allowed, allowed - guided));
    if (for_records < records) {
        const double once = recorded * (budget.costs.vertex + budget.costs.record);
        plan.record_probability *= static_cast<float>(std::min(1.0, for_records / once));
        plan.visits = static_cast<std::size_t>(paths * for_records / budget.costs.record);
    }
    const double for_vertices = fill_ranks(
        rates, wish, vertex_cost(plan.record_probability), allowed - for_records, plan.limit);
    plan.fitting = (for_records + for_vertices) / (records + guided);
    return plan;
}

}  // namespace pharos
