// A dump file of any contents, its checksum made to fit: read, built, and a sample rendered.
#include <cstring>

#include "core/checksum.h"
#include "render_tiny.h"
#include "scene/dump.h"
#include "support/test_scenes.h"

namespace {

constexpr std::size_t kHeader = 32;
constexpr std::size_t kPayloadSize = 16;
constexpr std::size_t kChecksum = 24;

// What the header says of the payload becomes true.
void make_sound(std::vector<std::uint8_t>& bytes) {
    const std::span<const std::uint8_t> payload = std::span(bytes).subspan(kHeader);
    const std::uint64_t size = payload.size();
    const std::uint64_t sum = pharos::fnv1a(payload);
    std::memcpy(&bytes[kPayloadSize], &size, sizeof(size));
    std::memcpy(&bytes[kChecksum], &sum, sizeof(sum));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::vector<std::uint8_t> whole =
        pharos::dump_to_bytes(pharos::testing::two_rooms(4, 4, 1));
    // Without a header of its own, the input says which bytes of a whole dump are others.
    std::vector<std::uint8_t> bytes(data, data + size);
    if (size < kHeader || std::memcmp(data, whole.data(), 8) != 0) {
        bytes = whole;
        for (std::size_t i = 0; i + 5 <= size; i += 5) {
            std::uint32_t at = 0;
            std::memcpy(&at, data + i, sizeof(at));
            bytes[kHeader + at % (bytes.size() - kHeader)] = data[i + 4];
        }
    }
    make_sound(bytes);
    try {
        pharos::fuzzing::render_tiny(pharos::dump_from_bytes(bytes));
    } catch (const std::runtime_error&) {
        return 0;
    }
    return 0;
}
