// Ray tracing over instances of triangle meshes; Embree stays behind it (accelerator.cpp).
//
// Meshes used once are traced in world space; a mesh used more often is stored once and instanced.
// For a scene that is edited all are instanced, and their structures are kept (mesh_trees.h).
// Robust traversal. Rays with non-finite members miss. Building polls `cancel` and throws
// Cancelled; out of memory, or of the bytes it may take, throws std::bad_alloc.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/cancel.h"
#include "core/math.h"
#include "core/visibility.h"
#include "geometry/mesh.h"
#include "geometry/surface_interaction.h"

namespace pharos {

// An instance ready to trace.
struct Instance {
    std::uint32_t mesh = 0;
    Mat4 to_world{1.0f};
    Mat4 to_object{1.0f};
    bool mirrored = false;  // det(to_world) < 0
    std::uint32_t visibility = kVisibleAll;
    std::vector<std::uint32_t> materials;  // material of each slot, never empty
};

struct Hit {
    float t = kInfinity;  // kInfinity: a miss
    float u = 0.0f;
    float v = 0.0f;
    std::uint32_t instance = kNone;
    std::uint32_t triangle = kNone;
};

enum class RayOrder : std::uint8_t { Incoherent, Coherent };

class MeshTrees;

class Accelerator {
  public:
    // The meshes and instances must outlive the accelerator and stay where they are.
    Accelerator(std::span<const Mesh> meshes,
                std::span<const Instance> instances,
                const CancelFlag& cancel,
                MeshTrees* kept = nullptr,
                std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max());
    ~Accelerator();
    Accelerator(const Accelerator&) = delete;
    Accelerator& operator=(const Accelerator&) = delete;

    // Nearest hit of each ray among instances seen by `visibility` of the same index. Coherent: the
    // rays of neighbouring pixels in order; several times faster for those and slower for others.
    void intersect(std::span<const Ray> rays,
                   std::span<const std::uint32_t> visibility,
                   std::span<Hit> hits,
                   RayOrder order = RayOrder::Incoherent) const;

    // occluded[i] = 1 where anything that casts shadows lies in (t_min, t_max).
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;

    [[nodiscard]] Bounds3 bounds() const;       // of everything, world space; empty for no geometry
    [[nodiscard]] std::uint64_t bytes() const;  // held by the acceleration structure

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// One triangle is intersected and the library's major version is compared: false when the host's
// process made the calls go to another Embree.
[[nodiscard]] bool accelerator_self_test();

}  // namespace pharos
