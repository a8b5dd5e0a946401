#include "scene/compare.h"

#include <algorithm>

namespace pharos {

namespace {

bool same_mesh(const Mesh& a, const Mesh& b) {
    return a.version == b.version && a.version != 0 && a.name == b.name;
}

bool is_missing(const ImageDescription& image) {
    return image.version == 0 && image.path.empty() && image.bytes.empty() && image.pixels.empty();
}

bool same_image(const ImageDescription& a, const ImageDescription& b) {
    const bool same = (is_missing(a) && is_missing(b)) || a.version != 0;
    return same && a.version == b.version && a.name == b.name;
}

bool same_settings(RenderSettings a, const RenderSettings& b) {
    a.samples = b.samples;
    return a == b;
}

}  // namespace

SceneDescription outline(const SceneDescription& description) {
    SceneDescription out;
    out.blender_version = description.blender_version;
    for (const Mesh& mesh : description.meshes) {
        Mesh& known = out.meshes.emplace_back();
        known.name = mesh.name;
        known.version = mesh.version;
    }
    out.materials = description.materials;
    out.material_sets = description.material_sets;
    out.instances = description.instances;
    for (const ImageDescription& image : description.images) {
        ImageDescription& known = out.images.emplace_back();
        known.name = image.name;
        known.version = image.version;
        known.path = image.path;
    }
    out.lights = description.lights;
    out.light_programs = description.light_programs;
    out.world = description.world;
    out.has_camera = description.has_camera;
    out.camera = description.camera;
    out.film = description.film;
    out.settings = description.settings;
    out.passes = description.passes;
    out.instance_attributes = description.instance_attributes;
    return out;
}

bool same_content(const SceneDescription& a, const SceneDescription& b) {
    return a.blender_version == b.blender_version &&
           std::ranges::equal(a.meshes, b.meshes, same_mesh) && a.materials == b.materials &&
           a.material_sets == b.material_sets && a.instances == b.instances &&
           std::ranges::equal(a.images, b.images, same_image) && a.lights == b.lights &&
           a.light_programs == b.light_programs && a.world == b.world &&
           same_settings(a.settings, b.settings) && a.passes == b.passes &&
           a.instance_attributes == b.instance_attributes;
}

}  // namespace pharos
