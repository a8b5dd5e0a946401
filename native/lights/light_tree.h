// Many lights: a tree over their bounds, eight children a node, descended by the estimate of each
// child's irradiance at the receiver (Conty Estevez and Kulla 2018). Choosing among ten thousand
// costs five nodes. Nodes of lights without spread and narrow cones, nearly all of them, know a
// cheaper estimate (lean_columns.h). The probability of a given light is found along its stored
// path.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "lights/lean_columns.h"
#include "lights/light_columns.h"

namespace pharos {

// One step: an entry in proportion to its weight, and the rest of u. sum > 0.
[[nodiscard]] LightChoice choose_in_proportion(std::span<const float> weights, float sum, double u);

class LightTree {
  public:
    LightTree() = default;
    // Throws Cancelled.
    explicit LightTree(std::span<const LightBound> bounds, const CancelFlag& cancel = {});

    [[nodiscard]] bool empty() const { return nodes_.empty(); }

    // Answers all queries, pmf 0 where the way led to where nothing arrives. Some of them descend
    // together, so that none waits for memory.
    void choose(std::span<LightQuery> queries) const;

    [[nodiscard]] float pmf(const LightSampleContext& context, std::uint32_t light) const;

  private:
    static constexpr std::size_t kWidth = LeanColumns::kWidth;
    static constexpr std::uint32_t kRoot = 0;
    static constexpr std::uint32_t kLeaf = 0x80000000u;  // of a child: a light, else a node

    struct Slot {
        std::uint32_t node = 0;
        std::uint32_t entry = 0;
    };

    struct Node {
        LeanColumns columns;
        std::array<std::uint32_t, kWidth> children{};  // index, with kLeaf or without
        std::uint32_t count = 0;
        std::uint32_t wide = kNone;  // of wide_, where columns does not hold all bounds
        Slot parent;                 // of any but the root
    };

    // A way down: the node it has come to.
    struct Descent {
        std::uint32_t node = kRoot;
        double u = 0.0;
        double pmf = 1.0;
    };

    struct Input {
        std::span<const LightBound> bounds;
        const CancelFlag& cancel;
    };

    std::uint32_t build(const Input& input, std::span<std::uint32_t> order, Slot parent);
    [[nodiscard]] std::uint32_t choose_child(const LightSampleContext& context, Descent& at) const;
    void prefetch(std::uint32_t node) const;
    void set_bounds(Node& node, std::span<const LightBound> bounds);
    void estimate(const Node& node,
                  const LightSampleContext& context,
                  LeanColumns::Column& weights) const;

    std::vector<Node> nodes_;
    std::vector<LightColumns<kWidth>> wide_;
    std::vector<Slot> slot_;  // by light
};

}  // namespace pharos
