#include "session/memory_estimate.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

#include "film/passes.h"

namespace pharos {

namespace {

// Measured: Embree's compact structure takes 36 bytes a triangle, its default 67 to 70.
constexpr std::uint64_t kTriangleBytes = 40;
constexpr std::uint64_t kInstanceBytes = 160;
constexpr std::uint64_t kLampBytes = 128;
constexpr std::uint64_t kPixelBytes = 160;  // of a film with the basic passes

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

// Address space left under RLIMIT_AS.
std::uint64_t address_space_left() {
    rlimit limit{};
    std::uint64_t used = 0;
    std::ifstream file("/proc/self/statm");
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || !(file >> used)) {
        return std::numeric_limits<std::uint64_t>::max();
    }
    used *= static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

}  // namespace

std::uint64_t estimate_memory(const SceneDescription& description) {
    std::uint64_t bytes = 0;
    for (const Mesh& mesh : description.meshes) {
        bytes += mesh.triangles.size() * kTriangleBytes;
    }
    bytes += description.instances.size() * kInstanceBytes;
    bytes += description.lights.size() * kLampBytes;
    for (const ImageDescription& image : description.images) {
        bytes += image.bytes.size() + image.pixels.size() * sizeof(float);
    }
    const FilmDescription& film = description.film;
    const PassLayout passes(description.passes.wanted);
    return bytes + std::uint64_t{film.crop_width} * film.crop_height *
                       (kPixelBytes + sizeof(double) * passes.size());
}

std::uint64_t available_memory() {
    return std::min(address_space_left(), read_kilobytes("/proc/meminfo", "MemAvailable:"));
}

}  // namespace pharos
