// The passes of a picture beside its colour: which there are, which are asked for, where they lie.
// Materials may write passes of their own beside those (AOVs).
//
// Every film holds the basic passes. The others cost nothing unless they are asked for: PassLayout
// gives each a place in one block of floats per camera sample (what paths write, averaged over the
// samples or taken from the first) and then in a block per pixel (what is written at the end).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pharos {

// Stored by number in dump files: append only.
enum class FilmPass : std::uint8_t {
    // basic
    Combined,
    Depth,
    Normal,
    DenoisingNormal,
    DenoisingAlbedo,
    SampleCount,
    // on request
    Position,         // first hit, world space
    Uv,               // of the map rendered by default; third channel 1 where there is one
    Mist,             // 0 near ... 1 far and background
    ObjectIndex,      // pass index of the first hit's object
    MaterialIndex,    // and of its material
    Emission,         // surfaces the camera sees directly
    Environment,      // the world, likewise
    GuideDirection,   // mean direction of the learned light at the first hit; zero: not guided
    GuideKappa,       // concentration of a single lobe with the same mean
    GuideIrradiance,  // A
    GuideShare,       // of the sampling that follows the guide; the rest follows the material
    // light by the lobes of the first hit, without their colours: (direct + indirect) * colour
    // over the three, with Emission and Environment, is Combined
    DiffuseDirect,
    DiffuseIndirect,
    DiffuseColor,
    GlossyDirect,
    GlossyIndirect,
    GlossyColor,
    TransmissionDirect,
    TransmissionIndirect,
    TransmissionColor,
    Effort,  // rays times squared difference from the mean so far: merged parts give about that
    Count
};

inline constexpr std::size_t kFilmPasses = static_cast<std::size_t>(FilmPass::Count);

enum class PassKind : std::uint8_t {
    Basic,
    Average,      // weighted mean over the samples
    FirstSample,  // of the first sample: a mean would be of nothing
    AtTheEnd      // written once by whoever knows it
};

struct FilmPassInfo {
    const char* name;      // in files
    const char* channels;  // their letters
    PassKind kind;
    bool exposed;  // light: multiplied by the film's exposure
};

[[nodiscard]] const FilmPassInfo& film_pass_info(FilmPass pass);
[[nodiscard]] int film_pass_channels(FilmPass pass);

[[nodiscard]] constexpr std::uint32_t pass_bit(FilmPass pass) {
    return 1u << static_cast<unsigned>(pass);
}

inline constexpr std::uint32_t kGuidePasses =
    pass_bit(FilmPass::GuideDirection) | pass_bit(FilmPass::GuideKappa) |
    pass_bit(FilmPass::GuideIrradiance) | pass_bit(FilmPass::GuideShare);

// The pass of colours that a pass of light is divided by; Count for any other.
[[nodiscard]] constexpr FilmPass color_of(FilmPass pass) {
    switch (pass) {
        case FilmPass::DiffuseDirect:
        case FilmPass::DiffuseIndirect:
            return FilmPass::DiffuseColor;
        case FilmPass::GlossyDirect:
        case FilmPass::GlossyIndirect:
            return FilmPass::GlossyColor;
        case FilmPass::TransmissionDirect:
        case FilmPass::TransmissionIndirect:
            return FilmPass::TransmissionColor;
        default:
            return FilmPass::Count;
    }
}

inline constexpr std::uint32_t kLightPasses =
    pass_bit(FilmPass::DiffuseDirect) | pass_bit(FilmPass::DiffuseIndirect) |
    pass_bit(FilmPass::DiffuseColor) | pass_bit(FilmPass::GlossyDirect) |
    pass_bit(FilmPass::GlossyIndirect) | pass_bit(FilmPass::GlossyColor) |
    pass_bit(FilmPass::TransmissionDirect) | pass_bit(FilmPass::TransmissionIndirect) |
    pass_bit(FilmPass::TransmissionColor);

// A pass that materials write by name: a colour, with a fourth channel of 1 where one wrote, or a
// number. A mean over the samples.
struct AovDescription {
    std::string name;
    bool color = true;

    bool operator==(const AovDescription&) const = default;
};

[[nodiscard]] inline const char* aov_channels(const AovDescription& aov) {
    return aov.color ? "RGBA" : "X";
}

class PassLayout {
  public:
    // Bits of unknown and of basic passes are ignored; light brings its colour along.
    explicit PassLayout(std::uint32_t wanted = 0, std::span<const AovDescription> aovs = {});

    [[nodiscard]] bool wants(FilmPass pass) const { return (wanted_ & pass_bit(pass)) != 0; }

    [[nodiscard]] bool wants_any(std::uint32_t bits) const { return (wanted_ & bits) != 0; }

    // First float of a pass that is wanted.
    [[nodiscard]] std::uint32_t offset(FilmPass pass) const {
        return offset_[static_cast<std::size_t>(pass)];
    }

    struct AovPlace {
        std::uint32_t offset = 0;
        std::uint32_t channels = 0;
    };

    [[nodiscard]] std::span<const AovPlace> aovs() const { return aovs_; }

    // Floats of a camera sample; the rest of the block is written at the end.
    [[nodiscard]] std::uint32_t sample_size() const { return sample_size_; }

    [[nodiscard]] std::uint32_t size() const { return size_; }

  private:
    std::uint32_t wanted_ = 0;
    std::uint32_t sample_size_ = 0;
    std::uint32_t size_ = 0;
    std::array<std::uint32_t, kFilmPasses> offset_{};
    std::vector<AovPlace> aovs_;
};

}  // namespace pharos
