#include "lights/lamp_tree.h"

#include <algorithm>
#include <bit>

#include <immintrin.h>

#include "core/check.h"

namespace pharos {

namespace {

constexpr std::size_t kFewLamps = 4;
// Halved ranges fill a stack of seven siblings a level.
constexpr std::size_t kStackSize = 96;
// Boxes are grown a little, because a flat one has no thickness to absorb rounding.
constexpr float kGrown = 1e-5f;

// The lamps of the lower half of the longest axis of their centres come first.
void split_at_median(std::span<const Lamp> lamps, std::span<std::uint32_t> order) {
    Bounds3 centers;
    for (const std::uint32_t lamp : order) {
        centers.extend(lamps[lamp].center);
    }
    const Vec3 extent = centers.extent();
    const int axis =
        extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    std::nth_element(
        order.begin(), middle, order.end(), [&lamps, axis](std::uint32_t a, std::uint32_t b) {
            const float ca = lamps[a].center[axis];
            const float cb = lamps[b].center[axis];
            return ca != cb ? ca < cb : a < b;
        });
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

LampTree::LampTree(std::span<const Lamp> lamps, const CancelFlag& cancel) : lamps_(lamps) {
    for (std::uint32_t i = 0; i < lamps.size(); ++i) {
        if (lamps[i].hittable && !is_distant(lamps[i])) {
            order_.push_back(i);
        }
    }
    if (order_.size() > kFewLamps) {
        build(order_, cancel);
    }
}

// Returns the new node's index. Median splits of the longest axis of the centres.
std::uint32_t LampTree::build(std::span<std::uint32_t> order, const CancelFlag& cancel) {
    throw_if_cancelled(cancel);
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    for (auto& plane : nodes_[index].planes) {
        // Empty by its lower planes; the upper ones are as far below.
        plane.fill(&plane < &nodes_[index].planes[3] ? kInfinity : -kInfinity);
    }
    std::vector<std::span<std::uint32_t>> parts{order};
    while (parts.size() < kWidth) {
        const auto largest = std::ranges::max_element(
            parts, {}, [](const std::span<std::uint32_t>& part) { return part.size(); });
        if (largest->size() < 2) {
            break;
        }
        const std::span<std::uint32_t> whole = *largest;
        const std::size_t half = whole.size() / 2;
        split_at_median(lamps_, whole);
        *largest = whole.first(half);
        parts.push_back(whole.subspan(half));
    }
    for (std::size_t child = 0; child < parts.size(); ++child) {
        set_box(index, child, parts[child]);
        const std::uint32_t entry =
            parts[child].size() == 1 ? (parts[child][0] | kLeaf) : build(parts[child], cancel);
        nodes_[index].children[child] = entry;
    }
    return index;
}

void LampTree::set_box(std::uint32_t node,
                       std::size_t child,
                       std::span<const std::uint32_t> order) {
    Bounds3 box;
    for (const std::uint32_t lamp : order) {
        box.extend(lamp_bounds(lamps_[lamp]));
    }
    for (int axis = 0; axis < 3; ++axis) {
        const auto plane = static_cast<std::size_t>(axis);
        nodes_[node].planes[plane][child] = box.lower[axis];
        nodes_[node].planes[plane + 3][child] = box.upper[axis];
    }
}

// A ray as the boxes are tested against it.
struct LampTree::Slabs {
    struct Lanes {
        __m256 v;
    };

    std::array<Lanes, 3> origin;  // of each axis, in all lanes
    std::array<Lanes, 3> inverse;
    std::array<std::size_t, 3> near_plane;
    std::array<std::size_t, 3> far_plane;
    __m256 t_min;

    explicit Slabs(const Ray& ray) : t_min(_mm256_set1_ps(ray.t_min)) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float inverse_axis = 1.0f / ray.direction[static_cast<int>(axis)];
            origin[axis].v = _mm256_set1_ps(ray.origin[static_cast<int>(axis)]);
            inverse[axis].v = _mm256_set1_ps(inverse_axis);
            near_plane[axis] = inverse_axis < 0.0f ? axis + 3 : axis;
            far_plane[axis] = inverse_axis < 0.0f ? axis : axis + 3;
        }
    }
};

// A bit for each child whose box the ray meets.
unsigned LampTree::met_children(const Node& node, const Slabs& slabs, float t_max) {
    __m256 near = slabs.t_min;
    __m256 far = _mm256_set1_ps(t_max);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto distance_to = [&](std::size_t plane) {
            return _mm256_mul_ps(
                _mm256_sub_ps(_mm256_load_ps(node.planes[plane].data()), slabs.origin[axis].v),
                slabs.inverse[axis].v);
        };
        // 0 * infinity is no number: the ray lies within that plane, and the second operand stays.
        near = _mm256_max_ps(distance_to(slabs.near_plane[axis]), near);
        far = _mm256_min_ps(distance_to(slabs.far_plane[axis]), far);
    }
    near = _mm256_mul_ps(near, _mm256_set1_ps(1.0f - kGrown));
    far = _mm256_mul_ps(far, _mm256_set1_ps(1.0f + kGrown));
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(near, far, _CMP_LE_OQ)));
}

// How far one ray has come.
struct LampTree::Search {
    Ray rest;  // up to the nearest lamp so far
    std::optional<Nearest> nearest;
    Slabs slabs;
    std::size_t waiting = 1;  // of the stack: the root
    std::array<std::uint32_t, kStackSize> stack;

    explicit Search(const Ray& ray) : rest(ray), slabs(ray) { stack[0] = 0; }
};

void LampTree::meet(std::uint32_t lamp, const LightSampleContext* context, Search& search) const {
    if (const auto hit = hit_lamp(lamps_[lamp], search.rest, context)) {
        search.rest.t_max = hit->t;
        search.nearest = Nearest{*hit, lamp};
    }
}

void LampTree::prefetch(std::uint32_t node) const {
    const auto* first = reinterpret_cast<const char*>(&nodes_[node]);
    for (std::size_t line = 0; line < sizeof(Node); line += 64) {
        __builtin_prefetch(first + line);
    }
}

// The last of the nodes that wait.
void LampTree::visit_one(const LightSampleContext* context, Search& search) const {
    const Node& node = nodes_[search.stack[--search.waiting]];
    for (unsigned met = met_children(node, search.slabs, search.rest.t_max); met != 0;
         met &= met - 1) {
        const std::uint32_t child = node.children[static_cast<std::size_t>(std::countr_zero(met))];
        if ((child & kLeaf) != 0) {
            meet(child & ~kLeaf, context, search);
        } else {
            prefetch(child);
            search.stack[search.waiting++] = child;
        }
    }
}

std::optional<LampTree::Nearest> LampTree::intersect(const Ray& ray,
                                                     const LightSampleContext* context) const {
    std::optional<Nearest> nearest;
    const LampRay one{ray, context};
    intersect(std::span(&one, 1), std::span(&nearest, 1));
    return nearest;
}

void LampTree::intersect(std::span<const LampRay> rays,
                         std::span<std::optional<Nearest>> nearest) const {
    if (nodes_.empty()) {
        for (std::size_t i = 0; i < rays.size(); ++i) {
            nearest[i].reset();
            Ray rest = rays[i].ray;
            for (const std::uint32_t lamp : order_) {
                if (const auto hit = hit_lamp(lamps_[lamp], rest, rays[i].context)) {
                    rest.t_max = hit->t;
                    nearest[i] = Nearest{*hit, lamp};
                }
            }
        }
        return;
    }
    DCHECK(rays.size() <= kTogether);
    std::array<std::optional<Search>, kTogether> searches;
    std::array<std::size_t, kTogether> under_way;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        searches[i].emplace(rays[i].ray);
        under_way[i] = i;
    }
    for (std::size_t count = rays.size(); count > 0;) {
        std::size_t kept = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t i = under_way[k];
            visit_one(rays[i].context, *searches[i]);
            if (searches[i]->waiting > 0) {
                under_way[kept++] = i;
            }
        }
        count = kept;
    }
    for (std::size_t i = 0; i < rays.size(); ++i) {
        nearest[i] = searches[i]->nearest;
    }
}

}  // namespace pharos
