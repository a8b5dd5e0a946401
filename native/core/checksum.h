// Checksums of files and of descriptions: against damage and mix-ups, not against malice.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace pharos {

// FNV-1a, 64 bits (Fowler, Noll, Vo): each step is a bijection, so that any single changed byte
// shows.
template <class Byte>
[[nodiscard]] std::uint64_t fnv1a(std::span<Byte> bytes) {
    static_assert(sizeof(Byte) == 1);
    std::uint64_t hash = 0xcbf29ce484222325ull;
    for (const auto byte : bytes) {
        hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001b3ull;
    }
    return hash;
}

// The same idea by words of eight bytes, for streams of gigabytes. The result does not depend on
// how the stream is cut into pieces.
class StreamChecksum {
  public:
    void add(std::span<const std::byte> bytes) {
        length_ += bytes.size();
        while (!bytes.empty()) {
            if (filled_ == 0 && bytes.size() >= sizeof(word_)) {
                std::memcpy(&word_, bytes.data(), sizeof(word_));
                bytes = bytes.subspan(sizeof(word_));
                mix();
                continue;
            }
            word_ |= static_cast<std::uint64_t>(bytes.front()) << (8 * filled_);
            bytes = bytes.subspan(1);
            if (++filled_ == sizeof(word_)) {
                mix();
            }
        }
    }

    [[nodiscard]] std::uint64_t value() const {
        StreamChecksum end = *this;
        end.mix();
        end.word_ = length_;
        end.mix();
        return end.hash_;
    }

  private:
    void mix() {
        hash_ = std::rotl((hash_ ^ word_) * 0x9e3779b97f4a7c15ull, 29);
        word_ = 0;
        filled_ = 0;
    }

    std::uint64_t hash_ = 0xcbf29ce484222325ull;
    std::uint64_t word_ = 0;
    std::uint64_t length_ = 0;
    unsigned filled_ = 0;
};

}  // namespace pharos
