#include "film/passes.h"

#include <string_view>

#include "core/check.h"

namespace pharos {

namespace {

constexpr std::array<FilmPassInfo, kFilmPasses> kInfos{{
    {"Combined", "RGBA", PassKind::Basic, true},
    {"Depth", "Z", PassKind::Basic, false},
    {"Normal", "XYZ", PassKind::Basic, false},
    {"Denoising Normal", "XYZ", PassKind::Basic, false},
    {"Denoising Albedo", "RGB", PassKind::Basic, false},
    {"Debug Sample Count", "X", PassKind::Basic, false},
    {"Position", "XYZ", PassKind::FirstSample, false},
    {"UV", "UVA", PassKind::Average, false},
    {"Mist", "Z", PassKind::Average, false},
    {"Object Index", "X", PassKind::FirstSample, false},
    {"Material Index", "X", PassKind::FirstSample, false},
    {"Emission", "RGB", PassKind::Average, true},
    {"Environment", "RGB", PassKind::Average, true},
    {"Guide Direction", "XYZ", PassKind::AtTheEnd, false},
    {"Guide Kappa", "X", PassKind::AtTheEnd, false},
    {"Guide Irradiance", "X", PassKind::AtTheEnd, false},
    {"Guide Share", "X", PassKind::AtTheEnd, false},
    {"Diffuse Direct", "RGB", PassKind::Average, true},
    {"Diffuse Indirect", "RGB", PassKind::Average, true},
    {"Diffuse Color", "RGB", PassKind::Average, false},
    {"Glossy Direct", "RGB", PassKind::Average, true},
    {"Glossy Indirect", "RGB", PassKind::Average, true},
    {"Glossy Color", "RGB", PassKind::Average, false},
    {"Transmission Direct", "RGB", PassKind::Average, true},
    {"Transmission Indirect", "RGB", PassKind::Average, true},
    {"Transmission Color", "RGB", PassKind::Average, false},
    {"Effort", "X", PassKind::Average, false},
}};

}  // namespace

const FilmPassInfo& film_pass_info(FilmPass pass) {
    const auto index = static_cast<std::size_t>(pass);
    CHECK(index < kFilmPasses);
    return kInfos[index];
}

int film_pass_channels(FilmPass pass) {
    return static_cast<int>(std::string_view(film_pass_info(pass).channels).size());
}

PassLayout::PassLayout(std::uint32_t wanted, std::span<const AovDescription> aovs) {
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        const auto pass = static_cast<FilmPass>(i);
        if ((wanted & pass_bit(pass)) != 0 && color_of(pass) != FilmPass::Count) {
            wanted |= pass_bit(color_of(pass));
        }
    }
    for (const bool at_the_end : {false, true}) {
        for (std::size_t i = 0; i < kFilmPasses; ++i) {
            const auto pass = static_cast<FilmPass>(i);
            const PassKind kind = film_pass_info(pass).kind;
            const bool asked = (wanted & pass_bit(pass)) != 0 && kind != PassKind::Basic;
            if (asked && (kind == PassKind::AtTheEnd) == at_the_end) {
                wanted_ |= pass_bit(pass);
                offset_[i] = size_;
                size_ += static_cast<std::uint32_t>(film_pass_channels(pass));
            }
        }
        if (!at_the_end) {
            for (const AovDescription& aov : aovs) {
                aovs_.push_back({size_, aov.color ? 4u : 1u});
                size_ += aovs_.back().channels;
            }
            sample_size_ = size_;
        }
    }
}

}  // namespace pharos
