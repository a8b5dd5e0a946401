// The user's input made safe to trace: what cannot be used is taken out and reported under the name
// of its object (internal to scene/). Degenerate triangles are harmless and stay.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/cancel.h"
#include "core/scene_report.h"
#include "geometry/accelerator.h"
#include "geometry/mesh.h"
#include "lights/light_description.h"
#include "scene/scene_description.h"

namespace pharos {

// Afterwards every position is finite and below kMaxCoordinate, every index in range, every array
// of the size its domain asks for. Triangles with broken corners are dropped.
void mend_mesh(Mesh& mesh, const CancelFlag& cancel, SceneReport& report);

inline constexpr float kMaxCoordinate = 1e15f;  // metres; squares of lengths stay finite

// The inverse, unless the matrix flattens space (relative to its columns' lengths: a tiny object is
// not flat) or is no number.
[[nodiscard]] std::optional<Mat4> invert(const Mat4& to_world);

// Nothing for an instance that cannot be shown: no mesh, or a matrix without an inverse. Slots
// without a material get `default_material`.
[[nodiscard]] std::optional<Instance> mend_instance(const SceneDescription& description,
                                                    const InstanceDescription& instance,
                                                    std::uint32_t default_material,
                                                    SceneReport& report);

// Takes out lamps with a value that is no number.
void mend_lamps(std::vector<LightDescription>& lamps, SceneReport& report);

// Takes out a camera whose matrix or window is no number.
void mend_camera(SceneDescription& description, SceneReport& report);

// An exposure that is no number is 1.
void mend_film(FilmDescription& film, SceneReport& report);

}  // namespace pharos
