#include "lights/emissive_triangles.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "core/color.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

// A group counts as flat when its normals agree this far.
constexpr float kFlatCosine = 0.999f;
// Facing tables look from infinity: they hold from this many bounding radii on.
constexpr float kFacingDistance = 2.5f;
constexpr std::size_t kMaxFacingGroups = 64;  // memory: beyond, the choice among groups must do
constexpr std::uint32_t kClusterTriangles = 16;
constexpr std::size_t kCancelPollInterval = 1u << 16;

Vec3 unit_normal(const Vec3& e1, const Vec3& e2) {
    return normalize_or(glm::cross(glm::normalize(e1), glm::normalize(e2)), Vec3(0.0f));
}

// Every edge is used once in each direction: a closed, consistently oriented surface.
bool is_closed(std::span<const UVec3> triangles) {
    std::vector<std::uint64_t> forward;
    std::vector<std::uint64_t> backward;
    for (const UVec3& t : triangles) {
        for (int c = 0; c < 3; ++c) {
            const std::uint64_t a = t[c];
            const std::uint64_t b = t[(c + 1) % 3];
            forward.push_back((a << 32) | b);
            backward.push_back((b << 32) | a);
        }
    }
    std::sort(forward.begin(), forward.end());
    std::sort(backward.begin(), backward.end());
    return forward == backward &&
           std::adjacent_find(forward.begin(), forward.end()) == forward.end();
}

float area_of(const Vec3& e1, const Vec3& e2) {
    return 0.5f * glm::length(glm::cross(e1, e2));
}

std::uint32_t material_of(const Mesh& mesh, const Instance& instance, std::uint32_t triangle) {
    if (instance.materials.empty()) {
        return 0;
    }
    const std::size_t slot = mesh.material_indices.empty() ? 0 : mesh.material_indices[triangle];
    return instance.materials[std::min(slot, instance.materials.size() - 1)];
}

}  // namespace

EmissiveTriangles::EmissiveTriangles(const LightSamplerInput& input, const CancelFlag& cancel) {
    collect(input, cancel);
    split_groups(input, cancel);
    for (Group& group : groups_) {
        throw_if_cancelled(cancel);
        finish_group(group);
        if (groups_.size() <= kMaxFacingGroups) {
            add_facing_tables(group);
        }
    }
    instance_first_.assign(input.instances.size(), kNone);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        const Triangle& t = triangles_[i];
        std::uint32_t& first = instance_first_[t.instance];
        if (first == kNone) {
            first = static_cast<std::uint32_t>(slot_.size());
            slot_.resize(
                slot_.size() + input.meshes[input.instances[t.instance].mesh].triangles.size(),
                kNone);
        }
        slot_[first + t.triangle] = static_cast<std::uint32_t>(i);
    }
}

// World-space triangles that can be sampled, sorted by group; groups in order of first appearance.
void EmissiveTriangles::collect(const LightSamplerInput& input, const CancelFlag& cancel) {
    std::unordered_map<std::uint64_t, std::uint32_t> group_of;
    for (std::size_t i = 0; i < input.triangles.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        const EmissiveTriangle& emitter = input.triangles[i];
        if (emitter.instance >= input.instances.size()) {
            continue;
        }
        const Instance& instance = input.instances[emitter.instance];
        const Mesh& mesh = input.meshes[instance.mesh];
        if (emitter.triangle >= mesh.triangles.size()) {
            continue;
        }
        const UVec3 corner = mesh.triangles[emitter.triangle];
        Triangle t;
        t.p0 = transform_point(instance.to_world, mesh.positions[corner.x]);
        t.e1 = transform_point(instance.to_world, mesh.positions[corner.y]) - t.p0;
        t.e2 = transform_point(instance.to_world, mesh.positions[corner.z]) - t.p0;
        t.instance = emitter.instance;
        t.triangle = emitter.triangle;
        const float area = area_of(t.e1, t.e2);
        t.weight = area * average(glm::abs(emitter.L_estimate));
        if (!(t.weight > 0.0f && t.weight < kInfinity && area > 1e-30f)) {
            continue;
        }
        const std::uint32_t material = material_of(mesh, instance, emitter.triangle);
        const std::uint64_t key = (std::uint64_t{emitter.instance} << 32) | material;
        const auto [it, added] = group_of.try_emplace(key, group_count());
        if (added) {
            groups_.emplace_back();
            groups_.back().material = material;
        }
        t.group = it->second;
        ++groups_[t.group].count;
        triangles_.push_back(t);
    }
    std::uint32_t first = 0;
    std::vector<std::uint32_t> next;
    for (Group& group : groups_) {
        group.first = first;
        next.push_back(first);
        first += group.count;
    }
    // By counting: to sort millions in one go takes longer than a cancel may.
    std::vector<Triangle> sorted(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        sorted[next[triangles_[i].group]++] = triangles_[i];
    }
    triangles_ = std::move(sorted);
}

void EmissiveTriangles::finish_group(Group& group) {
    std::vector<float> weights;
    weights.reserve(group.count);
    double area_sum = 0.0;
    double power_sum = 0.0;
    const Vec3 first_normal = unit_normal(triangles_[group.first].e1, triangles_[group.first].e2);
    bool flat = !is_zero(first_normal);
    for (const Triangle& t : members(group)) {
        area_sum += static_cast<double>(area_of(t.e1, t.e2));
        power_sum += static_cast<double>(t.weight);
        weights.push_back(t.weight);
        group.bounds.extend(t.p0);
        group.bounds.extend(t.p0 + t.e1);
        group.bounds.extend(t.p0 + t.e2);
        flat = flat && std::abs(glm::dot(unit_normal(t.e1, t.e2), first_normal)) >= kFlatCosine;
    }
    group.area = static_cast<float>(area_sum);
    group.power = static_cast<float>(power_sum);
    group.normal = flat ? first_normal : Vec3(0.0f);
    group.center = group.bounds.center();
    const AliasTable choice(weights);
    for (std::uint32_t i = 0; i < group.count; ++i) {
        triangles_[group.first + i].choice = choice.slot(i);
    }
}

bool EmissiveTriangles::is_closed_group(const LightSamplerInput& input, const Group& group) const {
    if (group.count < 4 || group.count > FacingTables::kMaxTriangles) {
        return false;
    }
    std::vector<UVec3> corners;
    for (const Triangle& t : members(group)) {
        corners.push_back(input.meshes[input.instances[t.instance].mesh].triangles[t.triangle]);
    }
    return is_closed(corners);
}

// Closed groups stay whole as long as facing tables serve them.
void EmissiveTriangles::split_groups(const LightSamplerInput& input, const CancelFlag& cancel) {
    const std::vector<Group> whole = std::move(groups_);
    groups_.clear();
    for (const Group& group : whole) {
        throw_if_cancelled(cancel);
        const bool closed = is_closed_group(input, group);
        if (group.count <= kClusterTriangles || (closed && whole.size() <= kMaxFacingGroups)) {
            groups_.push_back(group);
            groups_.back().closed = closed;
        } else {
            split_range(group.first, group.count, group.material, cancel);
        }
    }
    for (std::uint32_t index = 0; index < groups_.size(); ++index) {
        throw_if_cancelled(cancel);
        for (std::uint32_t i = 0; i < groups_[index].count; ++i) {
            triangles_[groups_[index].first + i].group = index;
        }
    }
}

// Halves along the longest axis until a cluster is left; reorders the triangles.
void EmissiveTriangles::split_range(std::uint32_t first,
                                    std::uint32_t count,
                                    std::uint32_t material,
                                    const CancelFlag& cancel) {
    throw_if_cancelled(cancel);
    if (count <= kClusterTriangles) {
        Group cluster;
        cluster.first = first;
        cluster.count = count;
        cluster.material = material;
        groups_.push_back(std::move(cluster));
        return;
    }
    const auto begin = triangles_.begin() + first;
    const auto center = [](const Triangle& t) { return 3.0f * t.p0 + t.e1 + t.e2; };
    Bounds3 box;
    for (auto t = begin; t != begin + count; ++t) {
        box.extend(center(*t));
    }
    const Vec3 e = box.extent();
    const int axis = e.x >= e.y && e.x >= e.z ? 0 : (e.y >= e.z ? 1 : 2);
    const std::uint32_t half = count / 2;
    // Ties by the triangles' own numbers: the same clusters with every library.
    std::nth_element(begin, begin + half, begin + count, [&](const Triangle& a, const Triangle& b) {
        const float x = center(a)[axis];
        const float y = center(b)[axis];
        return x != y ? x < y
                      : std::pair(a.instance, a.triangle) < std::pair(b.instance, b.triangle);
    });
    split_range(first, half, material, cancel);
    split_range(first + half, count - half, material, cancel);
}

void EmissiveTriangles::add_facing_tables(Group& group) {
    if (!group.closed) {
        return;
    }
    std::vector<Vec3> normals;
    std::vector<float> weights;
    double volume = 0.0;  // six times, signed: its sign says which way is out
    for (const Triangle& t : members(group)) {
        normals.push_back(unit_normal(t.e1, t.e2));
        weights.push_back(t.weight);
        volume += static_cast<double>(glm::dot(t.p0 - group.center, glm::cross(t.e1, t.e2)));
    }
    for (Vec3& normal : normals) {
        normal = volume < 0.0 ? -normal : normal;
    }
    group.facing = FacingTables(normals, weights);
    group.facing_distance2 = sqr(kFacingDistance) * length_squared(0.5f * group.bounds.extent());
}

const AliasTable* EmissiveTriangles::facing_table(const Group& group, const Vec3& p) {
    const Vec3 direction = p - group.center;
    const bool far = length_squared(direction) > group.facing_distance2;
    return far ? &group.facing.towards(direction) : nullptr;
}

void EmissiveTriangles::prefetch(std::uint32_t group_index, double u_choice) const {
    const Group& group = groups_[group_index];
    const auto place = static_cast<std::uint32_t>(u_choice * static_cast<double>(group.count));
    __builtin_prefetch(&triangles_[group.first + place]);
}

LightBound EmissiveTriangles::bound(std::uint32_t index) const {
    const Group& group = groups_[index];
    LightBound bound;
    bound.center = group.center;
    bound.radius = 0.5f * glm::length(group.bounds.extent());
    bound.area = group.area;
    bound.strength = group.power;
    if (is_zero(group.normal)) {
        // The mean projected area of a sheet is half of it, of a closed surface a quarter.
        bound.strength *= group.closed ? 0.25f : 0.5f;
    } else {
        bound.orientation = EmitterOrientation::TwoSided;
        bound.axis = group.normal;
    }
    return bound;
}

std::optional<EmissiveTriangles::Sample> EmissiveTriangles::sample(std::uint32_t group_index,
                                                                   const Vec3& p,
                                                                   double u_choice,
                                                                   const Vec2& u) const {
    const Group& group = groups_[group_index];
    const AliasTable* facing = facing_table(group, p);
    const AliasTable::Sample chosen =
        facing != nullptr
            ? facing->sample(u_choice)
            : sample_alias(u_choice, group.count, [&](std::size_t i) -> const AliasSlot& {
                  return triangles_[group.first + i].choice;
              });
    const Triangle& t = triangles_[group.first + chosen.index];
    const Vec2 b = sample_uniform_triangle(u);
    const Vec3 to_light = t.p0 + t.e1 * b.x + t.e2 * b.y - p;
    const float distance2 = length_squared(to_light);
    Sample sample;
    sample.distance = std::sqrt(distance2);
    sample.wi = to_light * (1.0f / sample.distance);
    // pmf / area * distance^2 / cosine, with cosine * area = |wi . cross| / 2.
    const float projected = 0.5f * std::abs(glm::dot(sample.wi, glm::cross(t.e1, t.e2)));
    sample.pdf = chosen.pmf * distance2 / projected;
    sample.instance = t.instance;
    sample.triangle = t.triangle;
    sample.material = group.material;
    sample.u = b.x;
    sample.v = b.y;
    const bool usable = sample.pdf > 0.0f && sample.pdf < kInfinity;
    return usable ? std::optional(sample) : std::nullopt;
}

std::uint32_t EmissiveTriangles::find(std::uint32_t instance, std::uint32_t triangle) const {
    if (instance >= instance_first_.size() || instance_first_[instance] == kNone) {
        return kNone;
    }
    return slot_[instance_first_[instance] + triangle];
}

float EmissiveTriangles::pdf_area(std::uint32_t instance,
                                  std::uint32_t triangle,
                                  const Vec3& p) const {
    const std::uint32_t index = find(instance, triangle);
    if (index == kNone) {
        return 0.0f;
    }
    const Triangle& t = triangles_[index];
    const Group& group = groups_[t.group];
    const AliasTable* facing = facing_table(group, p);
    const float pmf = facing != nullptr ? facing->pmf(index - group.first) : t.choice.pmf;
    return pmf / area_of(t.e1, t.e2);
}

}  // namespace pharos
