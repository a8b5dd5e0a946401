// What a scene that is edited leaves to the next one: meshes, images, their structures, and the
// world's importance map (internal to scene/; live_scene.h).
//
// Meshes and images are known by their versions, and change hands: they lie here only between the
// end of one scene and the start of the next. Reports about them stay here.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/math.h"
#include "core/scene_report.h"
#include "geometry/mesh_trees.h"
#include "scene/scene.h"

namespace pharos {

// All that an importance map follows from.
struct WorldKey {
    std::uint32_t blender_version = 0;
    WorldDescription world;
    std::vector<std::uint64_t> image_versions;

    bool operator==(const WorldKey&) const = default;
};

// Nothing where the map must be made anew for every scene: it follows the camera, or an image
// without a version.
[[nodiscard]] std::optional<WorldKey> world_key(const SceneDescription& description);

class ScenePieces {
  public:
    // Takes back everything of a scene that the next one may use. The scene can only be destroyed
    // afterwards.
    void take(Scene& scene);

    // Where mesh `index` of the scene is known: moves it in. False: it comes with its own content.
    // Throws std::invalid_argument when it has neither.
    bool give_mesh(Scene& scene, std::size_t index, SceneReport& report);

    // Likewise of an image; its texture stays missing where it was never read.
    bool give_image(Scene& scene, std::size_t index, SceneReport& report);

    void remember_mesh(const Mesh& mesh, const SceneReport& report);
    void remember_image(const ImageDescription& image, const SceneReport& report);

    // The map of a world with this key, if that was the last one's.
    [[nodiscard]] std::unique_ptr<EnvironmentLight> give_environment(std::optional<WorldKey> key);

    // Forgets what the scene, now complete, has not taken.
    void drop_rest(const Scene& scene);

    [[nodiscard]] MeshTrees& trees() { return trees_; }

  private:
    struct KeptMesh {
        Mesh mesh;
        Bounds3 bounds;
    };

    struct KeptImage {
        ImageDescription image;
        Texture texture;
    };

    using Reports = std::map<std::uint64_t, SceneReport>;  // of those in use, by version

    MeshTrees trees_;
    std::map<std::uint64_t, KeptMesh> meshes_;
    std::map<std::uint64_t, KeptImage> images_;
    Reports mesh_reports_;
    Reports image_reports_;
    std::optional<WorldKey> world_key_;  // of the scene's map
    std::unique_ptr<EnvironmentLight> environment_;
};

}  // namespace pharos
