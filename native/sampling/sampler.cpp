#include "sampling/sampler.h"

namespace pharos::detail {

namespace {

// Direction numbers of Joe and Kuo (2008): dimension 1 has the polynomial x + 1, dimension 2
// x^2 + x + 1 with m = (1, 3), dimension 3 x^3 + x + 1 with m = (1, 3, 1).
struct Polynomial {
    unsigned degree;
    std::uint32_t coefficients;  // a_1 ... a_(s-1), highest first
    std::array<std::uint32_t, 3> m;
};

constexpr std::array<Polynomial, 3> kPolynomials{
    {{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}}};

std::array<std::uint32_t, 32> direction_numbers(const Polynomial& polynomial) {
    std::array<std::uint32_t, 32> v{};
    const unsigned s = polynomial.degree;
    for (unsigned i = 0; i < 32; ++i) {
        if (i < s) {
            v[i] = polynomial.m[i] << (31 - i);
            continue;
        }
        v[i] = v[i - s] ^ (v[i - s] >> s);
        for (unsigned k = 1; k < s; ++k) {
            if ((polynomial.coefficients >> (s - 1 - k)) & 1u) {
                v[i] ^= v[i - k];
            }
        }
    }
    return v;
}

}  // namespace

SobolTables make_sobol_tables() {
    SobolTables tables;
    for (std::size_t d = 0; d < kPolynomials.size(); ++d) {
        const auto v = direction_numbers(kPolynomials[d]);
        for (std::size_t byte = 0; byte < 4; ++byte) {
            for (std::size_t value = 0; value < 256; ++value) {
                std::uint32_t x = 0;
                for (std::size_t bit = 0; bit < 8; ++bit) {
                    x ^= (value >> bit) & 1u ? v[8 * byte + bit] : 0u;
                }
                tables.entry[d][byte][value] = reverse_bits(x);
            }
        }
    }
    return tables;
}

const SobolTables kSobolTables = make_sobol_tables();

}  // namespace pharos::detail
