// A small seeded generator for tests (SplitMix64): the same numbers on every machine and run.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/math.h"

namespace pharos::test {

class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        state_ += 0x9e3779b97f4a7c15ull;
        std::uint64_t x = state_;
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
        return x ^ (x >> 31);
    }

    // In [0, 1).
    float uniform() { return static_cast<float>(bits() >> 40) * 0x1p-24f; }

    float uniform(float lower, float upper) { return lower + (upper - lower) * uniform(); }

    // Evenly spread in the logarithm; 0 < lower < upper.
    float log_uniform(float lower, float upper) {
        return lower * std::exp(std::log(upper / lower) * uniform());
    }

    // In [0, count).
    std::uint32_t index(std::uint32_t count) {
        return static_cast<std::uint32_t>(((bits() >> 32) * count) >> 32);
    }

    Vec2 uniform2() {
        const float x = uniform();
        return Vec2(x, uniform());
    }

    Vec3 uniform3() {
        const Vec2 xy = uniform2();
        return Vec3(xy.x, xy.y, uniform());
    }

    // Uniform on the unit sphere.
    Vec3 direction() {
        const float z = uniform(-1.0f, 1.0f);
        const float phi = uniform(0.0f, 2.0f * kPi);
        const float r = safe_sqrt(1.0f - z * z);
        return Vec3(r * std::cos(phi), r * std::sin(phi), z);
    }

    // Uniform on the hemisphere around n.
    Vec3 direction_above(const Vec3& n) {
        const Vec3 d = direction();
        return glm::dot(d, n) < 0.0f ? -d : d;
    }

  private:
    std::uint64_t state_;
};

}  // namespace pharos::test
