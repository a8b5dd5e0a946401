#include "session/guide_memory.h"

#include <algorithm>

namespace pharos {

namespace {

// The field sees positions in units of the box it was made for; far out of it, or in a small part,
// it cannot tell them apart.
constexpr float kMaxGrowth = 2.0f;
constexpr float kMinPart = 0.25f;

bool is_similar(const Bounds3& box, const Bounds3& next) {
    const Vec3 old_extent = box.upper - box.lower;
    const Vec3 extent = next.upper - next.lower;
    const Vec3 joint = glm::max(box.upper, next.upper) - glm::min(box.lower, next.lower);
    const auto largest = [](const Vec3& v) { return std::max({v.x, v.y, v.z}); };
    return largest(joint) <= kMaxGrowth * largest(old_extent) &&
           largest(extent) >= kMinPart * largest(old_extent);
}

}  // namespace

bool GuideMemory::fits(const Scene& scene) const {
    return guide_ && mode_ == scene.description.settings.guiding && is_similar(box_, scene.bounds);
}

GuideController& GuideMemory::begin_picture(const Scene& scene, bool edited) {
    const FilmDescription& film = scene.description.film;
    const std::uint64_t pixels = std::uint64_t{film.crop_width} * film.crop_height;
    const bool fitting = fits(scene);
    kept_ = fitting && guide_->status().snapshots > 0;
    if (fitting) {
        guide_->begin_picture(scene.bounds, pixels, edited);
        return *guide_;
    }
    mode_ = scene.description.settings.guiding;
    box_ = scene.bounds;
    return guide_.emplace(mode_, box_, pixels);
}

}  // namespace pharos
