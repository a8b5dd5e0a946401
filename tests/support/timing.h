// Bars on waiting times that hold on machines which stall, share their cores or run a sanitizer.
//
// The time of an attempt is the smaller of the wall clock and the CPU time the process was given:
// what other programs took does not count. The best of several attempts counts, since a delay of
// the program's own comes every time.
#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>

namespace pharos::testing {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr double kSlowdown = 10.0;
#else
inline constexpr double kSlowdown = 1.0;
#endif

inline constexpr int kTimedAttempts = 3;

class Stopwatch {
  public:
    // Seconds since construction: wall clock or CPU, whichever is less.
    [[nodiscard]] double seconds() const {
        const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - wall_;
        return std::min(wall.count(), cpu_now() - cpu_);
    }

  private:
    // Of all threads of the process.
    [[nodiscard]] static double cpu_now() {
        timespec time{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }

    std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
    double cpu_ = cpu_now();
};

// The least of what the attempts return, times or shares of time; none follows once the bar is
// kept.
template <class Attempt>
[[nodiscard]] double least_of(double bar, Attempt&& attempt) {
    double best = attempt();
    for (int i = 1; i < kTimedAttempts && best >= bar; ++i) {
        best = std::min(best, attempt());
    }
    return best;
}

}  // namespace pharos::testing
