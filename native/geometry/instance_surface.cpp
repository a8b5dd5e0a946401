#include "geometry/instance_surface.h"

namespace pharos {

namespace {

Mat3 absolute(const Mat3& m) {
    return Mat3(glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2]));
}

// A point's coordinates, the products of its transform and its translation all round. With a shared
// mesh a ray's origin goes through the inverse, W (p - t), which blows the rounding of p and t up
// by |W| and comes back through |M|.
Mat4 error_bound(const Instance& instance, bool shared) {
    const Mat3 to_world = absolute(Mat3(instance.to_world));
    const Vec3 translation = glm::abs(Vec3(instance.to_world[3]));
    Mat3 matrix = to_world;
    Vec3 offset = translation;
    if (shared) {
        const Mat3 there_and_back = to_world * absolute(Mat3(instance.to_object));
        matrix += there_and_back * to_world;
        offset += 2.0f * (there_and_back * translation);
    }
    Mat4 result(matrix);
    result[3] = Vec4(offset, 1.0f);
    return result;
}

}  // namespace

std::vector<std::uint32_t> count_mesh_uses(std::size_t mesh_count,
                                           std::span<const Instance> instances) {
    std::vector<std::uint32_t> uses(mesh_count, 0);
    for (const Instance& instance : instances) {
        if (instance.mesh < mesh_count) {
            ++uses[instance.mesh];
        }
    }
    return uses;
}

std::vector<InstanceSurface> make_instance_surfaces(std::span<const Mesh> meshes,
                                                    std::span<const Instance> instances,
                                                    bool all_shared) {
    const std::vector<std::uint32_t> uses = count_mesh_uses(meshes.size(), instances);
    std::vector<InstanceSurface> surfaces;
    surfaces.reserve(instances.size());
    for (const Instance& instance : instances) {
        const Mesh& mesh = meshes[instance.mesh];
        InstanceSurface s;
        s.positions = mesh.positions.data();
        s.triangles = mesh.triangles.data();
        s.normals = mesh.normal_domain == NormalDomain::Face ? nullptr : mesh.normals.data();
        s.corner_normals = mesh.normal_domain == NormalDomain::Corner;
        s.material_slots = mesh.material_indices.empty() ? nullptr : mesh.material_indices.data();
        s.materials = instance.materials.data();
        s.slot_count = static_cast<std::uint32_t>(instance.materials.size());
        s.winding = instance.mirrored ? -1.0f : 1.0f;
        s.to_world = instance.to_world;
        s.normal_to_world = Mat4(glm::transpose(Mat3(instance.to_object)));
        s.error_bound = error_bound(instance, all_shared || uses[instance.mesh] > 1);
        surfaces.push_back(s);
    }
    return surfaces;
}

}  // namespace pharos
