#include "scene/displace.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <utility>

namespace pharos {

namespace {

constexpr float kFlat = 0.9999f;  // cosine of a corner's normal to its face's
constexpr std::size_t kCancelPollInterval = 1u << 16;
constexpr std::size_t kBatch = 1u << 14;  // vertices whose programs run between two polls

void poll(const CancelFlag& cancel, std::size_t i) {
    if (i % kCancelPollInterval == 0) {
        throw_if_cancelled(cancel);
    }
}

[[nodiscard]] Vec3 face_normal(const Mesh& mesh, const UVec3& t) {
    const Vec3& a = mesh.positions[t.x];
    return normalize_or(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a), Vec3(0.0f));
}

// Means over the faces around each vertex; a vertex without any has none.
[[nodiscard]] std::vector<Vec3> mean_normals(const Mesh& mesh, const CancelFlag& cancel) {
    std::vector<Vec3> normals(mesh.positions.size(), Vec3(0.0f));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        poll(cancel, i);
        const UVec3& t = mesh.triangles[i];
        const Vec3 n = face_normal(mesh, t);
        for (int k = 0; k < 3; ++k) {
            normals[t[k]] += n;
        }
    }
    for (Vec3& n : normals) {
        n = normalize_or(n, Vec3(0.0f));
    }
    return normals;
}

[[nodiscard]] std::vector<Vec3> smooth_normals(const Mesh& mesh, const CancelFlag& cancel) {
    return mesh.normal_domain == NormalDomain::Vertex ? mesh.normals : mean_normals(mesh, cancel);
}

// Which corners are shaded flat, before vertices move.
[[nodiscard]] std::vector<std::uint8_t> flat_corners(const Mesh& mesh, const CancelFlag& cancel) {
    std::vector<std::uint8_t> flat;
    if (mesh.normal_domain == NormalDomain::Corner) {
        for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
            poll(cancel, i);
            const Vec3 n = face_normal(mesh, mesh.triangles[i / 3]);
            flat.push_back(glm::dot(n, mesh.normals[i]) > kFlat ? 1 : 0);
        }
    }
    return flat;
}

void renew_normals(Mesh& mesh, const std::vector<std::uint8_t>& flat, const CancelFlag& cancel) {
    if (mesh.normal_domain == NormalDomain::Face) {
        return;
    }
    const std::vector<Vec3> smooth = mean_normals(mesh, cancel);
    if (mesh.normal_domain == NormalDomain::Vertex) {
        mesh.normals = smooth;
        return;
    }
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        poll(cancel, i);
        const UVec3& t = mesh.triangles[i / 3];
        mesh.normals[i] = flat[i] != 0 ? face_normal(mesh, t) : smooth[t[static_cast<int>(i % 3)]];
    }
}

// What a program says, of a vertex with normal n, as a move in the object's space.
[[nodiscard]] Vec3 offset_in_object(const NodeOp& op,
                                    const Vec3& value,
                                    const Vec3& n,
                                    const Instance& instance) {
    const bool in_world = op.mode == kDisplaceInWorld;
    Vec3 offset = value;
    if (op.code == NodeOpCode::AovValue) {
        // Normals go to the object's space by the transposed matrix.
        offset *= in_world ? n : normalize_or(glm::transpose(Mat3(instance.to_world)) * n, n);
    }
    return in_world ? transform_vector(instance.to_object, offset) : offset;
}

// The vertices that one material moves, and where its program is asked about them.
struct Vertices {
    std::vector<std::uint32_t> index;
    std::vector<SurfaceInteraction> hits;
};

class Displacer {
  public:
    Displacer(Scene& scene, const CancelFlag& cancel) : scene_(scene), cancel_(cancel) {}

    [[nodiscard]] bool run();

  private:
    [[nodiscard]] bool moves(const Instance& instance) const;
    [[nodiscard]] std::map<std::uint32_t, Vertices> collect(std::uint32_t instance,
                                                            const Mesh& mesh) const;
    void displace(std::uint32_t instance, Mesh& mesh);
    void move(const Vertices& vertices,
              const Material& material,
              const Instance& instance,
              Mesh& mesh);

    Scene& scene_;
    const CancelFlag& cancel_;
    ShadingScratch scratch_;
    std::vector<Vec3> values_;
};

bool Displacer::moves(const Instance& instance) const {
    return std::ranges::any_of(instance.materials, [&](std::uint32_t material) {
        return !scene_.displacements[material].aovs.closures.empty();
    });
}

// Each vertex belongs to the first triangle that has it and moves.
std::map<std::uint32_t, Vertices> Displacer::collect(std::uint32_t number, const Mesh& mesh) const {
    const Instance& instance = scene_.instances[number];
    const std::vector<Vec3> normals = smooth_normals(mesh, cancel_);
    std::vector<bool> done(mesh.positions.size());
    std::map<std::uint32_t, Vertices> by_material;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        poll(cancel_, i);
        const std::size_t slot = mesh.material_indices.empty() ? 0 : mesh.material_indices[i];
        const std::uint32_t material =
            instance.materials[std::min(slot, instance.materials.size() - 1)];
        if (scene_.displacements[material].aovs.closures.empty()) {
            continue;
        }
        Vertices& vertices = by_material[material];
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.triangles[i][k];
            if (done[vertex]) {
                continue;
            }
            done[vertex] = true;
            SurfaceInteraction hit;
            hit.p = transform_point(instance.to_world, mesh.positions[vertex]);
            hit.ns = normalize_or(transform_normal(instance.to_object, normals[vertex]),
                                  Vec3(0.0f, 0.0f, 1.0f));
            hit.ng = hit.wo = hit.ns;
            hit.u = k == 1 ? 1.0f : 0.0f;
            hit.v = k == 2 ? 1.0f : 0.0f;
            hit.instance = number;
            hit.triangle = i;
            hit.material = material;
            vertices.index.push_back(vertex);
            vertices.hits.push_back(hit);
        }
    }
    return by_material;
}

void Displacer::move(const Vertices& vertices,
                     const Material& material,
                     const Instance& instance,
                     Mesh& mesh) {
    const std::span<const SurfaceInteraction> all = vertices.hits;
    for (std::size_t first = 0; first < all.size(); first += kBatch) {
        throw_if_cancelled(cancel_);
        const auto hits = all.subspan(first, std::min(kBatch, all.size() - first));
        values_.assign(hits.size() * material.aovs.closures.size(), Vec3(0.0f));
        evaluate_aovs(material, scene_.shading, hits, scratch_, values_);
        for (std::size_t k = 0; k < material.aovs.closures.size(); ++k) {
            const NodeOp& op = material.aovs.closures[k];
            for (std::size_t i = 0; i < hits.size(); ++i) {
                const Vec3 offset =
                    offset_in_object(op, values_[k * hits.size() + i], hits[i].ns, instance);
                if (is_finite(offset)) {
                    mesh.positions[vertices.index[first + i]] += offset;
                }
            }
        }
    }
}

void Displacer::displace(std::uint32_t number, Mesh& mesh) {
    throw_if_cancelled(cancel_);
    const std::map<std::uint32_t, Vertices> by_material = collect(number, mesh);
    const std::vector<std::uint8_t> flat = flat_corners(mesh, cancel_);
    for (const auto& [material, vertices] : by_material) {
        move(vertices, scene_.displacements[material], scene_.instances[number], mesh);
    }
    renew_normals(mesh, flat, cancel_);
}

bool Displacer::run() {
    // By mesh and materials: the first instance decides, the others stand alike.
    std::map<std::pair<std::uint32_t, std::vector<std::uint32_t>>, std::uint32_t> displaced;
    std::vector<Mesh> made;
    const auto first_new = static_cast<std::uint32_t>(scene_.description.meshes.size());
    std::vector<std::uint32_t> target(scene_.instances.size(), kNone);
    for (std::uint32_t i = 0; i < scene_.instances.size(); ++i) {
        const Instance& instance = scene_.instances[i];
        if (!moves(instance)) {
            continue;
        }
        const auto [place, is_new] =
            displaced.try_emplace({instance.mesh, instance.materials},
                                  first_new + static_cast<std::uint32_t>(made.size()));
        target[i] = place->second;
        if (is_new) {
            made.push_back(scene_.description.meshes[instance.mesh]);
            made.back().version = 0;  // no longer what that names
            displace(i, made.back());
        }
    }
    for (std::size_t i = 0; i < target.size(); ++i) {
        scene_.instances[i].mesh = target[i] != kNone ? target[i] : scene_.instances[i].mesh;
    }
    const std::vector<std::uint32_t> uses = count_mesh_uses(first_new, scene_.instances);
    for (const auto& [key, mesh] : displaced) {
        const std::uint32_t before = key.first;
        // With a version a later scene may ask for the mesh as it was.
        if (scene_.description.meshes[before].version == 0 && uses[before] == 0) {
            scene_.description.meshes[before] = Mesh();
        }
    }
    for (const Mesh& mesh : made) {
        Bounds3& bounds = scene_.mesh_bounds.emplace_back();
        for (const Vec3& p : mesh.positions) {
            bounds.extend(p);
        }
    }
    std::ranges::move(made, std::back_inserter(scene_.description.meshes));
    return !displaced.empty();
}

}  // namespace

bool displace_meshes(Scene& scene, const CancelFlag& cancel) {
    return Displacer(scene, cancel).run();
}

}  // namespace pharos
