#include "lights/light_selection.h"

namespace pharos {

LightSelection::LightSelection(std::span<const LightBound> bounds, const CancelFlag& cancel)
    : count_(static_cast<std::uint32_t>(bounds.size())) {
    if (count_ > kMaxEstimated) {
        tree_ = LightTree(bounds, cancel);
        return;
    }
    for (std::size_t i = 0; i < count_; ++i) {
        columns_.set(i, bounds[i]);
    }
}

void LightSelection::choose(std::span<LightQuery> queries) const {
    if (!tree_.empty()) {
        tree_.choose(queries);
        return;
    }
    for (LightQuery& query : queries) {
        query.choice = LightChoice{0, 1.0f, query.u_choice};
        if (count_ == 1) {
            continue;
        }
        LightColumns<kMaxEstimated>::Column weights;
        const float sum = columns_.estimate(query.context, count_, weights);
        query.choice =
            sum > 0.0f && sum < kInfinity
                ? choose_in_proportion(std::span(weights).first(count_), sum, query.u_choice)
                : LightChoice{};
    }
}

float LightSelection::pmf(const LightSampleContext& context, std::uint32_t group) const {
    if (count_ == 1) {
        return 1.0f;
    }
    if (!tree_.empty()) {
        return tree_.pmf(context, group);
    }
    LightColumns<kMaxEstimated>::Column weights;
    const float sum = columns_.estimate(context, count_, weights);
    return sum > 0.0f && sum < kInfinity ? weights[group] / sum : 0.0f;
}

}  // namespace pharos
