#include "lights/light_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace pharos {

namespace {

constexpr std::size_t kBins = 16;

using Order = std::span<std::uint32_t>;

Bounds3 box_of(std::span<const LightBound> bounds, Order order) {
    Bounds3 box;
    for (const std::uint32_t i : order) {
        box.extend(bounds[i].center);
    }
    return box;
}

float surface(const Bounds3& box) {
    const Vec3 e = box.extent();
    return box.empty() ? 0.0f : e.x * e.y + e.y * e.z + e.z * e.x + 1e-20f;
}

// Bins of centers along the longest axis.
struct Binning {
    int axis = 0;
    float lower = 0.0f;
    float scale = 0.0f;

    explicit Binning(const Bounds3& box) {
        const Vec3 e = box.extent();
        axis = e.x >= e.y && e.x >= e.z ? 0 : (e.y >= e.z ? 1 : 2);
        lower = box.lower[axis];
        scale = e[axis] > 0.0f ? static_cast<float>(kBins) / e[axis] : 0.0f;
    }

    [[nodiscard]] std::size_t of(const LightBound& bound) const {
        const float x = (bound.center[axis] - lower) * scale;
        return std::min(static_cast<std::size_t>(std::max(x, 0.0f)), kBins - 1);
    }
};

// The last bin of the left part, where strength times surface of both parts is least.
std::size_t best_split(std::span<const LightBound> bounds, Order order, const Binning& binning) {
    std::array<Bounds3, kBins> box;
    std::array<float, kBins> strength{};
    for (const std::uint32_t i : order) {
        const std::size_t bin = binning.of(bounds[i]);
        box[bin].extend(bounds[i].center);
        strength[bin] += bounds[i].strength;
    }
    std::array<float, kBins> right_cost{};
    Bounds3 all;
    float sum = 0.0f;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
        all.extend(box[bin]);
        sum += strength[bin];
        right_cost[bin] = surface(all) * sum;
    }
    std::size_t best = 0;
    float least = kInfinity;
    all = Bounds3();
    sum = 0.0f;
    for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
        all.extend(box[bin]);
        sum += strength[bin];
        const float cost = surface(all) * sum + right_cost[bin + 1];
        if (cost < least) {
            least = cost;
            best = bin;
        }
    }
    return best;
}

std::vector<LightBound> members_of(std::span<const LightBound> bounds, Order order) {
    std::vector<LightBound> members;
    members.reserve(order.size());
    for (const std::uint32_t i : order) {
        members.push_back(bounds[i]);
    }
    return members;
}

// Reorders; both parts have one light at least.
std::size_t split(std::span<const LightBound> bounds, Order order) {
    const Binning binning(box_of(bounds, order));
    if (binning.scale > 0.0f && binning.scale < kInfinity) {
        const std::size_t last = best_split(bounds, order, binning);
        const auto middle = std::stable_partition(order.begin(), order.end(), [&](std::uint32_t i) {
            return binning.of(bounds[i]) <= last;
        });
        const auto left = static_cast<std::size_t>(middle - order.begin());
        if (left > 0 && left < order.size()) {
            return left;
        }
    }
    return order.size() / 2;
}

// Weights are floats: a sum beyond has one among them that is not finite.
constexpr double kLargestSum = 8.0 * static_cast<double>(std::numeric_limits<float>::max());

using Sums = std::array<double, LeanColumns::kWidth>;

// Of the weights up to each, itself included; exact enough that the choice has the probabilities
// that are told. In pairs, which do not wait for each other.
Sums sums_of(const LeanColumns::Column& weights) {
    std::array<double, LeanColumns::kWidth> w;
    for (std::size_t i = 0; i < w.size(); ++i) {
        w[i] = static_cast<double>(weights[i]);
    }
    const double two = w[0] + w[1];
    const double four = two + (w[2] + w[3]);
    const double six = four + (w[4] + w[5]);
    return {w[0], two, two + w[2], four, four + w[4], six, six + w[6], six + (w[6] + w[7])};
}

// The entry that `at`, below the last of the sums, falls into.
std::size_t entry_at(const LeanColumns::Column& weights, const Sums& sums, double at) {
    std::size_t entry = 0;
    for (std::size_t i = 0; i + 1 < sums.size(); ++i) {
        entry += at >= sums[i] ? 1 : 0;
    }
    // Rounding may run past the end: the last possible entry is kept then.
    while (!(weights[entry] > 0.0f)) {
        --entry;
    }
    return entry;
}

}  // namespace

LightChoice choose_in_proportion(std::span<const float> weights, float sum, double u) {
    double rest = u * static_cast<double>(sum);
    LightChoice choice;
    for (std::uint32_t i = 0; i < weights.size(); ++i) {
        const auto weight = static_cast<double>(weights[i]);
        if (weight > 0.0) {
            // Rounding may run past the end: the last possible entry is kept then.
            choice = {i, weights[i] / sum, std::min(rest / weight, 0x1.fffffffffffffp-1)};
            if (rest < weight) {
                break;
            }
        }
        rest -= weight;
    }
    return choice;
}

LightTree::LightTree(std::span<const LightBound> bounds, const CancelFlag& cancel)
    : slot_(bounds.size()) {
    const Input input{bounds, cancel};
    // Distances mean nothing to distant lights: the two kinds meet at the root only.
    std::vector<std::uint32_t> order(bounds.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto middle = std::stable_partition(order.begin(), order.end(), [&](std::uint32_t i) {
        return bounds[i].distance == EmitterDistance::Local;
    });
    const auto local = static_cast<std::size_t>(middle - order.begin());
    const std::array<Order, 2> parts = {Order(order).first(local), Order(order).subspan(local)};
    if (parts[0].empty() || parts[1].empty()) {
        build(input, order, {});
        return;
    }
    nodes_.emplace_back();
    std::vector<LightBound> merged;
    for (std::uint32_t entry = 0; entry < 2; ++entry) {
        merged.push_back(merge_bounds(members_of(bounds, parts[entry])));
        const std::uint32_t child = build(input, parts[entry], {kRoot, entry});
        nodes_[kRoot].children[entry] = child;
    }
    set_bounds(nodes_[kRoot], merged);
}

// Returns the index of the new node.
std::uint32_t LightTree::build(const Input& input, Order order, Slot parent) {
    const std::span<const LightBound> bounds = input.bounds;
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    nodes_[index].parent = parent;
    std::vector<Order> parts{order};
    while (parts.size() < kWidth) {
        const auto largest = std::ranges::max_element(parts, {}, &Order::size);
        if (largest->size() < 2) {
            break;
        }
        throw_if_cancelled(input.cancel);
        const Order whole = *largest;
        const std::size_t left = split(bounds, whole);
        *largest = whole.first(left);
        parts.push_back(whole.subspan(left));
    }
    std::vector<LightBound> merged;
    for (std::uint32_t entry = 0; entry < parts.size(); ++entry) {
        const Order part = parts[entry];
        if (part.size() == 1) {
            nodes_[index].children[entry] = part[0] | kLeaf;
            slot_[part[0]] = {index, entry};
            merged.push_back(bounds[part[0]]);
            continue;
        }
        merged.push_back(merge_bounds(members_of(bounds, part)));
        const std::uint32_t child = build(input, part, {index, entry});
        nodes_[index].children[entry] = child;
    }
    set_bounds(nodes_[index], merged);
    return index;
}

void LightTree::set_bounds(Node& node, std::span<const LightBound> bounds) {
    node.count = static_cast<std::uint32_t>(bounds.size());
    if (!std::ranges::all_of(bounds, LeanColumns::holds)) {
        node.wide = static_cast<std::uint32_t>(wide_.size());
        wide_.emplace_back();
    }
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        if (node.wide == kNone) {
            node.columns.set(i, bounds[i]);
        } else {
            wide_[node.wide].set(i, bounds[i]);
        }
    }
}

void LightTree::estimate(const Node& node,
                         const LightSampleContext& context,
                         LeanColumns::Column& weights) const {
    if (node.wide == kNone) {
        node.columns.estimate(context, weights);
    } else {
        static_cast<void>(wide_[node.wide].estimate(context, kWidth, weights));
    }
}

// One step down: the child, kNone where nothing arrives.
std::uint32_t LightTree::choose_child(const LightSampleContext& context, Descent& at) const {
    const Node& node = nodes_[at.node];
    LeanColumns::Column weights;
    estimate(node, context, weights);
    const Sums sums = sums_of(weights);
    if (!(sums.back() > 0.0 && sums.back() < kLargestSum)) {
        return kNone;
    }
    const double place = at.u * sums.back();
    const std::size_t entry = entry_at(weights, sums, place);
    const double before = entry == 0 ? 0.0 : sums[entry - 1];
    const auto weight = static_cast<double>(weights[entry]);
    at.u = std::clamp((place - before) / weight, 0.0, 0x1.fffffffffffffp-1);
    at.pmf *= weight / sums.back();
    return node.children[entry];
}

void LightTree::prefetch(std::uint32_t node) const {
    const auto* first = reinterpret_cast<const char*>(&nodes_[node]);
    for (std::size_t line = 0; line < sizeof(Node); line += 64) {
        __builtin_prefetch(first + line);
    }
}

void LightTree::choose(std::span<LightQuery> queries) const {
    constexpr std::size_t kTogether = 16;
    for (std::size_t first = 0; first < queries.size(); first += kTogether) {
        const auto part = queries.subspan(first, std::min(kTogether, queries.size() - first));
        std::array<Descent, kTogether> ways;
        std::array<std::size_t, kTogether> under_way;
        for (std::size_t i = 0; i < part.size(); ++i) {
            ways[i].u = part[i].u_choice;
            part[i].choice = LightChoice{};
            under_way[i] = i;
        }
        for (std::size_t count = part.size(); count > 0;) {
            std::size_t kept = 0;
            for (std::size_t k = 0; k < count; ++k) {
                const std::size_t i = under_way[k];
                const std::uint32_t child = choose_child(part[i].context, ways[i]);
                if (child != kNone && (child & kLeaf) == 0) {
                    prefetch(child);
                    ways[i].node = child;
                    under_way[kept++] = i;
                } else if (child != kNone) {
                    part[i].choice = {child & ~kLeaf, static_cast<float>(ways[i].pmf), ways[i].u};
                }
            }
            count = kept;
        }
    }
}

float LightTree::pmf(const LightSampleContext& context, std::uint32_t light) const {
    Slot at = slot_[light];
    double pmf = 1.0;
    while (true) {
        const Node& node = nodes_[at.node];
        LeanColumns::Column weights;
        estimate(node, context, weights);
        const double sum = sums_of(weights).back();
        if (!(sum > 0.0 && sum < kLargestSum)) {
            return 0.0f;
        }
        pmf *= static_cast<double>(weights[at.entry]) / sum;
        if (at.node == kRoot) {
            return static_cast<float>(pmf);
        }
        at = node.parent;
    }
}

}  // namespace pharos
