// The two archives of the dump format: one writes values to bytes, one reads them back.
//
// Both offer `archive(a, b, ...)` over the same types: integers, floats, enums (32 bit), GLM
// vectors and matrices, strings and vectors (a 64-bit count, then the elements), and structures for
// which dump_fields.h names the members. The reader checks every count against the bytes that are
// left, so that a damaged file can neither make it run over nor allocate more than a few times its
// size.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "core/checksum.h"
#include "core/math.h"
#include "image/image_description.h"

namespace pharos::dump {

static_assert(std::endian::native == std::endian::little);

// Values stored as they lie in memory.
template <class T>
inline constexpr bool kPlain =
    (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || std::is_same_v<T, Vec2> ||
    std::is_same_v<T, Vec3> || std::is_same_v<T, Vec4> || std::is_same_v<T, UVec3> ||
    std::is_same_v<T, Mat4>;

// 2: passes on request; 3: attributes; 4: AOVs, tiles, lamps' nodes, displacement; 5: portals
inline constexpr std::uint32_t kVersion = 5;
inline constexpr std::uint32_t kOldestVersion = 1;

class Writer {
  public:
    template <class T>
    using Value = const T;

    // Another version than the newest: for tests of reading old files.
    explicit Writer(std::uint32_t version = kVersion) : version_(version) {}

    // Keeps no bytes, only their checksum.
    explicit Writer(StreamChecksum& checksum) : version_(kVersion), checksum_(&checksum) {}

    [[nodiscard]] std::uint32_t version() const { return version_; }

    template <class... T>
    void operator()(const T&... values) {
        (put(values), ...);
    }

    // The image with its file's bytes in place of the path, if need be in `copy`. A file
    // that cannot be read, or is no image, stays a path, and so a missing image.
    static const ImageDescription& self_contained(const ImageDescription& image,
                                                  ImageDescription& copy);

    [[nodiscard]] std::vector<std::uint8_t>& bytes() { return bytes_; }

  private:
    void put_bytes(const void* data, std::size_t size) {
        const auto* first = static_cast<const std::uint8_t*>(data);
        if (checksum_ != nullptr) {
            checksum_->add(std::as_bytes(std::span(first, size)));
            return;
        }
        bytes_.insert(bytes_.end(), first, first + size);
    }

    template <class T>
    void put(const T& value) {
        if constexpr (kPlain<T>) {
            put_bytes(&value, sizeof(T));
        } else if constexpr (std::is_same_v<T, bool>) {
            put(static_cast<std::uint8_t>(value ? 1 : 0));
        } else if constexpr (std::is_enum_v<T>) {
            put(static_cast<std::uint32_t>(value));
        } else {
            fields(*this, value);
        }
    }

    void put(const std::string& text) {
        put(static_cast<std::uint64_t>(text.size()));
        put_bytes(text.data(), text.size());
    }

    template <class T>
    void put(const std::vector<T>& values) {
        put(static_cast<std::uint64_t>(values.size()));
        if constexpr (kPlain<T>) {
            put_bytes(values.data(), values.size() * sizeof(T));
        } else {
            for (const T& value : values) {
                put(value);
            }
        }
    }

    std::vector<std::uint8_t> bytes_;
    std::uint32_t version_;
    StreamChecksum* checksum_ = nullptr;
};

class Reader {
  public:
    template <class T>
    using Value = T;

    explicit Reader(std::span<const std::uint8_t> bytes, std::uint32_t version)
        : rest_(bytes), version_(version) {}

    [[nodiscard]] std::uint32_t version() const { return version_; }

    template <class... T>
    void operator()(T&... values) {
        (get(values), ...);
    }

    static ImageDescription& self_contained(ImageDescription& image, ImageDescription& /*copy*/) {
        return image;
    }

    [[nodiscard]] std::size_t remaining() const { return rest_.size(); }

  private:
    void get_bytes(void* data, std::size_t size) {
        if (size > rest_.size()) {
            throw std::runtime_error("truncated or damaged");
        }
        if (size > 0) {
            std::memcpy(data, rest_.data(), size);
        }
        rest_ = rest_.subspan(size);
    }

    // A count of elements that take at least `size` bytes each.
    [[nodiscard]] std::size_t get_count(std::size_t size) {
        std::uint64_t count = 0;
        get(count);
        if (count > rest_.size() / size) {
            throw std::runtime_error("truncated or damaged");
        }
        return static_cast<std::size_t>(count);
    }

    template <class T>
    void get(T& value) {
        if constexpr (kPlain<T>) {
            get_bytes(&value, sizeof(T));
        } else if constexpr (std::is_same_v<T, bool>) {
            std::uint8_t bit = 0;
            get(bit);
            check(bit <= 1);
            value = bit == 1;
        } else if constexpr (std::is_enum_v<T>) {
            std::uint32_t number = 0;
            get(number);
            check(number <= static_cast<std::uint32_t>(last_enumerator(value)));
            value = static_cast<T>(number);
        } else {
            fields(*this, value);
        }
    }

    void get(std::string& text) {
        text.resize(get_count(1));
        get_bytes(text.data(), text.size());
    }

    template <class T>
    void get(std::vector<T>& values) {
        values.clear();
        if constexpr (kPlain<T>) {
            values.resize(get_count(sizeof(T)));
            get_bytes(values.data(), values.size() * sizeof(T));
        } else {
            for (std::size_t left = get_count(1); left > 0; --left) {
                get(values.emplace_back());  // grows with what was really read
            }
        }
    }

    static void check(bool sound) {
        if (!sound) {
            throw std::runtime_error("damaged: a value out of range");
        }
    }

    std::span<const std::uint8_t> rest_;
    std::uint32_t version_;
};

}  // namespace pharos::dump
