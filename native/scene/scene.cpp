#include "scene/scene.h"

#include "scene/origin.h"

namespace pharos {

namespace {

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
    return values.capacity() * sizeof(T);
}

std::uint64_t bytes_of(const Mesh& mesh) {
    std::uint64_t bytes = sizeof(Mesh) + bytes_of(mesh.positions) + bytes_of(mesh.triangles) +
                          bytes_of(mesh.normals) + bytes_of(mesh.material_indices);
    for (const UvMap& map : mesh.uv_maps) {
        bytes += bytes_of(map.uv);
    }
    return bytes;
}

}  // namespace

CameraDescription Scene::camera() const {
    CameraDescription camera = description.camera;
    camera.to_world = moved_by(camera.to_world, -shading.origin);
    return camera;
}

std::uint64_t Scene::bytes() const {
    std::uint64_t bytes =
        sizeof(Scene) + bytes_of(instances) + bytes_of(surfaces) + accelerator->bytes();
    for (const Mesh& mesh : description.meshes) {
        bytes += bytes_of(mesh);
    }
    for (const Texture& texture : textures) {
        bytes += texture.bytes();
    }
    return bytes;
}

}  // namespace pharos
