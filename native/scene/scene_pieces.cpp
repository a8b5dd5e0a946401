#include "scene/scene_pieces.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "scene/view.h"

namespace pharos {

namespace {

using Reports = std::map<std::uint64_t, SceneReport>;

void repeat(const Reports& reports, std::uint64_t version, SceneReport& report) {
    if (const auto found = reports.find(version); found != reports.end()) {
        report.add(found->second);
    }
}

template <class Things>
void keep_reports(const Things& things, Reports& reports) {
    std::set<std::uint64_t> versions;
    for (const auto& thing : things) {
        versions.insert(thing.version);
    }
    std::erase_if(reports, [&](const auto& entry) { return !versions.contains(entry.first); });
}

bool is_content_there(const ImageDescription& image) {
    return !image.path.empty() || !image.bytes.empty() || !image.pixels.empty();
}

}  // namespace

std::optional<WorldKey> world_key(const SceneDescription& description) {
    WorldKey key{description.blender_version, description.world, {}};
    if (asks_view(key.world.program)) {
        return std::nullopt;
    }
    const auto add_image = [&](std::uint32_t image) {
        key.image_versions.push_back(
            image < description.images.size() ? description.images[image].version : 0);
    };
    for (const ImageUse& use : key.world.program.images) {
        add_image(use.image);
        for (const ImageTile& tile : use.tiles) {
            add_image(tile.image);
        }
    }
    if (std::ranges::find(key.image_versions, 0u) != key.image_versions.end()) {
        return std::nullopt;
    }
    return key;
}

void ScenePieces::take(Scene& scene) {
    SceneDescription& d = scene.description;
    for (std::size_t i = 0; i < d.meshes.size(); ++i) {
        if (const std::uint64_t version = d.meshes[i].version; version != 0) {
            meshes_[version] = {std::move(d.meshes[i]), scene.mesh_bounds[i]};
        }
    }
    for (std::size_t i = 0; i < d.images.size(); ++i) {
        if (const std::uint64_t version = d.images[i].version; version != 0) {
            images_[version] = {std::move(d.images[i]), std::move(scene.textures[i])};
        }
    }
    environment_ = std::move(scene.environment);
}

bool ScenePieces::give_mesh(Scene& scene, std::size_t index, SceneReport& report) {
    Mesh& mesh = scene.description.meshes[index];
    const auto found = mesh.version != 0 ? meshes_.find(mesh.version) : meshes_.end();
    if (found == meshes_.end()) {
        if (mesh.version != 0 && mesh.positions.empty()) {
            throw std::invalid_argument(mesh.name + ": the mesh is not known any more");
        }
        return false;
    }
    mesh = std::move(found->second.mesh);
    scene.mesh_bounds[index] = found->second.bounds;
    repeat(mesh_reports_, mesh.version, report);
    meshes_.erase(found);
    return true;
}

bool ScenePieces::give_image(Scene& scene, std::size_t index, SceneReport& report) {
    ImageDescription& image = scene.description.images[index];
    const auto found = image.version != 0 ? images_.find(image.version) : images_.end();
    if (found == images_.end()) {
        if (image.version != 0 && !is_content_there(image)) {
            throw std::invalid_argument(image.name + ": the image is not known any more");
        }
        return false;
    }
    image = std::move(found->second.image);
    scene.textures[index] = std::move(found->second.texture);
    images_.erase(found);
    if (scene.textures[index].missing()) {
        return false;
    }
    repeat(image_reports_, image.version, report);
    return true;
}

void ScenePieces::remember_mesh(const Mesh& mesh, const SceneReport& report) {
    if (mesh.version != 0) {
        mesh_reports_[mesh.version] = report;
    }
}

void ScenePieces::remember_image(const ImageDescription& image, const SceneReport& report) {
    if (image.version != 0) {
        image_reports_[image.version] = report;
    }
}

std::unique_ptr<EnvironmentLight> ScenePieces::give_environment(std::optional<WorldKey> key) {
    const bool same = key.has_value() && key == world_key_;
    world_key_ = std::move(key);
    return same ? std::move(environment_) : nullptr;
}

void ScenePieces::drop_rest(const Scene& scene) {
    meshes_.clear();
    images_.clear();
    environment_.reset();
    keep_reports(scene.description.meshes, mesh_reports_);
    keep_reports(scene.description.images, image_reports_);
}

}  // namespace pharos
