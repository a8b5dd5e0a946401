// A triangle mesh in object space: the description and what is traced are the same arrays.
//
// Input may hold broken indices and non-finite values; validate_mesh() (scene) mends and reports
// them before anything else reads a mesh.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"

namespace pharos {

enum class NormalDomain : std::uint32_t { Face, Vertex, Corner };

struct UvMap {
    std::string name;
    std::vector<Vec2> uv;  // per corner: 3 x triangles
};

// Values that only node programs read, under their name.
struct MeshAttribute {
    std::string name;
    NormalDomain domain = NormalDomain::Vertex;
    std::uint32_t components = 3;  // 1: a number, 2 and 3: a vector, 4: a colour with alpha
    std::vector<float> values;     // components x faces, vertices or corners (3 x triangles)
};

// A value of each instance, under its name.
struct InstanceAttribute {
    std::string name;
    std::vector<Vec4> values;  // colour or vector, alpha

    bool operator==(const InstanceAttribute&) const = default;
};

struct Mesh {
    std::string name;
    std::uint64_t version = 0;  // equal and not 0: the same content (scene/live_scene.h)
    std::vector<Vec3> positions;
    std::vector<UVec3> triangles;  // indices into positions
    NormalDomain normal_domain = NormalDomain::Face;
    std::vector<Vec3> normals;  // Face: empty; Vertex: positions.size(); Corner: 3 x triangles
    std::vector<std::uint16_t> material_indices;  // slot of each triangle; empty: all 0
    std::vector<UvMap> uv_maps;                   // first = the one rendered by default
    std::vector<MeshAttribute> attributes;
};

}  // namespace pharos
