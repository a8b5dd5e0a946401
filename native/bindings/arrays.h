// numpy arrays as vectors of ours and back; each copied once.
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace pharos {

template <class T>
using Array = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

inline void require(bool condition, const std::string& name, const char* what) {
    if (!condition) {
        throw std::invalid_argument(name + ": " + what);
    }
}

template <class T>
constexpr std::size_t components_of() {
    if constexpr (std::is_arithmetic_v<T>) {
        return 1;
    } else {
        return static_cast<std::size_t>(T::length());
    }
}

// Rows of `components` scalars as a vector of T, which has that layout. The GIL is not held
// meanwhile: `array` keeps the memory alive.
template <class T, class Scalar>
std::vector<T> copy_rows(const Array<Scalar>& array, const std::string& name, const char* what) {
    constexpr std::size_t components = components_of<T>();
    static_assert(sizeof(T) == components * sizeof(Scalar));
    const auto size = static_cast<std::size_t>(array.size());
    require(size % components == 0, name, what);
    std::vector<T> out(size / components);
    const Scalar* source = array.data();
    const pybind11::gil_scoped_release release;
    if (size > 0) {
        std::memcpy(static_cast<void*>(out.data()), source, size * sizeof(Scalar));
    }
    return out;
}

template <class Scalar, class T>
pybind11::array_t<Scalar> to_array(const std::vector<T>& rows) {
    constexpr std::size_t components = components_of<T>();
    static_assert(sizeof(T) == components * sizeof(Scalar));
    pybind11::array_t<Scalar> out({rows.size(), components});
    if (!rows.empty()) {
        const void* source = rows.data();
        std::memcpy(out.mutable_data(), source, rows.size() * sizeof(T));
    }
    return out;
}

}  // namespace pharos
