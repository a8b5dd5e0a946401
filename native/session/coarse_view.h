// What is shown of a view before each of its pixels has a sample: a small picture, and the pixels
// that are there already over it. The final picture knows nothing of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scene/live_scene.h"
#include "session/render_session.h"

namespace pharos {

// RGBA, bottom row first.
struct LivePicture {
    std::uint32_t width = 0;  // less than the view's while only a coarse picture is there
    std::uint32_t height = 0;
    std::uint64_t serial = 0;
    std::vector<float> pixels;  // empty: nothing to show yet
};

// The same view with fewer pixels and one sample; nothing for a view that is small itself.
[[nodiscard]] std::optional<ViewDescription> coarse_view(const ViewDescription& view);

// Fills size and pixels with the best that is there; either session may be null.
void show_best(const RenderSession* coarse, const RenderSession* full, LivePicture& out);

}  // namespace pharos
