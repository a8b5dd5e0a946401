#include "lights/light_selection.h"

namespace pharos {

LightSelection::LightSelection(std::span<const LightBound> bounds)
    : count_(static_cast<std::uint32_t>(bounds.size())) {
    if (count_ > kMaxEstimated) {
        tree_ = LightTree(bounds);
        return;
    }
    for (std::size_t i = 0; i < count_; ++i) {
        columns_.set(i, bounds[i]);
    }
}

std::optional<LightChoice> LightSelection::choose(const LightSampleContext& context,
                                                  double u) const {
    if (count_ == 1) {
        return LightChoice{0, 1.0f, u};
    }
    if (!tree_.empty()) {
        return tree_.choose(context, u);
    }
    LightColumns<kMaxEstimated>::Column weights;
    const float sum = columns_.estimate(context, count_, weights);
    if (!(sum > 0.0f && sum < kInfinity)) {
        return std::nullopt;
    }
    return choose_in_proportion(std::span(weights).first(count_), sum, u);
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
