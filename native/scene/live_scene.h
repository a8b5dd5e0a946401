// A scene that is edited: every update describes it as a whole, and what the last one had already
// is kept as it was built (meshes with their acceleration structures, images, the world's map).
//
// The scene that comes out is the one that a fresh LiveScene would build from the same description
// in full: pictures are equal bit by bit. Not thread-safe: nothing renders while it changes.
#pragma once

#include <cstdint>
#include <memory>

#include "core/cancel.h"
#include "core/scene_report.h"
#include "scene/scene.h"

namespace pharos {

// From where and how large a picture of a scene is taken.
struct ViewDescription {
    bool has_camera = true;
    CameraDescription camera;
    FilmDescription film;
    std::uint32_t samples = 1;

    bool operator==(const ViewDescription&) const = default;
};

[[nodiscard]] ViewDescription view_of(const SceneDescription& description);

class LiveScene {
  public:
    LiveScene();
    ~LiveScene();
    LiveScene(const LiveScene&) = delete;
    LiveScene& operator=(const LiveScene&) = delete;

    // Meshes and images whose version the last description had may come without content (a mesh
    // without positions, an image without path, bytes and pixels). Throws Cancelled,
    // std::bad_alloc, and std::invalid_argument where content is missing; there is no scene
    // afterwards, and the next description must be a full one.
    void update(SceneDescription description, const CancelFlag& cancel, SceneReport& report);

    // Another view of the scene, which there must be. Builds nothing, unless the world follows the
    // camera.
    void set_view(const ViewDescription& view, const CancelFlag& cancel, SceneReport& report);

    [[nodiscard]] const Scene* scene() const { return scene_.get(); }  // null: none

  private:
    std::unique_ptr<class ScenePieces> pieces_;
    std::unique_ptr<Scene> scene_;
};

}  // namespace pharos
