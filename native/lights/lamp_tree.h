// Which lamps a ray may meet: a small bounding volume hierarchy over lamps with a surface, eight
// boxes a node, so that thousands of them cost a ray about as much as a few.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "lights/lamp.h"
#include "lights/light_sampler.h"

namespace pharos {

[[nodiscard]] Bounds3 lamp_bounds(const Lamp& lamp);  // of its surface; not for distant lamps

class LampTree {
  public:
    LampTree() = default;

    // Over the hittable local lamps of `lamps`, which must outlive the tree and stay where they
    // are. Throws Cancelled.
    explicit LampTree(std::span<const Lamp> lamps, const CancelFlag& cancel = {});

    [[nodiscard]] bool empty() const { return order_.empty(); }

    struct Nearest {
        LampHit hit;
        std::uint32_t lamp = 0;
    };

    [[nodiscard]] std::optional<Nearest> intersect(const Ray& ray,
                                                   const LightSampleContext* context) const;

    // Of up to kTogether rays, which go down together, so that none waits for memory.
    static constexpr std::size_t kTogether = 16;
    void intersect(std::span<const LampRay> rays, std::span<std::optional<Nearest>> nearest) const;

  private:
    static constexpr std::size_t kWidth = 8;
    static constexpr std::uint32_t kLeaf = 0x80000000u;  // of a child: a lamp, else a node

    struct alignas(32) Node {
        // Lower x, y, z and upper x, y, z of each child's box; unused children have an empty one.
        std::array<std::array<float, kWidth>, 6> planes{};
        std::array<std::uint32_t, kWidth> children{};  // index, with kLeaf or without
    };

    struct Slabs;
    struct Search;

    std::uint32_t build(std::span<std::uint32_t> order, const CancelFlag& cancel);
    void set_box(std::uint32_t node, std::size_t child, std::span<const std::uint32_t> order);
    void prefetch(std::uint32_t node) const;
    void meet(std::uint32_t lamp, const LightSampleContext* context, Search& search) const;
    [[nodiscard]] static unsigned met_children(const Node& node, const Slabs& slabs, float t_max);
    void visit_one(const LightSampleContext* context, Search& search) const;

    std::span<const Lamp> lamps_;
    std::vector<std::uint32_t> order_;  // the lamps in the tree
    std::vector<Node> nodes_;           // none for a few lamps: all of them are asked
};

}  // namespace pharos
