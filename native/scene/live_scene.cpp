#include "scene/live_scene.h"

#include <utility>

#include "core/fp_state.h"
#include "core/parallel.h"
#include "scene/mend.h"
#include "scene/scene_build.h"
#include "scene/scene_lights.h"
#include "scene/scene_pieces.h"
#include "scene/view.h"
#include "scene/world.h"

namespace pharos {

ViewDescription view_of(const SceneDescription& description) {
    return {
        description.has_camera, description.camera, description.film, description.settings.samples};
}

LiveScene::LiveScene() = default;
LiveScene::~LiveScene() = default;

void LiveScene::update(SceneDescription description,
                       const CancelFlag& cancel,
                       SceneReport& report) {
    const FloatStateGuard float_state;
    auto pieces = pieces_ ? std::move(pieces_) : std::make_unique<ScenePieces>();
    if (scene_) {
        pieces->take(*scene_);
        scene_.reset();
    }
    scene_ = build_scene(std::move(description), cancel, report, pieces.get());
    pieces->drop_rest(*scene_);
    pieces_ = std::move(pieces);
}

void LiveScene::set_view(const ViewDescription& view,
                         const CancelFlag& cancel,
                         SceneReport& report) {
    const FloatStateGuard float_state;
    SceneDescription& d = scene_->description;
    d.camera = view.camera;
    d.film = view.film;
    d.settings.samples = view.samples;
    d.has_camera = view.has_camera;
    mend_camera(d, report);
    prepare_view(*scene_);
    if (asks_view(scene_->world.program)) {
        ThreadPool pool;
        scene_->environment.reset();
        prepare_world(*scene_, pool, cancel, nullptr);
        prepare_lights(*scene_, cancel);
    }
}

}  // namespace pharos
