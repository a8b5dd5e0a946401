#include "session/guide_memory.h"

namespace pharos {

bool GuideMemory::fits(const Scene& scene) const {
    return guide_ && mode_ == scene.description.settings.guiding && guide_->serves(scene.bounds);
}

GuideController& GuideMemory::begin_picture(const Scene& scene, bool edited) {
    const FilmDescription& film = scene.description.film;
    const std::uint64_t pixels = std::uint64_t{film.crop_width} * film.crop_height;
    const bool fitting = fits(scene);
    kept_ = fitting && guide_->status().snapshots > 0;
    if (fitting) {
        guide_->begin_picture(scene.bounds, pixels, edited);
    } else {
        mode_ = scene.description.settings.guiding;
        guide_.emplace(mode_, scene.bounds, pixels);
    }
    guide_->set_budget(budget_);
    return *guide_;
}

}  // namespace pharos
