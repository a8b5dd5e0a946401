#include "materials/sky_model.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "materials/xyz_color.h"

namespace pharos {

namespace {

// --- wavelengths ---

constexpr int kBands = 21;  // 380 ... 780 nm
constexpr float kFirstBand = 380.0f;
constexpr float kBandStep = 20.0f;
using Spectrum = std::array<float, kBands>;

// Colour matching functions of the CIE 1931 standard observer (CIE 015), by band.
constexpr float kObserver[kBands][3] = {
    {0.0014f, 0.0000f, 0.0065f}, {0.0143f, 0.0004f, 0.0679f}, {0.1344f, 0.0040f, 0.6456f},
    {0.3483f, 0.0230f, 1.7471f}, {0.2908f, 0.0600f, 1.6692f}, {0.0956f, 0.1390f, 0.8130f},
    {0.0049f, 0.3230f, 0.2720f}, {0.0633f, 0.7100f, 0.0782f}, {0.2904f, 0.9540f, 0.0203f},
    {0.5945f, 0.9950f, 0.0039f}, {0.9163f, 0.8700f, 0.0017f}, {1.0622f, 0.6310f, 0.0008f},
    {0.8544f, 0.3810f, 0.0002f}, {0.4479f, 0.1750f, 0.0000f}, {0.1649f, 0.0610f, 0.0000f},
    {0.0468f, 0.0170f, 0.0000f}, {0.0114f, 0.0041f, 0.0000f}, {0.0029f, 0.0010f, 0.0000f},
    {0.0007f, 0.0002f, 0.0000f}, {0.0002f, 0.0001f, 0.0000f}, {0.0000f, 0.0000f, 0.0000f}};

// Cross sections of ozone from 370 nm on, every 10 nm, 1e-27 m^2 (University of Bremen, molecular
// spectroscopy group, reference spectra of 2011).
constexpr float kOzoneFrom = 370.0f;
constexpr float kOzoneStep = 10.0f;
constexpr float kOzone[] = {
    0.2182f, 0.2818f, 0.6636f, 1.527f, 2.763f, 5.52f,  8.451f, 15.82f, 23.16f, 36.69f, 49.24f,
    77.52f,  90.16f,  148.0f,  160.2f, 213.9f, 275.5f, 309.1f, 350.0f, 426.6f, 467.2f, 439.8f,
    470.1f,  501.9f,  430.5f,  374.0f, 321.5f, 266.2f, 223.8f, 185.2f, 147.3f, 120.9f, 94.23f,
    74.55f,  65.66f,  51.05f,  41.5f,  42.28f, 32.37f, 24.51f, 28.01f};

[[nodiscard]] float ozone_cross_section(float nm) {
    const float place = (nm - kOzoneFrom) / kOzoneStep;
    const auto i = static_cast<std::size_t>(place);
    return lerp(kOzone[i], kOzone[i + 1], place - static_cast<float>(i)) * 1e-27f;
}

struct Atmosphere {
    Spectrum sun{};       // irradiance above the air, W / m^2 / nm
    Spectrum rayleigh{};  // scattering at sea level, 1 / m
    Spectrum ozone{};     // absorption in the layer's middle
    std::array<Vec3, kBands> eye{};
};

constexpr double kSunTemperature = 5778.0;
constexpr double kSunSolidAngle = 6.773e-5;
constexpr double kAirIndex = 1.0002926;
constexpr double kAirMolecules = 2.504e25;   // a m^3, at 20 degrees
constexpr float kOzoneMolecules = 5.45e18f;  // a m^3 in the middle of 300 Dobson units
constexpr float kOzoneOffset = 6.0f;         // nm: best agreement with Blender's bands
constexpr float kEarthRadius = 6360e3f;
constexpr float kAirRadius = 6420e3f;
constexpr float kRayleighHeight = 8000.0f;
constexpr float kMieHeight = 1200.0f;
constexpr float kMie = 2e-5f;
constexpr float kMieExtinction = 1.11f;
constexpr float kMieG = 0.76f;

[[nodiscard]] Atmosphere make_atmosphere() {
    Atmosphere a;
    for (std::size_t i = 0; i < kBands; ++i) {
        const float nm = kFirstBand + kBandStep * static_cast<float>(i);
        const double m = static_cast<double>(nm) * 1e-9;
        // Planck's law.
        const double planck = 1.191043e-16 / (m * m * m * m * m) /
                              (std::exp(1.438777e-2 / (m * kSunTemperature)) - 1.0);
        a.sun[i] = static_cast<float>(planck * kSunSolidAngle * 1e-9);
        // Rayleigh's law.
        constexpr double kContrast = kAirIndex * kAirIndex - 1.0;
        constexpr double kPi3 = 31.00627668;
        a.rayleigh[i] = static_cast<float>(8.0 * kPi3 * kContrast * kContrast /
                                           (3.0 * kAirMolecules * m * m * m * m));
        a.ozone[i] = ozone_cross_section(nm - kOzoneOffset) * kOzoneMolecules;
        a.eye[i] = Vec3(kObserver[i][0], kObserver[i][1], kObserver[i][2]) * kBandStep;
    }
    return a;
}

// --- the way through the air ---

struct Densities {
    float rayleigh = 0.0f;
    float mie = 0.0f;
    float ozone = 0.0f;
};

[[nodiscard]] Densities densities_at(const SkyParameters& in, float height) {
    const float layer = 1.0f - std::abs(height - 25e3f) / 15e3f;
    return {in.air * std::exp(-height / kRayleighHeight),
            in.dust * std::exp(-height / kMieHeight),
            in.ozone * std::max(layer, 0.0f)};
}

void add(Densities& sum, const Densities& d, float length) {
    sum.rayleigh += d.rayleigh * length;
    sum.mie += d.mie * length;
    sum.ozone += d.ozone * length;
}

// From a point in the atmosphere to its outer edge.
[[nodiscard]] float way_out(const Vec3& p, const Vec3& d) {
    const float b = glm::dot(p, d);
    const float c = glm::dot(p, p) - kAirRadius * kAirRadius;
    return -b + safe_sqrt(b * b - c);
}

[[nodiscard]] bool meets_ground(const Vec3& p, const Vec3& d) {
    const float b = glm::dot(p, d);
    return b < 0.0f && glm::dot(p, p) - b * b < kEarthRadius * kEarthRadius;
}

[[nodiscard]] float height_of(const Vec3& p) {
    return std::max(glm::length(p) - kEarthRadius, 0.0f);
}

// Densities on the way out of the air, by Gauss and Laguerre's rule of eight points over a way 25
// long: they lie close together where the air is dense.
[[nodiscard]] Densities column(const SkyParameters& in, const Vec3& p, const Vec3& d) {
    constexpr float kReach = 25.0f;
    constexpr float kNode[] = {0.170279632f,
                               0.903701777f,
                               2.251086630f,
                               4.266700170f,
                               7.045905402f,
                               10.75851601f,
                               15.74067864f,
                               22.86313174f};
    constexpr float kWeight[] = {0.369188589f,
                                 0.418786781f,
                                 0.175794987f,
                                 0.0333434923f,
                                 0.00279453624f,
                                 9.07650877e-5f,
                                 8.48574672e-7f,
                                 1.04800117e-9f};
    const float length = way_out(p, d);
    Densities sum;
    for (std::size_t i = 0; i < std::size(kNode); ++i) {
        const Vec3 at = p + d * (length * kNode[i] / kReach);
        const float weight = kWeight[i] * std::exp(kNode[i]) / kReach;
        add(sum, densities_at(in, height_of(at)), weight * length);
    }
    return sum;
}

[[nodiscard]] float transmittance(const Atmosphere& air, const Densities& d, std::size_t band) {
    return std::exp(-(air.rayleigh[band] * d.rayleigh + kMie * kMieExtinction * d.mie +
                      air.ozone[band] * d.ozone));
}

[[nodiscard]] Rgb to_rgb(const Atmosphere& air, const Spectrum& spectrum) {
    Vec3 xyz(0.0f);
    for (std::size_t i = 0; i < kBands; ++i) {
        xyz += air.eye[i] * spectrum[i];
    }
    return glm::max(rgb_from_xyz(xyz), Rgb(0.0f));
}

[[nodiscard]] Spectrum single_scattering(const Atmosphere& air,
                                         const SkyParameters& in,
                                         const Vec3& eye,
                                         const Vec3& view,
                                         const Vec3& sun) {
    constexpr int kSteps = 32;
    const float mu = glm::dot(view, sun);
    const float rayleigh_phase = 3.0f / (16.0f * kPi) * (1.0f + mu * mu);
    constexpr float g2 = kMieG * kMieG;
    const float mie_phase = 3.0f / (8.0f * kPi) * (1.0f - g2) * (1.0f + mu * mu) /
                            ((2.0f + g2) * std::pow(1.0f + g2 - 2.0f * kMieG * mu, 1.5f));
    const float step = way_out(eye, view) / kSteps;
    Spectrum sum{};
    Densities passed;
    for (int i = 0; i < kSteps; ++i) {
        const Vec3 p = eye + view * (step * (static_cast<float>(i) + 0.5f));
        const Densities here = densities_at(in, height_of(p));
        add(passed, here, step);
        if (!meets_ground(p, sun)) {
            Densities all = column(in, p, sun);
            add(all, passed, 1.0f);
            for (std::size_t band = 0; band < kBands; ++band) {
                const float scattered = air.rayleigh[band] * here.rayleigh * rayleigh_phase +
                                        kMie * here.mie * mie_phase;
                sum[band] += air.sun[band] * scattered * transmittance(air, all, band) * step;
            }
        }
    }
    return sum;
}

// Blender keeps the dome in a picture of 512 x 128 texels and reads it half a texel beside where it
// was computed; towards the horizon that is seen, and so done here too. Rows are Blender's; over
// the azimuth, of which one half is enough, columns lie closer near the sun.
constexpr int kElevations = 128;
constexpr int kAzimuths = 96;
constexpr float kAzimuthShift = kPi / 512.0f;

[[nodiscard]] Vec3 direction_of(float elevation, float rotation) {
    return Vec3(std::sin(rotation) * std::cos(elevation),
                std::cos(rotation) * std::cos(elevation),
                std::sin(elevation));
}

[[nodiscard]] float angle_between(const Vec3& a, const Vec3& b) {
    return 2.0f * std::atan2(glm::length(a - b), glm::length(a + b));
}

}  // namespace

SkyModel::SkyModel(const SkyParameters& parameters) : in_(parameters) {
    if (in_.type == SkyType::Preetham) {
        sun_ = normalize_or(in_.sun_direction, Vec3(0.0f, 0.0f, 1.0f));
        prepare_preetham();
    } else {
        sun_ = direction_of(in_.elevation, in_.rotation);
        prepare_scattering();
    }
}

Rgb SkyModel::radiance(const Vec3& direction) const {
    return in_.type == SkyType::Preetham ? preetham(direction) : scattered(direction);
}

// --- Preetham ---

namespace {

// Brightness over the dome (Perez et al. 1993).
[[nodiscard]] float perez(const float (&k)[5], float cos_theta, float gamma) {
    const float c = std::max(cos_theta, 1e-3f);
    const float cos_gamma = std::cos(gamma);
    return (1.0f + k[0] * std::exp(k[1] / c)) *
           (1.0f + k[2] * std::exp(k[3] * gamma) + k[4] * cos_gamma * cos_gamma);
}

// Zenith chromaticity: rows of the paper's matrices, highest power of the sun's angle first.
[[nodiscard]] float zenith_chroma(const float (&m)[3][4], float t, float sun) {
    float sum = 0.0f;
    for (const auto& row : m) {
        sum = sum * t + ((row[0] * sun + row[1]) * sun + row[2]) * sun + row[3];
    }
    return sum;
}

}  // namespace

void SkyModel::prepare_preetham() {
    const float t = in_.turbidity;
    const float sun = std::acos(std::clamp(sun_.z, -1.0f, 1.0f));
    // Appendix A.2: slope and offset of the five coefficients for Y, x and y.
    constexpr float kSlope[3][5] = {{0.1787f, -0.3554f, -0.0227f, 0.1206f, -0.0670f},
                                    {-0.0193f, -0.0665f, -0.0004f, -0.0641f, -0.0033f},
                                    {-0.0167f, -0.0950f, -0.0079f, -0.0441f, -0.0109f}};
    constexpr float kOffset[3][5] = {{-1.4630f, 0.4275f, 5.3251f, -2.5771f, 0.3703f},
                                     {-0.2592f, 0.0008f, 0.2125f, -0.8989f, 0.0452f},
                                     {-0.2608f, 0.0092f, 0.2102f, -1.6537f, 0.0529f}};
    for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 5; ++k) {
            perez_[c][k] = kSlope[c][k] * t + kOffset[c][k];
        }
    }
    constexpr float kX[3][4] = {{0.00166f, -0.00375f, 0.00209f, 0.0f},
                                {-0.02903f, 0.06377f, -0.03202f, 0.00394f},
                                {0.11693f, -0.21196f, 0.06052f, 0.25886f}};
    constexpr float kY[3][4] = {{0.00275f, -0.00610f, 0.00317f, 0.0f},
                                {-0.04214f, 0.08970f, -0.04153f, 0.00516f},
                                {0.15346f, -0.26756f, 0.06670f, 0.26688f}};
    const float chi = (4.0f / 9.0f - t / 120.0f) * (kPi - 2.0f * sun);
    const float luminance = (4.0453f * t - 4.9710f) * std::tan(chi) - 0.2155f * t + 2.4192f;
    // Blender's scale of kilocandelas.
    constexpr float kScale = 0.06f;
    zenith_ = Vec3(luminance * kScale, zenith_chroma(kX, t, sun), zenith_chroma(kY, t, sun));
    for (int c = 0; c < 3; ++c) {
        zenith_[c] /= perez(perez_[c], 1.0f, sun);
    }
}

Rgb SkyModel::preetham(const Vec3& direction) const {
    // Below the horizon the sky is as just above it.
    const float gamma = angle_between(direction, sun_);
    const float y = zenith_.x * perez(perez_[0], direction.z, gamma);
    const float cx = zenith_.y * perez(perez_[1], direction.z, gamma);
    const float cy = zenith_.z * perez(perez_[2], direction.z, gamma);
    if (!(cy > 0.0f)) {
        return Rgb(0.0f);
    }
    return rgb_from_xyz(Vec3(cx / cy * y, y, (1.0f - cx - cy) / cy * y));
}

// --- single scattering ---

void SkyModel::prepare_scattering() {
    const Atmosphere air = make_atmosphere();
    const Vec3 eye(0.0f, 0.0f, kEarthRadius + std::clamp(in_.altitude, 1.0f, 59999.0f));
    const Vec3 sun = direction_of(in_.elevation, 0.0f);
    dome_.resize(kElevations * kAzimuths);
    for (int y = 0; y < kElevations; ++y) {
        const float t = static_cast<float>(y) / kElevations;
        for (int x = 0; x < kAzimuths; ++x) {
            const float azimuth = kPi * sqr(static_cast<float>(x) / (kAzimuths - 1));
            const float shifted = std::min(azimuth + kAzimuthShift, kPi);
            const Vec3 view = direction_of(0.5f * kPi * t * t, shifted);
            dome_[static_cast<std::size_t>(y * kAzimuths + x)] =
                to_rgb(air, single_scattering(air, in_, eye, view, sun));
        }
    }
    const float half = 0.5f * in_.sun_size;
    const float cap = 4.0f * kPi * sqr(std::sin(0.5f * half));
    const auto edge = [&](float elevation) {
        const Vec3 d = direction_of(elevation, 0.0f);
        if (!(cap > 0.0f) || elevation < 0.0f) {
            return Rgb(0.0f);
        }
        // Cycles' disc shines through no ozone: with it red is 8 % too dark at half a radian.
        Densities way = column(in_, eye, d);
        way.ozone = 0.0f;
        Spectrum spectrum{};
        for (std::size_t i = 0; i < kBands; ++i) {
            spectrum[i] = air.sun[i] * transmittance(air, way, i) / cap;
        }
        return to_rgb(air, spectrum) * in_.sun_intensity;
    };
    disc_low_ = edge(std::max(in_.elevation - half, 0.0f));
    disc_high_ = edge(in_.elevation + half);
}

Rgb SkyModel::scattered(const Vec3& direction) const {
    // Below the horizon its colour fades away.
    constexpr float kDeepest = 0.4f;
    if (direction.z < -kDeepest) {
        return Rgb(0.0f);
    }
    const float fade = direction.z < 0.0f ? 1.0f + direction.z / kDeepest : 1.0f;
    const float elevation = std::asin(std::clamp(direction.z, -1.0f, 1.0f));
    const float half = 0.5f * in_.sun_size;
    const float from_sun = angle_between(direction, sun_);
    if (in_.sun_disc && from_sun < half && direction.z > 0.0f) {
        // Darker towards the limb.
        const float limb = 1.0f - 0.6f * (1.0f - safe_sqrt(1.0f - sqr(from_sun / half)));
        const float t = saturate((elevation - in_.elevation) / in_.sun_size + 0.5f);
        return lerp(disc_low_, disc_high_, t) * limb;
    }
    const float row_place =
        std::sqrt(std::max(elevation, 0.0f) / (0.5f * kPi)) * kElevations - 0.5f;
    const float v = std::clamp(row_place, 0.0f, static_cast<float>(kElevations - 1));
    const float turn = std::atan2(direction.x, direction.y) - in_.rotation;
    const float around = std::abs(std::remainder(turn, 2.0f * kPi));
    const float u = std::sqrt(around / kPi) * (kAzimuths - 1);
    const int x = std::min(static_cast<int>(u), kAzimuths - 2);
    const int y = std::min(static_cast<int>(v), kElevations - 2);
    const Rgb* row = &dome_[static_cast<std::size_t>(y * kAzimuths + x)];
    const float fx = u - static_cast<float>(x);
    const float fy = v - static_cast<float>(y);
    const Rgb sky =
        lerp(lerp(row[0], row[1], fx), lerp(row[kAzimuths], row[kAzimuths + 1], fx), fy);
    return sky * (fade * fade * fade);
}

}  // namespace pharos
