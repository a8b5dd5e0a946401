// The emissive triangles of a scene in world space, in groups of one instance and material each.
//
// Within a group a triangle is chosen in proportion to area times estimated radiance, its point
// uniformly over the area; densities are converted to solid angle. Both sides emit.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"
#include "lights/light_sampler.h"
#include "lights/light_selection.h"
#include "sampling/alias_table.h"

namespace pharos {

class EmissiveTriangles {
  public:
    EmissiveTriangles() = default;
    explicit EmissiveTriangles(const LightSamplerInput& input);

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
        float u = 0.0f;
        float v = 0.0f;
    };

    // `u_choice` picks the triangle.
    [[nodiscard]] std::optional<Sample> sample(std::uint32_t group,
                                               const Vec3& p,
                                               double u_choice,
                                               const Vec2& u) const;

    struct Entry {
        std::uint32_t group = kNone;
        float pdf_area = 0.0f;  // choice within the group included
    };

    // Group kNone: not sampled.
    [[nodiscard]] Entry find(std::uint32_t instance, std::uint32_t triangle) const;

  private:
    struct Triangle {
        Vec3 p0;
        Vec3 e1;
        Vec3 e2;
        float pdf_area = 0.0f;
        std::uint32_t instance = 0;
        std::uint32_t triangle = 0;
        std::uint32_t group = 0;
    };

    struct Group {
        std::uint32_t first = 0;
        std::uint32_t count = 0;
        Bounds3 bounds;
        float area = 0.0f;
        float power = 0.0f;  // radiance times area
        Vec3 normal;         // of a flat group, else zero
        AliasTable choice;
    };

    void collect(const LightSamplerInput& input);
    void finish_group(Group& group);

    std::vector<Triangle> triangles_;
    std::vector<Group> groups_;
    // slot_[instance_first_[i] + triangle] = index into triangles_ or kNone; kNone: no emitter
    // there.
    std::vector<std::uint32_t> instance_first_;
    std::vector<std::uint32_t> slot_;
};

}  // namespace pharos
