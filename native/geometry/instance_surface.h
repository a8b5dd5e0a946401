// Hit to surface point: position with a bound of its error, normals on wo's side, material.
//
// Once per path vertex, so everything it reads of an instance lies together in one record and the
// function is inline. The point comes from the barycentrics of the hit triangle, not from the ray,
// whose error grows with its length. Its error bound covers the rounding of the point, of the
// traced copy of the triangle (world-space vertices, or the ray brought into object space) and of
// the traversal's plane test (running error analysis: Higham, Accuracy and Stability of Numerical
// Algorithms, chapter 3; its use for ray origins: Pharr, Jakob, Humphreys, PBR 4ed, section 6.8).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "geometry/accelerator.h"
#include "geometry/mesh.h"
#include "geometry/surface_interaction.h"

namespace pharos {

// Points into the meshes and instances, which must stay where they are.
struct InstanceSurface {
    const Vec3* positions = nullptr;
    const UVec3* triangles = nullptr;
    const Vec3* normals = nullptr;                  // null: flat
    const std::uint16_t* material_slots = nullptr;  // of each triangle; null: slot 0
    const std::uint32_t* materials = nullptr;       // of each slot
    std::uint32_t slot_count = 1;
    bool corner_normals = false;  // normals are per corner, else per vertex
    bool mirrored = false;
    Mat4 to_world{1.0f};
    Mat3 normal_to_world{1.0f};  // inverse transpose
    // Rounding error of a traced point is some units times error_matrix |object coordinates| +
    // error_offset: of the transform and, for a shared mesh, of bringing rays into object space.
    Mat3 error_matrix{1.0f};
    Vec3 error_offset;
};

// One per instance, in order.
[[nodiscard]] std::vector<InstanceSurface> make_instance_surfaces(
    std::span<const Mesh> meshes, std::span<const Instance> instances);

// How often each mesh is used: one used once is traced in world space.
[[nodiscard]] std::vector<std::uint32_t> count_mesh_uses(std::size_t mesh_count,
                                                         std::span<const Instance> instances);

namespace detail {

inline constexpr float kUnitRoundoff = 0x1p-24f;
inline constexpr float kPointErrorUnits = 4.0f;  // of point, traced vertices and ray origin
inline constexpr float kPlaneErrorUnits = 4.0f;  // of the traversal's normal and plane distance
inline constexpr float kMaxTilt = 64.0f;         // of needles, whose normal is hardly known
inline constexpr float kInset = 8.0f;  // error bounds between a point and its triangle's edges

// Bound of the distance between the point and the plane that was traced, along unit normal ng.
[[nodiscard]] inline float surface_error_bound(const InstanceSurface& s,
                                               const Vec3& largest,
                                               const Vec3& edge1,
                                               const Vec3& edge2,
                                               const Vec3& ng,
                                               float normal_length) {
    const Vec3 point = s.error_matrix * largest + s.error_offset;
    // Rounding of the normal's products moves the plane by that share of the triangle's extent.
    const Vec3 a = glm::abs(edge1);
    const Vec3 b = glm::abs(edge2);
    const Vec3 products(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    const Vec3 extent = glm::max(a, b);
    const float tilt =
        std::min(glm::dot(products, extent), kMaxTilt * normal_length * max_component(extent));
    return kUnitRoundoff * (kPointErrorUnits * glm::dot(glm::abs(ng), point) +
                            kPlaneErrorUnits * tilt / normal_length);
}

// Barycentrics moved off the triangle's edges by a multiple of the error bound. A point on an edge
// may lie beyond the neighbouring face by its rounding error, and rays from there would leak.
struct Barycentrics {
    float u, v;
};

[[nodiscard]] inline Barycentrics inset_from_edges(float u, float v, float margin) {
    const float w = 1.0f - u - v;
    if (std::min(std::min(u, v), w) >= margin) [[likely]] {
        return {u, v};
    }
    u = std::max(u, margin);
    v = std::max(v, margin);
    const float scale = 1.0f / (u + v + std::max(w, margin));
    return {u * scale, v * scale};
}

}  // namespace detail

// hit must be a hit of ray on the instance the record belongs to.
[[nodiscard]] inline SurfaceInteraction surface_interaction(const InstanceSurface& s,
                                                            const Ray& ray,
                                                            const Hit& hit) {
    const UVec3 corners = s.triangles[hit.triangle];
    const Vec3 p0 = s.positions[corners.x];
    const Vec3 p1 = s.positions[corners.y];
    const Vec3 p2 = s.positions[corners.z];
    const Mat3 linear(s.to_world);
    const Vec3 e1 = p1 - p0;
    const Vec3 e2 = p2 - p0;

    SurfaceInteraction si;
    si.t = hit.t;
    si.u = hit.u;
    si.v = hit.v;
    si.wo = -ray.direction;
    si.instance = hit.instance;
    si.triangle = hit.triangle;
    const std::uint32_t slot = s.material_slots ? s.material_slots[hit.triangle] : 0;
    si.material = s.materials[std::min(slot, s.slot_count - 1)];

    // A mirrored instance turns the winding round; its outside stays where the object's outside is.
    const Vec3 edge1 = linear * e1;
    const Vec3 edge2 = linear * e2;
    Vec3 n = glm::cross(edge1, edge2);
    if (s.mirrored) {
        n = -n;
    }
    const float squared = length_squared(n);
    const bool sound = squared > 1e-37f && squared < kInfinity;
    const float length = sound ? std::sqrt(squared) : 1.0f;
    si.ng = sound ? n / length : si.wo;
    const Vec3 largest = glm::max(glm::max(glm::abs(p0), glm::abs(p1)), glm::abs(p2));
    si.p_error = detail::surface_error_bound(s, largest, edge1, edge2, si.ng, length);

    const float longest = std::sqrt(std::max(length_squared(edge1), length_squared(edge2)));
    const float margin = std::min(detail::kInset * si.p_error * longest / length, 0.1f);
    const detail::Barycentrics b = detail::inset_from_edges(hit.u, hit.v, margin);
    si.p = linear * (p0 + (b.u * e1 + b.v * e2)) + Vec3(s.to_world[3]);

    si.ns = si.ng;
    if (s.normals != nullptr) {
        const UVec3 index = s.corner_normals ? 3 * hit.triangle + UVec3(0, 1, 2) : corners;
        const Vec3 smooth = (1.0f - hit.u - hit.v) * s.normals[index.x] +
                            hit.u * s.normals[index.y] + hit.v * s.normals[index.z];
        si.ns = normalize_or(s.normal_to_world * smooth, si.ng);
    }
    si.front_face = glm::dot(si.ng, si.wo) >= 0.0f;
    if (!si.front_face) {
        si.ng = -si.ng;
        si.ns = -si.ns;
    }
    return si;
}

}  // namespace pharos
