// Meshes as modelling programs hold them, polygons with values at their corners, made into ours.
//
// The columns lie in the host's memory, element by element some bytes apart, and are read there:
// what is gathered is written once. Sizes are checked, and the indices that are followed here;
// vertices beyond the end stay as they are, for validate_mesh() to mend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/math.h"
#include "geometry/mesh.h"

namespace pharos {

// `count` values, the first at `data`, each `stride` bytes after the one before, aligned or not.
template <class T>
struct Column {
    const std::byte* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = sizeof(T);

    [[nodiscard]] T operator[](std::size_t i) const {
        T value;
        std::memcpy(static_cast<void*>(&value), data + i * stride, sizeof(T));
        return value;
    }

    [[nodiscard]] bool empty() const { return count == 0; }
};

struct CornerUvMap {
    std::string name;
    Column<Vec2> uv;  // by corner
};

struct PolygonAttribute {
    std::string name;
    NormalDomain domain = NormalDomain::Vertex;  // Face: of polygons, Corner: of their corners
    std::uint32_t components = 3;                // 1 to 4
    Column<float> rows;                          // the first component of each row
};

struct PolygonMesh {
    Column<Vec3> positions;
    Column<std::uint32_t> corner_vertices;
    Column<UVec3> triangle_corners;           // the three corners of each triangle
    Column<std::uint32_t> triangle_polygons;  // empty where nothing below is by polygon
    NormalDomain normal_domain = NormalDomain::Face;
    Column<Vec3> normals;                // Face: empty; Vertex: by vertex; Corner: by corner
    Column<std::uint8_t> smooth;         // by polygon, 0: flat; empty: all smooth. Corner only
    Column<std::int32_t> material_slot;  // by polygon; empty: all 0
    std::uint16_t last_slot = 0;         // slots are clamped to [0, last_slot]
    std::vector<CornerUvMap> uv_maps;
    std::vector<PolygonAttribute> attributes;
};

// Throws std::invalid_argument beginning with `name` where sizes do not fit or a corner or polygon
// is beyond the end. Large meshes are gathered by as many threads as there are cores.
[[nodiscard]] Mesh gather_mesh(const std::string& name, const PolygonMesh& source);

// Unit normal of a triangle, zero without area. Every operation is rounded by itself: the bits do
// not depend on the compiler.
[[nodiscard]] Vec3 face_normal(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace pharos
