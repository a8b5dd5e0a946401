#include "session/field_file.h"

#include "core/state_file.h"

namespace pharos {

namespace {

constexpr StateFileKind kField{0x454449554750ull, 2, "guide file"};  // "PGUIDE"

}  // namespace

std::vector<std::byte> field_to_bytes(const GuideController& guide, GuidingMode mode) {
    return state_file_bytes(kField, [&](StateWriter& out) {
        out(static_cast<std::uint32_t>(mode));
        guide.save(out);
    });
}

void freeze_field(std::span<const std::byte> bytes, GuidingMode mode, GuideController& guide) {
    parse_state_file(bytes, kField, [&](StateReader& in) {
        std::uint32_t stored = 0;
        in(stored);
        if (stored != static_cast<std::uint32_t>(mode)) {
            throw StateError("it was made with another guide");
        }
        guide.load_frozen(in);
    });
}

GuideController continue_field(std::span<const std::byte> bytes, const NextPicture& next) {
    GuideController guide(next.mode, next.scene_box, next.pixels);
    parse_state_file(bytes, kField, [&](StateReader& in) {
        std::uint32_t stored = 0;
        in(stored);
        if (stored != static_cast<std::uint32_t>(next.mode)) {
            throw StateError("it was made with another guide");
        }
        guide.load_earlier(in);
    });
    if (!guide.serves(next.scene_box)) {
        throw StateError("it was made for a scene of another size or place");
    }
    return guide;
}

}  // namespace pharos
