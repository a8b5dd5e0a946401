#include "scene/view.h"

#include <algorithm>

#include "camera/camera.h"

namespace pharos {

void prepare_view(Scene& scene) {
    const SceneDescription& d = scene.description;
    if (!d.has_camera) {
        return;
    }
    ShadingContext& context = scene.shading;
    context.world_to_camera = Camera(scene.camera(), d.film.width, d.film.height).world_to_camera();
    context.perspective = d.camera.type == CameraType::Perspective;
    context.pixel =
        (d.camera.window_upper - d.camera.window_lower) /
        glm::max(Vec2(static_cast<float>(d.film.width), static_cast<float>(d.film.height)),
                 Vec2(1.0f));
    // The window (distance 1 of a perspective camera) onto [0, 1] x [0, 1].
    const Vec2 lower = d.camera.window_lower;
    const Vec2 scale = 1.0f / (d.camera.window_upper - lower);
    Mat4 m(1.0f);
    m[0][0] = scale.x;
    m[1][1] = scale.y;
    const int shift = d.camera.type == CameraType::Perspective ? 2 : 3;
    const float sign = d.camera.type == CameraType::Perspective ? 1.0f : -1.0f;
    m[shift][0] = sign * lower.x * scale.x;
    m[shift][1] = sign * lower.y * scale.y;
    if (d.camera.type == CameraType::Perspective) {
        m[2][3] = -1.0f;  // w = depth
        m[3][3] = 0.0f;
    }
    context.camera_to_window = m;
}

bool asks_view(const NodeProgram& program) {
    return std::ranges::any_of(program.ops, [](const NodeOp& op) {
        const bool seen_from_camera =
            op.mode == static_cast<std::uint16_t>(CoordinateOutput::Camera) ||
            op.mode == static_cast<std::uint16_t>(CoordinateOutput::Window);
        return op.code == NodeOpCode::CameraData ||
               (op.code == NodeOpCode::Coordinate && seen_from_camera);
    });
}

}  // namespace pharos
