// The picture as it grows: per-pixel sums in double, and the passes a host can read.
//
// A batch of paths owns its pixels, so adding needs no lock. Every pass of samples has a weight
// fixed by its number; a pixel's value is the weighted sum over the sum of weights. Half of the
// passes also go to a second sum, from whose difference the noise of the picture is estimated.
// Coordinates are those of the rendered window, row 0 at the bottom. Passes on request: passes.h.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "core/state_archive.h"
#include "film/film_description.h"
#include "film/passes.h"

namespace pharos {

// What one camera sample contributes.
struct FilmSample {
    Rgb radiance{0.0f};
    float alpha = 1.0f;
    Vec3 normal{0.0f};        // first hit, world space
    Rgb albedo{0.0f};         // first non-delta hit's albedo estimate
    Vec3 guide_normal{0.0f};  // of the same hit, for denoising
    float depth = 1e10f;      // first hit along the camera's axis; 1e10 where nothing was hit
};

class Film {
  public:
    explicit Film(const FilmDescription& description, const PassLayout& passes = PassLayout());

    [[nodiscard]] std::uint32_t width() const { return width_; }

    [[nodiscard]] std::uint32_t height() const { return height_; }

    // Factor on everything that read() gives of light.
    [[nodiscard]] float exposure() const { return exposure_; }

    // Adds one sample to a pixel; `even` says which half the pass belongs to. Non-finite radiance
    // must have been dropped by the caller (and counted): DCHECKed here.
    void add(std::uint32_t pixel, const FilmSample& sample, double weight, bool even);

    // Adds what a sample says of the passes on request: passes().sample_size() floats. To be called
    // before add() of the same sample.
    void add_passes(std::uint32_t pixel, std::span<const float> values, double weight);

    // Sets a pixel of a wanted pass of the kind AtTheEnd.
    void set_pass(FilmPass pass, std::uint32_t pixel, std::span<const float> values);

    [[nodiscard]] const PassLayout& passes() const { return passes_; }

    [[nodiscard]] bool has(FilmPass pass) const {
        return film_pass_info(pass).kind == PassKind::Basic || passes_.wants(pass);
    }

    // Writes width * height * channels floats of a pass that the film has; a pixel without samples
    // is 0 (depth: 1e10, mist: 1).
    void read(FilmPass pass, std::span<float> out) const;

    // Likewise of a pass that materials write: passes().aovs()[index].
    void read_aov(std::size_t index, std::span<float> out) const;

    // Relative standard error of the picture, from the two halves; 1 with fewer than two passes.
    [[nodiscard]] double noise() const;

    void clear();

    // Samples of a pixel so far.
    [[nodiscard]] std::uint32_t samples(std::uint32_t pixel) const { return count_[pixel]; }

    // Of what was added to a pixel, without exposure; it must have samples.
    [[nodiscard]] double mean_luminance(std::uint32_t pixel) const;

    // All that was added. load() takes the state of a film of the same description and passes;
    // throws StateError, and is then to be thrown away.
    void save(StateWriter& out) const;
    void load(StateReader& in);

  private:
    void read_on_request(FilmPass pass, std::span<float> out) const;

    std::uint32_t width_;
    std::uint32_t height_;
    float exposure_;
    std::vector<double> sum_;       // r g b a per pixel
    std::vector<double> half_sum_;  // r g b of even passes
    std::vector<double> aux_;       // normal, guide normal, albedo per pixel
    std::vector<float> depth_;
    PassLayout passes_;
    std::vector<bool> from_first_;  // by float of a sample's block
    std::vector<double> blocks_;    // passes_.size() per pixel
    std::vector<double> weight_;
    std::vector<double> half_weight_;
    std::vector<std::uint32_t> count_;
};

}  // namespace pharos
