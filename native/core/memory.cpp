#include "core/memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <new>
#include <string>
#include <system_error>
#include <thread>

#include <sys/resource.h>
#include <unistd.h>

namespace pharos {

namespace {

// A line `key: 123 kB` of a file of /proc, in bytes; the largest number where there is none.
std::uint64_t read_kilobytes(const char* path, const std::string& key) {
    std::ifstream file(path);
    std::string word;
    while (file >> word) {
        std::uint64_t value = 0;
        if (word == key && file >> value) {
            return value * 1024;
        }
    }
    return std::numeric_limits<std::uint64_t>::max();
}

// Libraries start threads as they go, one per core, and each takes address space for its stack and
// for a heap of its own. TBB loses a task where it cannot start one, and waits for it for ever.
std::uint64_t address_space_of_threads() {
    constexpr std::uint64_t kThread = std::uint64_t{72} << 20;  // a stack, and glibc's arena
    constexpr std::uint64_t kSpare = std::uint64_t{64} << 20;
    return kThread * std::thread::hardware_concurrency() + kSpare;
}

// Address space left under RLIMIT_AS.
std::uint64_t address_space_left() {
    rlimit limit{};
    std::uint64_t used = 0;
    std::ifstream file("/proc/self/statm");
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || !(file >> used)) {
        return std::numeric_limits<std::uint64_t>::max();
    }
    used *= static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    used += address_space_of_threads();
    return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

}  // namespace

std::uint64_t available_memory() {
    return std::min(address_space_left(), read_kilobytes("/proc/meminfo", "MemAvailable:"));
}

bool is_out_of_memory(const std::exception& error) {
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
           (system != nullptr && (system->code() == std::errc::resource_unavailable_try_again ||
                                  system->code() == std::errc::not_enough_memory));
}

}  // namespace pharos
