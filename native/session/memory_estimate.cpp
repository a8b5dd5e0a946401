#include "session/memory_estimate.h"

#include "film/passes.h"

namespace pharos {

namespace {

// Measured: Embree's compact structure takes 36 bytes a triangle, its default 67 to 70.
constexpr std::uint64_t kTriangleBytes = 40;
constexpr std::uint64_t kInstanceBytes = 160;
constexpr std::uint64_t kLampBytes = 128;
constexpr std::uint64_t kPixelBytes = 160;  // of a film with the basic passes

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

}  // namespace pharos
