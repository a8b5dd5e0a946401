#include "session/coarse_view.h"

#include <algorithm>

namespace pharos {

namespace {

constexpr std::uint64_t kCoarsePixels = 12000;  // some tens of milliseconds
constexpr std::size_t kChannels = 4;

void read(const RenderSession& session, LivePicture& out) {
    out.width = session.width();
    out.height = session.height();
    out.pixels.resize(kChannels * out.width * out.height);
    if (!session.read(FilmPass::Combined, out.pixels)) {
        out.pixels.clear();
    }
}

bool is_complete(const RenderSession* session) {
    return session != nullptr && session->progress().samples > 0;
}

// Pixels that have no sample yet show the coarse picture's.
void fill_gaps(const LivePicture& coarse, const RenderSession& full, LivePicture& out) {
    std::vector<float> samples(std::size_t{out.width} * out.height);
    if (!full.read(FilmPass::SampleCount, samples)) {
        return;
    }
    for (std::uint32_t y = 0; y < out.height; ++y) {
        const std::uint64_t row = std::uint64_t{y} * coarse.height / out.height;
        for (std::uint32_t x = 0; x < out.width; ++x) {
            const std::size_t pixel = std::size_t{y} * out.width + x;
            if (samples[pixel] == 0.0f) {
                const std::uint64_t column = std::uint64_t{x} * coarse.width / out.width;
                const float* source = &coarse.pixels[kChannels * (row * coarse.width + column)];
                std::copy_n(source, kChannels, &out.pixels[kChannels * pixel]);
            }
        }
    }
}

}  // namespace

std::optional<ViewDescription> coarse_view(const ViewDescription& view) {
    const FilmDescription& film = view.film;
    const std::uint64_t pixels = std::uint64_t{film.crop_width} * film.crop_height;
    std::uint32_t divisor = 1;
    while (pixels / (std::uint64_t{divisor} * divisor) > kCoarsePixels) {
        ++divisor;
    }
    if (divisor == 1) {
        return std::nullopt;
    }
    const auto up = [&](std::uint32_t size) { return (size + divisor - 1) / divisor; };
    ViewDescription out = view;
    out.samples = 1;
    out.film.width = up(film.width);
    out.film.height = up(film.height);
    out.film.crop_x = film.crop_x / divisor;
    out.film.crop_y = film.crop_y / divisor;
    out.film.crop_width = std::min(up(film.crop_width), out.film.width - out.film.crop_x);
    out.film.crop_height = std::min(up(film.crop_height), out.film.height - out.film.crop_y);
    return out;
}

void show_best(const RenderSession* coarse, const RenderSession* full, LivePicture& out) {
    if (is_complete(full)) {
        read(*full, out);
        return;
    }
    if (!is_complete(coarse)) {
        return;
    }
    read(*coarse, out);
    if (full == nullptr || out.pixels.empty()) {
        return;
    }
    LivePicture composed;
    composed.serial = out.serial;
    read(*full, composed);
    if (!composed.pixels.empty()) {
        fill_gaps(out, *full, composed);
        out = std::move(composed);
    }
}

}  // namespace pharos
