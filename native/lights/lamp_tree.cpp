#include "lights/lamp_tree.h"

#include <array>

namespace pharos {

namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr std::size_t kMaxDepth = 64;

// Slab test; grown a little, because a flat box has no thickness to absorb rounding.
bool meets(const Bounds3& b, const Ray& ray, const Vec3& inverse, float t_max) {
    float near = ray.t_min;
    float far = t_max;
    for (int axis = 0; axis < 3; ++axis) {
        const float a = (b.lower[axis] - ray.origin[axis]) * inverse[axis];
        const float c = (b.upper[axis] - ray.origin[axis]) * inverse[axis];
        // 0 * infinity: the origin lies on the slab's plane and the ray within it.
        if (std::isnan(a) || std::isnan(c)) {
            continue;
        }
        near = std::max(near, std::min(a, c));
        far = std::min(far, std::max(a, c));
    }
    return near * (1.0f - 1e-5f) <= far * (1.0f + 1e-5f);
}

}  // namespace

Bounds3 lamp_bounds(const Lamp& lamp) {
    Vec3 reach(lamp.radius);
    if (lamp.shape == LampShape::Rectangle || lamp.shape == LampShape::Ellipse) {
        reach = glm::abs(lamp.frame.x) * lamp.half_u + glm::abs(lamp.frame.y) * lamp.half_v;
    }
    const Vec3 margin = 1e-6f * (glm::abs(lamp.center) + reach);
    Bounds3 bounds;
    bounds.extend(lamp.center - reach - margin);
    bounds.extend(lamp.center + reach + margin);
    return bounds;
}

LampTree::LampTree(std::span<const Lamp> lamps) : lamps_(lamps) {
    for (std::uint32_t i = 0; i < lamps.size(); ++i) {
        if (lamps[i].hittable && !is_distant(lamps[i])) {
            order_.push_back(i);
        }
    }
    if (!order_.empty()) {
        build(0, static_cast<std::uint32_t>(order_.size()));
    }
}

// Median split of the longest axis of the centres; a balanced tree never outgrows the stack.
void LampTree::build(std::uint32_t first, std::uint32_t count) {
    const std::size_t node = nodes_.size();
    nodes_.emplace_back();
    Bounds3 bounds;
    Bounds3 centers;
    for (std::uint32_t i = first; i < first + count; ++i) {
        bounds.extend(lamp_bounds(lamps_[order_[i]]));
        centers.extend(lamps_[order_[i]].center);
    }
    nodes_[node].bounds = bounds;
    if (count <= kLeafSize) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    const Vec3 extent = centers.extent();
    const int axis =
        extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
    const std::uint32_t half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(
        begin, begin + half, begin + count, [this, axis](std::uint32_t a, std::uint32_t b) {
            const float ca = lamps_[a].center[axis];
            const float cb = lamps_[b].center[axis];
            return ca != cb ? ca < cb : a < b;
        });
    build(first, half);
    nodes_[node].first = static_cast<std::uint32_t>(nodes_.size());
    build(first + half, count - half);
}

std::optional<LampTree::Nearest> LampTree::intersect(const Ray& ray,
                                                     const LightSampleContext* context) const {
    std::optional<Nearest> nearest;
    if (nodes_.empty()) {
        return nearest;
    }
    Ray rest = ray;
    const Vec3 inverse = 1.0f / ray.direction;
    std::array<std::uint32_t, kMaxDepth> stack;
    std::size_t size = 0;
    stack[size++] = 0;
    while (size > 0) {
        const std::uint32_t index = stack[--size];
        const Node& node = nodes_[index];
        if (nodes_.size() > 1 && !meets(node.bounds, ray, inverse, rest.t_max)) {
            continue;
        }
        if (node.count == 0) {
            stack[size++] = node.first;
            stack[size++] = index + 1;
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            if (const auto hit = hit_lamp(lamps_[order_[i]], rest, context)) {
                rest.t_max = hit->t;
                nearest = Nearest{*hit, order_[i]};
            }
        }
    }
    return nearest;
}

}  // namespace pharos
