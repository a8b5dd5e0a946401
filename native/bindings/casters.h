// Conversions between Python and the project's small vectors: sequences of numbers to Vec2 and
// Vec3, nested sequences of rows (Blender's Matrix, a 4x4 array) to the column-major Mat4, and back
// to tuples.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "core/math.h"

namespace pybind11::detail {

template <class Vector, int kSize>
struct vector_caster {
    PYBIND11_TYPE_CASTER(Vector, const_name("Sequence[float]"));

    bool load(handle source, bool) {
        if (!PySequence_Check(source.ptr()) || PySequence_Size(source.ptr()) != kSize) {
            PyErr_Clear();
            return false;
        }
        const auto sequence = reinterpret_borrow<pybind11::sequence>(source);
        for (int i = 0; i < kSize; ++i) {
            value[i] = sequence[static_cast<size_t>(i)].template cast<float>();
        }
        return true;
    }

    static handle cast(const Vector& v, return_value_policy, handle) {
        pybind11::tuple out(static_cast<size_t>(kSize));
        for (int i = 0; i < kSize; ++i) {
            out[static_cast<size_t>(i)] = static_cast<double>(v[i]);
        }
        return out.release();
    }
};

template <>
struct type_caster<pharos::Vec2> : vector_caster<pharos::Vec2, 2> {};

template <>
struct type_caster<pharos::Vec3> : vector_caster<pharos::Vec3, 3> {};

template <>
struct type_caster<pharos::Mat4> {
    PYBIND11_TYPE_CASTER(pharos::Mat4, const_name("Sequence[Sequence[float]]"));

    bool load(handle source, bool) {
        if (!PySequence_Check(source.ptr()) || PySequence_Size(source.ptr()) != 4) {
            PyErr_Clear();
            return false;
        }
        const auto rows = reinterpret_borrow<pybind11::sequence>(source);
        for (int r = 0; r < 4; ++r) {
            const auto row = rows[static_cast<size_t>(r)].cast<pybind11::sequence>();
            if (row.size() != 4) {
                return false;
            }
            for (int c = 0; c < 4; ++c) {
                value[c][r] = row[static_cast<size_t>(c)].cast<float>();
            }
        }
        return true;
    }

    static handle cast(const pharos::Mat4& m, return_value_policy, handle) {
        pybind11::tuple out(4);
        for (int r = 0; r < 4; ++r) {
            out[static_cast<size_t>(r)] = make_tuple(static_cast<double>(m[0][r]),
                                                     static_cast<double>(m[1][r]),
                                                     static_cast<double>(m[2][r]),
                                                     static_cast<double>(m[3][r]));
        }
        return out.release();
    }
};

}  // namespace pybind11::detail
