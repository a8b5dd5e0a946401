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
#include "geometry/simd_vec3.h"
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
    float winding = 1.0f;         // -1: mirrored
    Mat4 to_world{1.0f};
    Mat4 normal_to_world{1.0f};  // inverse transpose of the linear part
    // Rounding error of a traced point is some units times what this makes of the object
    // coordinates' absolute values: the transform's and, for a shared mesh, that of bringing rays
    // into object space.
    Mat4 error_bound{1.0f};
};

// One per instance, in order; `all_shared`: as an accelerator traces them that keeps its meshes.
[[nodiscard]] std::vector<InstanceSurface> make_instance_surfaces(
    std::span<const Mesh> meshes, std::span<const Instance> instances, bool all_shared = false);

// How often each mesh is used: one used once is traced in world space.
[[nodiscard]] std::vector<std::uint32_t> count_mesh_uses(std::size_t mesh_count,
                                                         std::span<const Instance> instances);

namespace detail {

inline constexpr float kUnitRoundoff = 0x1p-24f;
inline constexpr float kPointErrorUnits = 4.0f;  // of point, traced vertices and ray origin
inline constexpr float kPlaneErrorUnits = 4.0f;  // of the traversal's normal and plane distance
inline constexpr float kMaxTilt = 64.0f;         // of needles, whose normal is hardly known
// Of the triangle's extent, at least: in a plane of a coordinate that is 0 all else vanishes, and a
// step of denormal length is none to the traversal, where the triangle is small.
inline constexpr float kLeastErrorUnits = 0x1p-6f;
inline constexpr float kInset = 8.0f;  // error bounds between a point and its triangle's edges

// Bound of the distance between the point and the plane that was traced, along unit normal ng.
[[nodiscard]] inline float surface_error_bound(const InstanceSurface& s,
                                               Simd3 largest,
                                               Simd3 edge1,
                                               Simd3 edge2,
                                               Simd3 ng,
                                               float inverse_length) {
    const float point = dot(abs(ng), transform_point(s.error_bound, largest));
    // Rounding of the normal's products moves the plane by that share of the triangle's extent.
    const Simd3 a = abs(edge1);
    const Simd3 b = abs(edge2);
    const Simd3 extent = max(a, b);
    const float tilt = std::min(dot(cross_of_sums(a, b), extent) * inverse_length,
                                kMaxTilt * max_component(extent));
    return kUnitRoundoff * (kPointErrorUnits * point + kPlaneErrorUnits * tilt +
                            kLeastErrorUnits * max_component(extent));
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
    using detail::Simd3;
    const UVec3 corners = s.triangles[hit.triangle];
    const Simd3 p0 = Simd3::load(s.positions[corners.x]);
    const Simd3 p1 = Simd3::load(s.positions[corners.y]);
    const Simd3 p2 = Simd3::load(s.positions[corners.z]);
    const Simd3 edge1 = detail::transform_vector(s.to_world, p1 - p0);
    const Simd3 edge2 = detail::transform_vector(s.to_world, p2 - p0);

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
    const Simd3 n = cross(edge1, edge2);
    const Simd3 wo = Simd3::load(si.wo);
    const float squared = dot(n, n);
    const bool sound = squared > 1e-37f && squared < kInfinity;
    const float inverse_length = sound ? 1.0f / std::sqrt(squared) : 1.0f;
    Simd3 ng = sound ? n * (inverse_length * s.winding) : wo;
    const Simd3 largest = max(max(abs(p0), abs(p1)), abs(p2));
    si.p_error = detail::surface_error_bound(s, largest, edge1, edge2, ng, inverse_length);

    const float longest = 1.75f * max_component(max(abs(edge1), abs(edge2)));
    const float margin = std::min(detail::kInset * si.p_error * longest * inverse_length, 0.1f);
    const detail::Barycentrics b = detail::inset_from_edges(hit.u, hit.v, margin);
    const Simd3 corner = detail::transform_point(s.to_world, p0);
    si.p = (corner + (edge1 * b.u + edge2 * b.v)).store();

    const float facing = dot(ng, wo);
    const float side = facing >= 0.0f ? 1.0f : -1.0f;
    si.front_face = facing >= 0.0f;
    ng = ng * side;
    si.ng = ng.store();
    si.ns = si.ng;
    if (s.normals != nullptr) {
        const UVec3 index = s.corner_normals ? 3 * hit.triangle + UVec3(0, 1, 2) : corners;
        const Simd3 smooth = Simd3::load(s.normals[index.x]) * (1.0f - hit.u - hit.v) +
                             Simd3::load(s.normals[index.y]) * hit.u +
                             Simd3::load(s.normals[index.z]) * hit.v;
        const Simd3 ns = detail::transform_vector(s.normal_to_world, smooth);
        const float length2 = dot(ns, ns);
        if (length2 > 1e-30f && length2 < 1e30f) {
            si.ns = (ns * (side / std::sqrt(length2))).store();
        }
    }
    return si;
}

}  // namespace pharos
