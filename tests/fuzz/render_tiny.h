// A render of any description that takes no time and opens no file.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "core/check.h"
#include "session/render_session.h"

namespace pharos::fuzzing {

// Whatever the scene holds, the picture is finite.
inline void render_tiny(SceneDescription description) {
    FilmDescription& film = description.film;
    film.crop_width = std::min(film.crop_width, 4u);
    film.crop_height = std::min(film.crop_height, 4u);
    description.settings.samples = std::min(description.settings.samples, 2u);
    // Paths of files belong to the tests of images.
    for (ImageDescription& image : description.images) {
        image.path.clear();
    }
    RenderSession session(std::move(description), 1);
    if (!session.wait(std::chrono::milliseconds(2000))) {
        session.cancel();
    }
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    std::vector<float> picture(std::size_t{session.width()} * session.height() * 4);
    if (session.progress().state != SessionState::Failed &&
        session.read(FilmPass::Combined, picture)) {
        CHECK(std::ranges::all_of(picture, [](float value) { return std::isfinite(value); }));
    }
}

}  // namespace pharos::fuzzing
