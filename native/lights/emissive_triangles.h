// The emissive triangles of a scene in world space, in groups of one instance and material each.
// Large groups are split into clusters of neighbours, so that the nearest of them can be chosen.
//
// Within a group a triangle is chosen in proportion to area times estimated radiance (closed
// emitters seen from some distance: times the cosine towards the receiver, too), its point
// uniformly over the area; densities are converted to solid angle. Both sides emit.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"
#include "lights/facing_tables.h"
#include "lights/light_bound.h"
#include "lights/light_sampler.h"
#include "sampling/alias_table.h"

namespace pharos {

class EmissiveTriangles {
  public:
    EmissiveTriangles() = default;
    // Throws Cancelled.
    EmissiveTriangles(const LightSamplerInput& input, const CancelFlag& cancel);

    [[nodiscard]] std::uint32_t group_count() const {
        return static_cast<std::uint32_t>(groups_.size());
    }

    [[nodiscard]] LightBound bound(std::uint32_t group) const;

    struct Sample {
        Vec3 wi;
        float distance = 0.0f;
        float pdf = 0.0f;  // solid angle, choice within the group included
        std::uint32_t instance = kNone;
        std::uint32_t triangle = kNone;
        std::uint32_t material = kNone;
        float u = 0.0f;
        float v = 0.0f;
    };

    // `u_choice` picks the triangle.
    [[nodiscard]] std::optional<Sample> sample(std::uint32_t group,
                                               const Vec3& p,
                                               double u_choice,
                                               const Vec2& u) const;

    // What sample() will ask for first, brought near ahead of time.
    void prefetch(std::uint32_t group, double u_choice) const;

    // The group that samples a triangle; kNone: not sampled.
    [[nodiscard]] std::uint32_t find_group(std::uint32_t instance, std::uint32_t triangle) const {
        const std::uint32_t index = find(instance, triangle);
        return index == kNone ? kNone : triangles_[index].group;
    }

    // Density per area of sampling a point of that triangle from p, choice within the group
    // included.
    [[nodiscard]] float pdf_area(std::uint32_t instance,
                                 std::uint32_t triangle,
                                 const Vec3& p) const;

  private:
    struct alignas(64) Triangle {
        Vec3 p0;
        Vec3 e1;
        Vec3 e2;
        float weight = 0.0f;  // area times radiance
        std::uint32_t instance = 0;
        std::uint32_t triangle = 0;
        std::uint32_t group = 0;
        AliasTable::Slot choice;  // within its group
    };

    static_assert(sizeof(Triangle) == 64);

    // What sampling asks for comes first.
    struct alignas(64) Group {
        std::uint32_t first = 0;
        std::uint32_t count = 0;
        std::uint32_t material = kNone;
        float facing_distance2 = kInfinity;  // from which on the facing tables hold
        Vec3 center;
        Vec3 normal;  // of a flat group, else zero
        float area = 0.0f;
        float power = 0.0f;  // radiance times area
        bool closed = false;
        Bounds3 bounds;
        FacingTables facing;  // of a closed group, if there are not too many
    };

    void collect(const LightSamplerInput& input, const CancelFlag& cancel);
    void split_groups(const LightSamplerInput& input, const CancelFlag& cancel);
    void split_range(std::uint32_t first,
                     std::uint32_t count,
                     std::uint32_t material,
                     const CancelFlag& cancel);
    void finish_group(Group& group);
    [[nodiscard]] bool is_closed_group(const LightSamplerInput& input, const Group& group) const;
    void add_facing_tables(Group& group);

    [[nodiscard]] std::span<const Triangle> members(const Group& group) const {
        return std::span(triangles_).subspan(group.first, group.count);
    }

    // The table of a closed group seen from afar; null: the triangles' own choice holds.
    [[nodiscard]] static const AliasTable* facing_table(const Group& group, const Vec3& p);
    [[nodiscard]] std::uint32_t find(std::uint32_t instance, std::uint32_t triangle) const;

    std::vector<Triangle> triangles_;
    std::vector<Group> groups_;
    // slot_[instance_first_[i] + triangle] = index into triangles_ or kNone; kNone: no emitter
    // there.
    std::vector<std::uint32_t> instance_first_;
    std::vector<std::uint32_t> slot_;
};

}  // namespace pharos
