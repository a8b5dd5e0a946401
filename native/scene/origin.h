// Where a scene's own coordinates begin, so that what lies far from the world's origin keeps the
// precision of floats near zero (internal to scene/).
//
// Within a Scene every position is the world's minus its origin, exactly subtracted; programs,
// passes and probes add it where the user sees a position. It follows from the objects alone: a
// view that moves changes nothing.
#pragma once

#include "core/math.h"
#include "scene/scene.h"

namespace pharos {

inline constexpr float kNearOrigin = 256.0f;  // metres: what begins nearer stays where it is
inline constexpr float kOriginStep = 64.0f;   // metres: an origin is a multiple

// Axis by axis the middle of the scene's instances where nine of ten lie further from zero than
// they lie apart, and at least kNearOrigin away; else 0.
[[nodiscard]] Vec3 find_origin(const Scene& scene);

[[nodiscard]] Mat4 moved_by(const Mat4& to_world, const Vec3& offset);

// Moves instances and lamps of a scene that has no surfaces yet; the camera follows by
// Scene::camera().
void move_to_origin(Scene& scene, const Vec3& origin);

}  // namespace pharos
