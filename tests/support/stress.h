// Tests that try to break something by numbers: few cases usually, many with PHAROS_LONG_TESTS=1.
//
// What they say, `STRESS what|cases|worst|bar`, is the table of tests/stress.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace pharos::testing {

[[nodiscard]] inline std::uint64_t case_count(std::uint64_t usual, std::uint64_t long_form) {
    return std::getenv("PHAROS_LONG_TESTS") != nullptr ? long_form : usual;
}

inline void say_stress(const char* what, std::uint64_t cases, double worst, double bar) {
    std::printf(
        "STRESS %s|%llu|%.3g|%.3g\n", what, static_cast<unsigned long long>(cases), worst, bar);
}

}  // namespace pharos::testing
