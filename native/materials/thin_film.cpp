#include "materials/thin_film.h"

#include "materials/xyz_color.h"

namespace pharos {

namespace {

// Amplitude of a reflection, by size and phase.
struct Reflection {
    float power = 0.0f;
    float phase = 0.0f;  // of the reflected wave
};

struct Interface {
    Reflection across;  // s and p polarisation
    Reflection along;
    float cosine = 0.0f;  // behind it; negative: total reflection
};

[[nodiscard]] Reflection from_amplitude(float r) {
    return {r * r, r < 0.0f ? kPi : 0.0f};
}

// Fresnel's amplitudes, at total reflection with their phases.
[[nodiscard]] Interface interface_at(float cosine, float eta) {
    Interface result;
    const float squared = 1.0f - (1.0f - cosine * cosine) / (eta * eta);
    if (squared <= 0.0f) {
        const float decay = std::sqrt(-squared);
        result.across = {1.0f, -2.0f * std::atan2(eta * decay, cosine)};
        result.along = {1.0f, -2.0f * std::atan2(decay, eta * cosine)};
        result.cosine = -1.0f;
        return result;
    }
    const float behind = std::sqrt(squared);
    result.across = from_amplitude((cosine - eta * behind) / (cosine + eta * behind));
    result.along = from_amplitude((eta * cosine - behind) / (eta * cosine + behind));
    result.cosine = behind;
    return result;
}

// What the eye sees of cos(2 pi x / wavelength + shift), as XYZ of equal-energy white 1: the
// transformed Gaussians of the paper's supplemental code, x in nm.
[[nodiscard]] Vec3 sensitivity(float x, float shift) {
    struct Bell {
        float height;    // of the matching function
        float place;     // its wave number, 1 / m
        float variance;  // 1 / m^2
    };

    constexpr Bell kX{5.4856e-13f, 1.6810e6f, 4.3278e9f};
    constexpr Bell kY{4.4201e-13f, 1.7953e6f, 9.3046e9f};
    constexpr Bell kZ{5.2481e-13f, 2.2084e6f, 6.6121e9f};
    constexpr Bell kBlueOfX{9.7470e-14f, 2.2399e6f, 4.5282e9f};
    constexpr float kIntegral = 1.0685e-7f;
    const float phase = 2.0f * kPi * 1e-9f * x;
    const auto seen = [&](const Bell& bell) {
        return bell.height / kIntegral * std::sqrt(2.0f * kPi * bell.variance) *
               std::cos(bell.place * phase + shift) * std::exp(-bell.variance * phase * phase);
    };
    return Vec3(seen(kX) + seen(kBlueOfX), seen(kY), seen(kZ));
}

// One polarisation: `outer` where light enters the film, `inner` at its bottom.
[[nodiscard]] Vec3 series(const Reflection& outer, const Reflection& inner, float path) {
    constexpr int kTerms = 3;
    const float through = 1.0f - outer.power;
    const float both = outer.power * inner.power;
    if (!(both < 1.0f)) {
        return Vec3(1.0f);
    }
    const float returned = through * through * inner.power / (1.0f - both);
    Vec3 sum(outer.power + returned);
    // From inside the outer reflection has the opposite sign.
    const float phase = outer.phase + kPi + inner.phase;
    float term = 2.0f * (returned - through);
    for (int m = 1; m <= kTerms; ++m) {
        const auto order = static_cast<float>(m);
        term *= std::sqrt(both);
        sum += sensitivity(order * path, order * phase) * term;
    }
    return sum;
}

}  // namespace

Rgb film_reflectance(const FilmInterface& film, float cosine) {
    const Interface outer = interface_at(cosine, film.film_eta);
    if (outer.cosine < 0.0f) {
        return Rgb(1.0f);
    }
    const Interface inner = interface_at(outer.cosine, film.base_eta / film.film_eta);
    const float path = 2.0f * film.film_eta * film.thickness * outer.cosine;
    const Vec3 xyz =
        0.5f * (series(outer.across, inner.across, path) + series(outer.along, inner.along, path));
    const Vec3 d65(0.95047f, 1.0f, 1.08883f);
    return glm::clamp(rgb_from_xyz(xyz * d65), 0.0f, 1.0f);
}

}  // namespace pharos
