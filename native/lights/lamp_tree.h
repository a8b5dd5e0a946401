// Which lamps a ray may meet: a small bounding volume hierarchy over lamps with a surface, so that
// thousands of them cost a ray about as much as a few.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lights/lamp.h"

namespace pharos {

[[nodiscard]] Bounds3 lamp_bounds(const Lamp& lamp);  // of its surface; not for distant lamps

class LampTree {
  public:
    LampTree() = default;

    // Over the hittable local lamps of `lamps`, which must outlive the tree and stay where they
    // are.
    explicit LampTree(std::span<const Lamp> lamps);

    [[nodiscard]] bool empty() const { return nodes_.empty(); }

    struct Nearest {
        LampHit hit;
        std::uint32_t lamp = 0;
    };

    [[nodiscard]] std::optional<Nearest> intersect(const Ray& ray,
                                                   const LightSampleContext* context) const;

  private:
    struct Node {
        Bounds3 bounds;
        std::uint32_t first = 0;  // leaf: into order_; inner: its second child (the first follows)
        std::uint32_t count = 0;  // 0: inner
    };

    void build(std::uint32_t first, std::uint32_t count);

    std::span<const Lamp> lamps_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace pharos
