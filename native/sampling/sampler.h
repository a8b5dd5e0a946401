// Owen-scrambled Sobol points: sample i of pixel (x, y) depends on (seed, x, y, i) alone.
//
// Hash-based nested uniform scrambling of shuffled four-dimensional Sobol sets (Burley, "Practical
// Hash-based Owen Scrambling", JCGT 9(4), 2020; the permutation is that of Laine and Karras 2011
// with the multipliers published by Vegdahl). Every set of four dimensions is shuffled on its own,
// so any number of sets can be drawn. Values are in [0, 1).
#pragma once

#include <array>
#include <cstdint>

#include "core/math.h"

namespace pharos {

namespace detail {

[[nodiscard]] constexpr std::uint32_t reverse_bits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Laine-Karras permutation: each bit depends on itself and the bits below it.
[[nodiscard]] constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Sobol generator matrices of dimensions 1 to 3 applied bytewise; entries are bit-reversed, because
// the scrambling that follows works on reversed bits.
struct SobolTables {
    std::array<std::array<std::array<std::uint32_t, 256>, 4>, 3> entry{};
};

[[nodiscard]] SobolTables make_sobol_tables();
extern const SobolTables kSobolTables;

}  // namespace detail

// Mixes two words into one (a finaliser of Wellons' lowbias32 family).
[[nodiscard]] constexpr std::uint32_t hash_combine(std::uint32_t a, std::uint32_t b) {
    std::uint32_t x = a ^ (b * 0x9e3779b9u + 0x7f4a7c15u);
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0x735a2d97u;
    x ^= x >> 15;
    return x;
}

// The random sequence of a pixel: hash once, then index by sample.
[[nodiscard]] constexpr std::uint32_t pixel_hash(std::uint32_t seed,
                                                 std::uint32_t x,
                                                 std::uint32_t y) {
    return hash_combine(hash_combine(hash_combine(0x2545f491u, seed), x), y);
}

[[nodiscard]] constexpr float bits_to_unit_float(std::uint32_t bits) {
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// Point `index` of the four-dimensional set `set` of the sequence `hash`.
[[nodiscard]] inline Vec4 sobol_4d(std::uint32_t hash, std::uint32_t index, std::uint32_t set) {
    using detail::reverse_bits;
    using detail::scramble_reversed;
    const std::uint32_t seed = hash_combine(hash, set);
    // Shuffle the order of the points; dimension 0 is the radical inverse of the shuffled index.
    const std::uint32_t shuffled_reversed = scramble_reversed(reverse_bits(index), seed);
    const std::uint32_t shuffled = reverse_bits(shuffled_reversed);
    std::array<std::uint32_t, 4> reversed{shuffled, 0, 0, 0};
    for (std::size_t d = 0; d < 3; ++d) {
        const auto& t = detail::kSobolTables.entry[d];
        reversed[d + 1] = t[0][shuffled & 255u] ^ t[1][(shuffled >> 8) & 255u] ^
                          t[2][(shuffled >> 16) & 255u] ^ t[3][shuffled >> 24];
    }
    Vec4 point;
    std::uint32_t dimension_seed = seed;
    for (std::size_t d = 0; d < 4; ++d) {
        dimension_seed = dimension_seed * 0x915f77f5u + 0x6c078965u;
        const std::uint32_t scrambled =
            scramble_reversed(reversed[d], dimension_seed ^ (dimension_seed >> 15));
        point[static_cast<int>(d)] = bits_to_unit_float(reverse_bits(scrambled));
    }
    return point;
}

}  // namespace pharos
