#include "sampling/alias_table.h"

namespace pharos {

AliasTable::AliasTable(std::span<const float> weights) : slots_(weights.size()) {
    const std::size_t count = weights.size();
    std::vector<double> scaled(count);  // weight / mean
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const bool usable = std::isfinite(weights[i]) && weights[i] > 0.0f;
        scaled[i] = usable ? static_cast<double>(weights[i]) : 0.0;
        sum += scaled[i];
    }
    std::vector<std::uint32_t> small;
    std::vector<std::uint32_t> large;
    for (std::size_t i = 0; i < count; ++i) {
        const auto n = static_cast<double>(count);
        scaled[i] = sum > 0.0 ? scaled[i] / sum * n : 1.0;
        slots_[i].pmf = static_cast<float>(scaled[i] / n);
        (scaled[i] < 1.0 ? small : large).push_back(static_cast<std::uint32_t>(i));
    }
    // Each under-full slot is topped up from an over-full one.
    while (!small.empty() && !large.empty()) {
        const std::uint32_t below = small.back();
        const std::uint32_t above = large.back();
        small.pop_back();
        slots_[below].keep = static_cast<float>(scaled[below]);
        slots_[below].alias = above;
        scaled[above] -= 1.0 - scaled[below];
        if (scaled[above] < 1.0) {
            large.pop_back();
            small.push_back(above);
        }
    }
    // What is left is full but for rounding: keep stays 1.
}

}  // namespace pharos
