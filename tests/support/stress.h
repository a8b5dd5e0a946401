// Tests that try to break something by numbers: few cases usually, many with PHAROS_LONG_TESTS=1,
// a quarter of the few under a sanitizer.
//
// What they say, `STRESS what|cases|worst|bar`, is the table of tests/stress.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "support/timing.h"

namespace pharos::testing {

// Threads of sessions whose results do not depend on them: 2, or PHAROS_TEST_THREADS.
[[nodiscard]] inline unsigned thread_count() {
    const char* wanted = std::getenv("PHAROS_TEST_THREADS");
    return wanted != nullptr ? static_cast<unsigned>(std::atoi(wanted)) : 2;
}

[[nodiscard]] inline std::uint64_t case_count(std::uint64_t usual, std::uint64_t long_form) {
    if (std::getenv("PHAROS_LONG_TESTS") != nullptr) {
        return long_form;
    }
    return kSlowdown > 1.0 ? (usual + 3) / 4 : usual;
}

inline void say_stress(const char* what, std::uint64_t cases, double worst, double bar) {
    std::printf(
        "STRESS %s|%llu|%.3g|%.3g\n", what, static_cast<unsigned long long>(cases), worst, bar);
}

}  // namespace pharos::testing
