// Many lights: a tree over their bounds, eight children a node, descended by the estimate of each
// child's irradiance at the receiver (Conty Estevez and Kulla 2018). Choosing among ten thousand
// costs five nodes. The probability of a given light is found along its stored path.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lights/light_columns.h"

namespace pharos {

// Light `index` was chosen with probability `pmf`; `u` is what is left of the random number.
struct LightChoice {
    std::uint32_t group = 0;
    float pmf = 0.0f;
    double u = 0.0;
};

// One step: an entry in proportion to its weight, and the rest of u. sum > 0.
[[nodiscard]] LightChoice choose_in_proportion(std::span<const float> weights, float sum, double u);

class LightTree {
  public:
    LightTree() = default;
    explicit LightTree(std::span<const LightBound> bounds);

    [[nodiscard]] bool empty() const { return nodes_.empty(); }

    // nullopt: where it went nothing arrives.
    [[nodiscard]] std::optional<LightChoice> choose(const LightSampleContext& context,
                                                    double u) const;

    [[nodiscard]] float pmf(const LightSampleContext& context, std::uint32_t light) const;

  private:
    static constexpr std::size_t kWidth = 8;
    static constexpr std::uint32_t kRoot = 0;

    struct Slot {
        std::uint32_t node = 0;
        std::uint32_t entry = 0;
    };

    struct Child {
        std::uint32_t index = 0;
        bool leaf = false;  // index is a light, else a node
    };

    struct Node {
        LightColumns<kWidth> columns;
        std::array<Child, kWidth> children{};
        std::uint32_t count = 0;
        Slot parent;  // of any but the root
    };

    struct Range {
        std::uint32_t first = 0;
        std::uint32_t count = 0;
    };

    std::uint32_t build(std::span<const LightBound> bounds,
                        std::span<std::uint32_t> order,
                        Slot parent);

    std::vector<Node> nodes_;
    std::vector<Slot> slot_;  // by light
};

}  // namespace pharos
