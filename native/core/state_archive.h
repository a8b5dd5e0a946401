// State of a render to bytes and back: what checkpoints and field files are made of.
//
// Both archives are called with the same values in the same order: numbers, flags, GLM vectors,
// arrays of them (a count, then the elements) and structures for which a function state_fields
// names the members once for both. The reader throws StateError instead of taking a flag that is
// neither 0 nor 1, a number of elements that the rest of the stream cannot hold, or a byte beyond
// its end; what values mean is checked by whoever loads them. Little endian, as the machine.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/math.h"

namespace pharos {

static_assert(std::endian::native == std::endian::little);

class StateError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// Values stored as they lie in memory.
template <class T>
inline constexpr bool kPlainState =
    (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || std::is_same_v<T, std::byte> ||
    std::is_same_v<T, Vec3> || std::is_same_v<T, Vec2>;

class StateWriter {
  public:
    using Sink = std::function<void(std::span<const std::byte>)>;

    explicit StateWriter(Sink sink) : sink_(std::move(sink)) {}

    template <class... T>
    void operator()(const T&... values) {
        (put(values), ...);
    }

  private:
    template <class T>
    void put(const T& value) {
        if constexpr (kPlainState<T>) {
            sink_(std::as_bytes(std::span(&value, 1)));
        } else if constexpr (std::is_same_v<T, bool>) {
            put(static_cast<std::uint8_t>(value ? 1 : 0));
        } else {
            // One function names the members for both archives; writing changes none of them.
            state_fields(*this, const_cast<T&>(value));
        }
    }

    template <class T, std::size_t N>
    void put(const std::array<T, N>& values) {
        for (const T& value : values) {
            put(value);
        }
    }

    template <class T, class Allocator>
    void put(const std::vector<T, Allocator>& values) {
        put(static_cast<std::uint64_t>(values.size()));
        if constexpr (kPlainState<T>) {
            sink_(std::as_bytes(std::span(values)));
        } else {
            for (const T& value : values) {
                put(value);
            }
        }
    }

    Sink sink_;
};

class StateReader {
  public:
    // Fills the bytes asked for; never asked for more than `size` in all.
    using Source = std::function<void(std::span<std::byte>)>;

    StateReader(Source source, std::uint64_t size) : source_(std::move(source)), rest_(size) {}

    explicit StateReader(std::span<const std::byte> bytes)
        : StateReader(
              [bytes](std::span<std::byte> out) mutable {
                  std::memcpy(out.data(), bytes.data(), out.size());
                  bytes = bytes.subspan(out.size());
              },
              bytes.size()) {}

    template <class... T>
    void operator()(T&... values) {
        (get(values), ...);
    }

    // An array whose length is known: that of `values`.
    template <class T, class Allocator>
    void expect(std::vector<T, Allocator>& values) {
        std::uint64_t count = 0;
        get(count);
        require(count == values.size());
        get_elements(values);
    }

    static void require(bool sound) {
        if (!sound) {
            throw StateError("damaged: a value out of range");
        }
    }

    [[nodiscard]] std::uint64_t remaining() const { return rest_; }

  private:
    void get_bytes(std::span<std::byte> out) {
        if (out.size() > rest_) {
            throw StateError("truncated or damaged");
        }
        rest_ -= out.size();
        if (!out.empty()) {
            source_(out);
        }
    }

    template <class T>
    void get(T& value) {
        if constexpr (kPlainState<T>) {
            get_bytes(std::as_writable_bytes(std::span(&value, 1)));
        } else if constexpr (std::is_same_v<T, bool>) {
            std::uint8_t bit = 0;
            get(bit);
            require(bit <= 1);
            value = bit == 1;
        } else {
            state_fields(*this, value);
        }
    }

    template <class T, std::size_t N>
    void get(std::array<T, N>& values) {
        for (T& value : values) {
            get(value);
        }
    }

    template <class T, class Allocator>
    void get(std::vector<T, Allocator>& values) {
        std::uint64_t count = 0;
        get(count);
        values.clear();
        if constexpr (kPlainState<T>) {
            require(count <= rest_ / sizeof(T));
            values.resize(count);
            get_elements(values);
        } else {
            require(count <= rest_);
            for (; count > 0; --count) {
                get(values.emplace_back());  // grows with what was really read
            }
        }
    }

    template <class T, class Allocator>
    void get_elements(std::vector<T, Allocator>& values) {
        if constexpr (kPlainState<T>) {
            get_bytes(std::as_writable_bytes(std::span(values)));
        } else {
            for (T& value : values) {
                get(value);
            }
        }
    }

    Source source_;
    std::uint64_t rest_;
};

// What a writer was told, in memory.
template <class Function>
[[nodiscard]] std::vector<std::byte> state_bytes(const Function& write) {
    std::vector<std::byte> bytes;
    StateWriter writer([&](std::span<const std::byte> piece) {
        bytes.insert(bytes.end(), piece.begin(), piece.end());
    });
    write(writer);
    return bytes;
}

}  // namespace pharos
