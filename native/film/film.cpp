#include "film/film.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/color.h"

namespace pharos {

namespace {

constexpr float kBackgroundDepth = 1e10f;
constexpr std::size_t kAux = 9;  // normal, guide normal, albedo

// Exposure and a pass' mean may be more together than a float holds.
float to_float(double value) {
    constexpr auto kLargest = static_cast<double>(std::numeric_limits<float>::max());
    return static_cast<float>(std::clamp(value, -kLargest, kLargest));
}

}  // namespace

Film::Film(const FilmDescription& description, const PassLayout& passes)
    : width_(description.crop_width),
      height_(description.crop_height),
      exposure_(description.exposure),
      passes_(passes),
      from_first_(passes.sample_size()) {
    const std::size_t pixels = std::size_t{width_} * height_;
    sum_.resize(pixels * 4);
    half_sum_.resize(pixels * 3);
    aux_.resize(pixels * kAux);
    depth_.resize(pixels, kBackgroundDepth);
    weight_.resize(pixels);
    half_weight_.resize(pixels);
    count_.resize(pixels);
    blocks_.resize(pixels * passes_.size());
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        if (passes_.wants(pass) && film_pass_info(pass).kind == PassKind::FirstSample) {
            const auto begin = from_first_.begin() + passes_.offset(pass);
            std::fill(begin, begin + film_pass_channels(pass), true);
        }
    }
}

void Film::add_passes(std::uint32_t pixel, std::span<const float> values, double weight) {
    DCHECK(values.size() == passes_.sample_size());
    double* block = &blocks_[std::size_t{pixel} * passes_.size()];
    const bool first = count_[pixel] == 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = static_cast<double>(values[i]);
        if (!from_first_[i]) {
            block[i] += weight * value;
        } else if (first) {
            block[i] = value;
        }
    }
}

void Film::set_pass(FilmPass pass, std::uint32_t pixel, std::span<const float> values) {
    CHECK(passes_.wants(pass) && film_pass_info(pass).kind == PassKind::AtTheEnd);
    std::ranges::copy(
        values,
        blocks_.begin() + static_cast<std::ptrdiff_t>(std::size_t{pixel} * passes_.size() +
                                                      passes_.offset(pass)));
}

void Film::read_on_request(FilmPass pass, std::span<float> out) const {
    CHECK(passes_.wants(pass));
    const auto channels = static_cast<std::size_t>(film_pass_channels(pass));
    const FilmPassInfo& info = film_pass_info(pass);
    const FilmPass divisor = color_of(pass);
    for (std::size_t i = 0; i < weight_.size(); ++i) {
        const double* block = &blocks_[i * passes_.size() + passes_.offset(pass)];
        double scale = info.exposed ? static_cast<double>(exposure_) : 1.0;
        if (info.kind == PassKind::Average) {
            scale *= weight_[i] > 0.0 ? 1.0 / weight_[i] : 0.0;
        }
        const double* color = divisor == FilmPass::Count
                                  ? nullptr
                                  : &blocks_[i * passes_.size() + passes_.offset(divisor)];
        if (color != nullptr) {
            scale = static_cast<double>(exposure_);  // both are sums of the same weights
        }
        for (std::size_t c = 0; c < channels; ++c) {
            const double value = color == nullptr ? block[c]
                                 : color[c] > 0.0 ? block[c] / color[c]
                                                  : 0.0;
            out[i * channels + c] = to_float(value * scale);
        }
        if (pass == FilmPass::Mist) {
            // Paths write how clearly the surface shows.
            out[i] = std::clamp(1.0f - out[i], 0.0f, 1.0f);
        }
    }
}

void Film::read_aov(std::size_t index, std::span<float> out) const {
    CHECK(index < passes_.aovs().size());
    const PassLayout::AovPlace place = passes_.aovs()[index];
    CHECK_EQ(out.size(), weight_.size() * place.channels);
    for (std::size_t i = 0; i < weight_.size(); ++i) {
        const double* block = &blocks_[i * passes_.size() + place.offset];
        const double scale = weight_[i] > 0.0 ? 1.0 / weight_[i] : 0.0;
        for (std::size_t c = 0; c < place.channels; ++c) {
            out[i * place.channels + c] = to_float(block[c] * scale);
        }
    }
}

void Film::add(std::uint32_t pixel, const FilmSample& sample, double weight, bool even) {
    DCHECK(is_finite(sample.radiance));
    double* sum = &sum_[std::size_t{pixel} * 4];
    double* half = &half_sum_[std::size_t{pixel} * 3];
    double* aux = &aux_[std::size_t{pixel} * kAux];
    for (int c = 0; c < 3; ++c) {
        const double value = weight * static_cast<double>(sample.radiance[c]);
        sum[c] += value;
        half[c] += even ? value : 0.0;
        aux[c] += weight * static_cast<double>(sample.normal[c]);
        aux[3 + c] += weight * static_cast<double>(sample.guide_normal[c]);
        aux[6 + c] += weight * static_cast<double>(sample.albedo[c]);
    }
    sum[3] += weight * static_cast<double>(sample.alpha);
    if (count_[pixel] == 0) {
        depth_[pixel] =
            sample.depth;  // as Cycles: of one sample, an average would lie between surfaces
    }
    weight_[pixel] += weight;
    half_weight_[pixel] += even ? weight : 0.0;
    ++count_[pixel];
}

void Film::read(FilmPass pass, std::span<float> out) const {
    const std::size_t pixels = weight_.size();
    const auto channels = static_cast<std::size_t>(film_pass_channels(pass));
    CHECK_EQ(out.size(), pixels * channels);
    if (film_pass_info(pass).kind != PassKind::Basic) {
        read_on_request(pass, out);
        return;
    }
    if (pass == FilmPass::Depth) {
        std::copy(depth_.begin(), depth_.end(), out.begin());
        return;
    }
    const std::size_t aux_offset = pass == FilmPass::Normal            ? 0
                                   : pass == FilmPass::DenoisingNormal ? 3
                                                                       : 6;
    for (std::size_t i = 0; i < pixels; ++i) {
        const double scale = weight_[i] > 0.0 ? 1.0 / weight_[i] : 0.0;
        float* pixel = &out[i * channels];
        if (pass == FilmPass::Combined) {
            const double exposed = scale * static_cast<double>(exposure_);
            for (std::size_t c = 0; c < 3; ++c) {
                pixel[c] = to_float(sum_[i * 4 + c] * exposed);
            }
            pixel[3] = to_float(sum_[i * 4 + 3] * scale);
        } else if (pass == FilmPass::SampleCount) {
            pixel[0] = static_cast<float>(count_[i]);
        } else {
            for (std::size_t c = 0; c < 3; ++c) {
                pixel[c] = to_float(aux_[i * kAux + aux_offset + c] * scale);
            }
        }
    }
}

double Film::noise() const {
    double difference = 0.0;
    double total = 0.0;
    for (std::size_t i = 0; i < weight_.size(); ++i) {
        const double even = half_weight_[i];
        const double odd = weight_[i] - even;
        if (even <= 0.0 || odd <= 0.0) {
            return 1.0;
        }
        // With halves of equal weight the whole's error is half of their difference.
        double pixel_difference = 0.0;
        double pixel_total = 0.0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double half = half_sum_[i * 3 + c];
            const double mean = sum_[i * 4 + c] / weight_[i];
            const double d = 0.5 * (half / even - (sum_[i * 4 + c] - half) / odd);
            pixel_difference += d * d;
            pixel_total += mean * mean;
        }
        difference += pixel_difference / (pixel_total + 0.03);
        total += 1.0;
    }
    return total > 0.0 ? std::sqrt(difference / total) : 1.0;
}

void Film::save(StateWriter& out) const {
    out(sum_, half_sum_, aux_, depth_, blocks_, weight_, half_weight_, count_);
}

void Film::load(StateReader& in) {
    for (std::vector<double>* values : {&sum_, &half_sum_, &aux_}) {
        in.expect(*values);
    }
    in.expect(depth_);
    for (std::vector<double>* values : {&blocks_, &weight_, &half_weight_}) {
        in.expect(*values);
    }
    in.expect(count_);
}

double Film::mean_luminance(std::uint32_t pixel) const {
    const double* rgb = &sum_[std::size_t{4} * pixel];
    return static_cast<double>(luminance(Rgb(static_cast<float>(rgb[0]),
                                             static_cast<float>(rgb[1]),
                                             static_cast<float>(rgb[2])))) /
           weight_[pixel];
}

void Film::clear() {
    std::ranges::fill(sum_, 0.0);
    std::ranges::fill(half_sum_, 0.0);
    std::ranges::fill(aux_, 0.0);
    std::ranges::fill(blocks_, 0.0);
    std::ranges::fill(depth_, kBackgroundDepth);
    std::ranges::fill(weight_, 0.0);
    std::ranges::fill(half_weight_, 0.0);
    std::ranges::fill(count_, 0u);
}

}  // namespace pharos
