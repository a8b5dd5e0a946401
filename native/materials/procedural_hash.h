// Random numbers that follow from a place: the hash behind noise, cells and white noise.
//
// Bob Jenkins, "lookup3" (2006, public domain): words are added to three state words, mixed every
// three words, and finished. Float keys count by their bits. Results over [0, 1], both included.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pharos::detail {

template <std::size_t N>
[[nodiscard]] inline std::uint32_t hash_words(const std::array<std::uint32_t, N>& key) {
    static_assert(N >= 1 && N <= 4);
    const std::uint32_t seed = 0xdeadbeefu + 4u * static_cast<std::uint32_t>(N) + 13u;
    std::uint32_t a = seed;
    std::uint32_t b = seed;
    std::uint32_t c = seed;
    // A step of mixing: x takes part in y's place, turned by k bits.
    const auto mix = [](std::uint32_t& x, std::uint32_t& y, std::uint32_t& z, int k) {
        x = (x - z) ^ std::rotl(z, k);
        z += y;
    };
    const auto finish = [](std::uint32_t& x, std::uint32_t y, int k) {
        x = (x ^ y) - std::rotl(y, k);
    };
    a += key[0];
    if constexpr (N > 1) {
        b += key[1];
    }
    if constexpr (N > 2) {
        c += key[2];
    }
    if constexpr (N > 3) {
        mix(a, b, c, 4);
        mix(b, c, a, 6);
        mix(c, a, b, 8);
        mix(a, b, c, 16);
        mix(b, c, a, 19);
        mix(c, a, b, 4);
        a += key[3];
    }
    finish(c, b, 14);
    finish(a, c, 11);
    finish(b, a, 25);
    finish(c, b, 16);
    finish(a, c, 4);
    finish(b, a, 14);
    finish(c, b, 24);
    return c;
}

[[nodiscard]] inline float unit_float(std::uint32_t hash) {
    return static_cast<float>(hash) * (1.0f / static_cast<float>(0xffffffffu));
}

template <std::size_t N>
[[nodiscard]] inline float hash_floats(const std::array<float, N>& key) {
    std::array<std::uint32_t, N> words{};
    for (std::size_t k = 0; k < N; ++k) {
        words[k] = std::bit_cast<std::uint32_t>(key[k]);
    }
    return unit_float(hash_words(words));
}

// Three numbers from one key: the key alone, then with another number behind it. Four words take
// other orders instead.
template <std::size_t N>
[[nodiscard]] inline std::array<float, 3> hash_floats_to_3(const std::array<float, N>& key) {
    if constexpr (N == 4) {
        const auto [x, y, z, w] = key;
        return {hash_floats<4>({x, y, z, w}),
                hash_floats<4>({z, x, w, y}),
                hash_floats<4>({w, z, y, x})};
    } else {
        std::array<float, N + 1> longer{};
        for (std::size_t k = 0; k < N; ++k) {
            longer[k] = key[k];
        }
        std::array<float, 3> out{hash_floats(key), 0.0f, 0.0f};
        longer[N] = 1.0f;
        out[1] = hash_floats(longer);
        longer[N] = 2.0f;
        out[2] = hash_floats(longer);
        return out;
    }
}

// As many numbers as the key has.
template <std::size_t N>
[[nodiscard]] inline std::array<float, N> hash_floats_to_same(const std::array<float, N>& key) {
    if constexpr (N == 4) {
        const auto [x, y, z, w] = key;
        return {hash_floats<4>({x, y, z, w}),
                hash_floats<4>({w, x, y, z}),
                hash_floats<4>({z, w, x, y}),
                hash_floats<4>({y, z, w, x})};
    } else {
        const std::array<float, 3> three = hash_floats_to_3(key);
        std::array<float, N> out{};
        for (std::size_t k = 0; k < N; ++k) {
            out[k] = three[k];
        }
        return out;
    }
}

}  // namespace pharos::detail
