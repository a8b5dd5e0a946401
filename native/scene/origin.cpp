#include "scene/origin.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/mend.h"

namespace pharos {

namespace {

// The origin along one axis; reorders the values.
float origin_of(std::vector<float>& values) {
    if (values.empty()) {
        return 0.0f;
    }
    const auto begin = values.begin();
    const auto tenth = static_cast<std::ptrdiff_t>(values.size() / 10);
    std::nth_element(begin, begin + tenth, values.end());
    const float low = begin[tenth];
    std::nth_element(begin, values.end() - 1 - tenth, values.end());
    const float high = values.end()[-1 - tenth];
    const float nearest = std::min(std::abs(low), std::abs(high));
    const bool one_side = (low > 0.0f) == (high > 0.0f);
    if (!one_side || nearest < kNearOrigin || high - low > nearest) {
        return 0.0f;
    }
    return kOriginStep * std::round((low + 0.5f * (high - low)) / kOriginStep);
}

}  // namespace

Vec3 find_origin(const Scene& scene) {
    Vec3 origin(0.0f);
    std::vector<float> values(scene.instances.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            const Instance& instance = scene.instances[i];
            const Vec3 middle = scene.mesh_bounds[instance.mesh].center();
            const float value = transform_point(instance.to_world, middle)[axis];
            values[i] = std::isfinite(value) ? value : 0.0f;
        }
        origin[axis] = origin_of(values);
    }
    return origin;
}

Mat4 moved_by(const Mat4& to_world, const Vec3& offset) {
    Mat4 moved = to_world;
    for (int axis = 0; axis < 3; ++axis) {
        moved[3][axis] = static_cast<float>(static_cast<double>(to_world[3][axis]) +
                                            static_cast<double>(offset[axis]));
    }
    return moved;
}

void move_to_origin(Scene& scene, const Vec3& origin) {
    scene.shading.origin = origin;
    for (Instance& instance : scene.instances) {
        instance.to_world = moved_by(instance.to_world, -origin);
        instance.to_object = invert(instance.to_world).value_or(instance.to_object);
    }
    for (LightDescription& lamp : scene.description.lights) {
        lamp.to_world = moved_by(lamp.to_world, -origin);
    }
}

}  // namespace pharos
