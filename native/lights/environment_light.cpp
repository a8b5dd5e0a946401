#include "lights/environment_light.h"

#include <stdexcept>
#include <vector>

#include "sampling/warps.h"

namespace pharos {

namespace {

Rgb usable(const Rgb& radiance) {
    Rgb out(0.0f);
    for (int c = 0; c < 3; ++c) {
        out[c] = std::isfinite(radiance[c]) ? radiance[c] : 0.0f;
    }
    return out;
}

float magnitude(const Rgb& radiance) {
    const Rgb c = glm::abs(usable(radiance));
    return (c.x + c.y + c.z) * (1.0f / 3.0f);
}

// Solid angle of row y of `height` rows, over 2 pi: the difference of its edges' cosines.
double row_measure(std::uint32_t y, std::uint32_t height) {
    const double step = std::numbers::pi / height;
    return 2.0 * std::sin((y + 0.5) * step) * std::sin(0.5 * step);
}

// The mean over each texel of the bilinear interpolant between texel centres: one step of the
// kernel (1, 6, 1) / 8 along each axis. Without it the half of a one-texel sun that interpolation
// spreads over its neighbours would hardly be sampled.
std::vector<float> footprint_means(std::span<const Rgb> radiance,
                                   std::uint32_t width,
                                   std::uint32_t height,
                                   const CancelFlag* cancel) {
    std::vector<float> value(radiance.size());
    std::vector<float> along_x(value.size());
    for (std::size_t y = 0; y < height; ++y) {
        throw_if_cancelled(cancel);
        float* row = value.data() + y * width;
        for (std::size_t x = 0; x < width; ++x) {
            row[x] = magnitude(radiance[y * width + x]);
        }
        for (std::size_t x = 0; x < width; ++x) {
            const float sides = row[x == 0 ? width - 1 : x - 1] + row[x + 1 == width ? 0 : x + 1];
            along_x[y * width + x] = 0.75f * row[x] + 0.125f * sides;
        }
    }
    for (std::size_t y = 0; y < height; ++y) {
        throw_if_cancelled(cancel);
        const float* row = along_x.data() + y * width;
        const float* below = y == 0 ? row : row - width;
        const float* above = y + 1 == height ? row : row + width;
        for (std::size_t x = 0; x < width; ++x) {
            value[y * width + x] = 0.75f * row[x] + 0.125f * (below[x] + above[x]);
        }
    }
    return value;
}

}  // namespace

EnvironmentLight::EnvironmentLight(std::span<const Rgb> radiance,
                                   std::uint32_t width,
                                   std::uint32_t height,
                                   const CancelFlag* cancel) {
    if (width == 0 || height == 0 || radiance.size() != std::size_t{width} * height) {
        throw std::invalid_argument("EnvironmentLight: radiance does not match width x height");
    }
    constant_ = width == 1 && height == 1;
    if (constant_) {
        mean_ = usable(radiance[0]);
        return;
    }
    std::vector<float> weights = footprint_means(radiance, width, height, cancel);
    double mean[3] = {0.0, 0.0, 0.0};
    for (std::uint32_t y = 0; y < height; ++y) {
        throw_if_cancelled(cancel);
        const double measure = row_measure(y, height);
        for (std::uint32_t x = 0; x < width; ++x) {
            const std::size_t i = std::size_t{y} * width + x;
            const Rgb texel = usable(radiance[i]);
            for (int c = 0; c < 3; ++c) {
                mean[c] += static_cast<double>(texel[c]) * measure;
            }
            weights[i] *= static_cast<float>(measure);
        }
    }
    for (int c = 0; c < 3; ++c) {
        mean_[c] = static_cast<float>(mean[c] / (2.0 * width));
    }
    throw_if_cancelled(cancel);
    map_ = Distribution2D(weights, width, height);
    throw_if_cancelled(cancel);
    // Cosines of the rows' edges and the inverse solid angle of a texel.
    row_cosine_.resize(std::size_t{height} + 1);
    row_density_.resize(height);
    for (std::uint32_t y = 0; y <= height; ++y) {
        row_cosine_[y] = static_cast<float>(-std::cos(std::numbers::pi * y / height));
    }
    for (std::uint32_t y = 0; y < height; ++y) {
        row_density_[y] =
            static_cast<float>(width / (2.0 * std::numbers::pi * row_measure(y, height)));
    }
}

EnvironmentLight::Sample EnvironmentLight::sample(const Vec2& u) const {
    if (constant_) {
        return {sample_uniform_sphere(u), uniform_sphere_pdf()};
    }
    const Distribution2D::Sample texel = map_.sample(u);
    // Uniform in solid angle within the texel.
    const float z = lerp(row_cosine_[texel.y], row_cosine_[texel.y + 1], texel.offset.y);
    const SinCos phi = sincos_turns(0.5f - texel.uv.x);
    const float radius = safe_sqrt((1.0f - z) * (1.0f + z));
    return {Vec3(radius * phi.cos, radius * phi.sin, z),
            map_.pmf(texel.x, texel.y) * row_density_[texel.y]};
}

float EnvironmentLight::pdf(const Vec3& wi) const {
    if (constant_) {
        return uniform_sphere_pdf();
    }
    const Vec2 uv = direction_to_equirectangular(wi);
    const auto texel = [](float x, std::uint32_t cells) {
        return std::min(static_cast<std::uint32_t>(x * static_cast<float>(cells)), cells - 1);
    };
    const std::uint32_t y = texel(uv.y, map_.height());
    return map_.pmf(texel(uv.x, map_.width()), y) * row_density_[y];
}

Vec2 direction_to_equirectangular(const Vec3& d) {
    // acos(z) = atan2(r, z), which stays exact near the poles.
    const float theta = std::atan2(std::sqrt(d.x * d.x + d.y * d.y), d.z);
    const float u = 0.5f - std::atan2(d.y, d.x) * (0.5f * kInvPi);
    const float v = 1.0f - theta * kInvPi;
    return Vec2(std::clamp(u, 0.0f, kOneMinusEpsilon), std::clamp(v, 0.0f, kOneMinusEpsilon));
}

Vec3 equirectangular_to_direction(const Vec2& uv) {
    const SinCos theta = sincos_turns(0.5f * (1.0f - uv.y));
    const SinCos phi = sincos_turns(0.5f - uv.x);
    return Vec3(theta.sin * phi.cos, theta.sin * phi.sin, theta.cos);
}

}  // namespace pharos
