// Two ways to the same result, of which a scene decides the faster: both are tried in turn on the
// first items and timed by the CPU time of the thread; the faster then does the rest. What comes
// out must not depend on the way, as the choice may differ from run to run.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <ctime>

namespace pharos {

class SpeedTrial {
  public:
    // Calls work(second_way) for a batch of `items`. Thread-safe.
    template <class Work>
    void run(std::size_t items, const Work& work) {
        const int choice = choice_.load(std::memory_order_relaxed);
        if (choice >= 0 || items < kMinItems) {
            work(choice == 1);
            return;
        }
        // Thue-Morse's order: in step with no rhythm of the batches, such as the bounces of paths.
        const auto turn = turn_.fetch_add(1, std::memory_order_relaxed);
        const auto way = static_cast<std::size_t>(std::popcount(turn) % 2);
        const std::uint64_t begin = thread_nanoseconds();
        work(way == 1);
        time_[way].fetch_add(thread_nanoseconds() - begin, std::memory_order_relaxed);
        items_[way].fetch_add(items, std::memory_order_relaxed);
        decide();
    }

    // 0 or 1 once decided, else -1.
    [[nodiscard]] int choice() const { return choice_.load(std::memory_order_relaxed); }

  private:
    static constexpr std::size_t kMinItems = 128;        // a batch worth to be timed
    static constexpr std::uint64_t kTrialItems = 65536;  // each

    static std::uint64_t thread_nanoseconds() {
        std::timespec now{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
        return static_cast<std::uint64_t>(now.tv_sec) * 1000000000u +
               static_cast<std::uint64_t>(now.tv_nsec);
    }

    void decide() {
        std::array<double, 2> cost{};
        for (std::size_t way = 0; way < 2; ++way) {
            const std::uint64_t items = items_[way].load(std::memory_order_relaxed);
            if (items < kTrialItems) {
                return;
            }
            cost[way] = static_cast<double>(time_[way].load(std::memory_order_relaxed)) /
                        static_cast<double>(items);
        }
        choice_.store(cost[1] < cost[0] ? 1 : 0, std::memory_order_relaxed);
    }

    std::atomic<int> choice_{-1};
    std::atomic<std::uint64_t> turn_{0};
    std::array<std::atomic<std::uint64_t>, 2> time_{};
    std::array<std::atomic<std::uint64_t>, 2> items_{};
};

}  // namespace pharos
