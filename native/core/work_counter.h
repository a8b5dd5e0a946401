// How much a part of the renderer has done and how long that took: counted by the thread that does
// it, without locks.
#pragma once

#include <chrono>
#include <cstdint>
#include <utility>

namespace pharos {

struct WorkCounter {
    std::uint64_t items = 0;
    std::uint64_t nanoseconds = 0;

    void add(const WorkCounter& other) {
        items += other.items;
        nanoseconds += other.nanoseconds;
    }

    // What has been counted since the last call.
    [[nodiscard]] WorkCounter take() { return std::exchange(*this, {}); }
};

[[nodiscard]] inline std::uint64_t nanoseconds_now() {
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::steady_clock::now().time_since_epoch())
                                          .count());
}

// Runs a function that returns its number of items, and books both.
template <class Function>
void count_work(WorkCounter& counter, const Function& function) {
    const std::uint64_t begin = nanoseconds_now();
    counter.items += function();
    counter.nanoseconds += nanoseconds_now() - begin;
}

}  // namespace pharos
