#include "lights/emissive_triangles.h"

#include <unordered_map>

#include "core/color.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

// A group counts as flat when its normals agree this far.
constexpr float kFlatCosine = 0.999f;

std::uint32_t material_of(const Mesh& mesh, const Instance& instance, std::uint32_t triangle) {
    if (mesh.material_indices.empty() || instance.materials.empty()) {
        return 0;
    }
    const std::size_t slot = mesh.material_indices[triangle];
    return instance.materials[std::min(slot, instance.materials.size() - 1)];
}

}  // namespace

EmissiveTriangles::EmissiveTriangles(const LightSamplerInput& input) {
    collect(input);
    for (Group& group : groups_) {
        finish_group(group);
    }
    instance_first_.assign(input.instances.size(), kNone);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
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
void EmissiveTriangles::collect(const LightSamplerInput& input) {
    std::unordered_map<std::uint64_t, std::uint32_t> group_of;
    for (const EmissiveTriangle& emitter : input.triangles) {
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
        const float area = 0.5f * glm::length(glm::cross(t.e1, t.e2));
        const float radiance = average(glm::abs(emitter.L_estimate));
        // pdf_area holds the weight until the group is complete.
        t.pdf_area = area * radiance;
        if (!(t.pdf_area > 0.0f && t.pdf_area < kInfinity && area > 1e-30f)) {
            continue;
        }
        const std::uint32_t material = material_of(mesh, instance, emitter.triangle);
        const std::uint64_t key = (std::uint64_t{emitter.instance} << 32) | material;
        const auto [it, added] = group_of.try_emplace(key, group_count());
        if (added) {
            groups_.emplace_back();
        }
        t.group = it->second;
        ++groups_[t.group].count;
        triangles_.push_back(t);
    }
    std::stable_sort(triangles_.begin(),
                     triangles_.end(),
                     [](const Triangle& a, const Triangle& b) { return a.group < b.group; });
    std::uint32_t first = 0;
    for (Group& group : groups_) {
        group.first = first;
        first += group.count;
    }
}

void EmissiveTriangles::finish_group(Group& group) {
    const std::span<Triangle> members = std::span(triangles_).subspan(group.first, group.count);
    std::vector<float> weights;
    weights.reserve(members.size());
    double area_sum = 0.0;
    double power_sum = 0.0;
    const Vec3 first_normal = normalize_or(glm::cross(members[0].e1, members[0].e2), Vec3(0.0f));
    bool flat = !is_zero(first_normal);
    for (const Triangle& t : members) {
        const Vec3 cross = glm::cross(t.e1, t.e2);
        const float area = 0.5f * glm::length(cross);
        area_sum += static_cast<double>(area);
        power_sum += static_cast<double>(t.pdf_area);
        weights.push_back(t.pdf_area);
        group.bounds.extend(t.p0);
        group.bounds.extend(t.p0 + t.e1);
        group.bounds.extend(t.p0 + t.e2);
        flat = flat && std::abs(glm::dot(cross, first_normal)) >= kFlatCosine * 2.0f * area;
    }
    group.area = static_cast<float>(area_sum);
    group.power = static_cast<float>(power_sum);
    group.normal = flat ? first_normal : Vec3(0.0f);
    group.choice = AliasTable(weights);
    for (std::size_t i = 0; i < members.size(); ++i) {
        const float area = 0.5f * glm::length(glm::cross(members[i].e1, members[i].e2));
        members[i].pdf_area = group.choice.pmf(static_cast<std::uint32_t>(i)) / area;
    }
}

LightBound EmissiveTriangles::bound(std::uint32_t index) const {
    const Group& group = groups_[index];
    LightBound bound;
    bound.center = group.bounds.center();
    bound.radius = 0.5f * glm::length(group.bounds.extent());
    bound.area = group.area;
    bound.strength = group.power;
    if (is_zero(group.normal)) {
        // Seen from anywhere, about half of the area faces away.
        bound.strength *= 0.5f;
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
    const Triangle& t = triangles_[group.first + group.choice.sample(u_choice).index];
    const Vec2 b = sample_uniform_triangle(u);
    const Vec3 to_light = t.p0 + t.e1 * b.x + t.e2 * b.y - p;
    const float distance2 = length_squared(to_light);
    Sample sample;
    sample.distance = std::sqrt(distance2);
    sample.wi = to_light * (1.0f / sample.distance);
    const Vec3 cross = glm::cross(t.e1, t.e2);
    const float cosine = std::abs(glm::dot(sample.wi, cross)) / glm::length(cross);
    sample.pdf = t.pdf_area * distance2 / cosine;
    sample.instance = t.instance;
    sample.triangle = t.triangle;
    sample.u = b.x;
    sample.v = b.y;
    const bool usable = sample.pdf > 0.0f && sample.pdf < kInfinity;
    return usable ? std::optional(sample) : std::nullopt;
}

EmissiveTriangles::Entry EmissiveTriangles::find(std::uint32_t instance,
                                                 std::uint32_t triangle) const {
    if (instance >= instance_first_.size() || instance_first_[instance] == kNone) {
        return {};
    }
    const std::uint32_t slot = slot_[instance_first_[instance] + triangle];
    if (slot == kNone) {
        return {};
    }
    return {triangles_[slot].group, triangles_[slot].pdf_area};
}

}  // namespace pharos
