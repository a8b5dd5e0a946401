// Three floats in one SSE register, for code that is run once a path vertex (internal to
// geometry/). The fourth lane is never looked at.
#pragma once

#include <immintrin.h>

#include "core/math.h"

namespace pharos::detail {

struct Simd3 {
    __m128 v;

    [[nodiscard]] static Simd3 load(const Vec3& p) { return {_mm_setr_ps(p.x, p.y, p.z, 0.0f)}; }

    [[nodiscard]] Vec3 store() const {
        alignas(16) float f[4];
        _mm_store_ps(f, v);
        return Vec3(f[0], f[1], f[2]);
    }

    template <int lane>
    [[nodiscard]] Simd3 spread() const {
        return {_mm_shuffle_ps(v, v, _MM_SHUFFLE(lane, lane, lane, lane))};
    }

    [[nodiscard]] Simd3 yzx() const { return {_mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 0, 2, 1))}; }

    friend Simd3 operator+(Simd3 a, Simd3 b) { return {_mm_add_ps(a.v, b.v)}; }

    friend Simd3 operator-(Simd3 a, Simd3 b) { return {_mm_sub_ps(a.v, b.v)}; }

    friend Simd3 operator*(Simd3 a, Simd3 b) { return {_mm_mul_ps(a.v, b.v)}; }

    friend Simd3 operator*(Simd3 a, float s) { return {_mm_mul_ps(a.v, _mm_set1_ps(s))}; }
};

[[nodiscard]] inline Simd3 abs(Simd3 a) {
    return {_mm_andnot_ps(_mm_set1_ps(-0.0f), a.v)};
}

[[nodiscard]] inline Simd3 max(Simd3 a, Simd3 b) {
    return {_mm_max_ps(a.v, b.v)};
}

[[nodiscard]] inline float dot(Simd3 a, Simd3 b) {
    return _mm_cvtss_f32(_mm_dp_ps(a.v, b.v, 0x71));
}

[[nodiscard]] inline float max_component(Simd3 a) {
    return _mm_cvtss_f32(max(max(a, a.spread<1>()), a.spread<2>()).v);
}

[[nodiscard]] inline Simd3 cross(Simd3 a, Simd3 b) {
    return (a * b.yzx() - a.yzx() * b).yzx();
}

// The cross product with all differences taken as sums.
[[nodiscard]] inline Simd3 cross_of_sums(Simd3 a, Simd3 b) {
    return (a * b.yzx() + a.yzx() * b).yzx();
}

[[nodiscard]] inline Simd3 column(const Mat4& m, int index) {
    return {_mm_loadu_ps(&m[index].x)};
}

[[nodiscard]] inline Simd3 transform_vector(const Mat4& m, Simd3 a) {
    return column(m, 0) * a.spread<0>() + column(m, 1) * a.spread<1>() +
           column(m, 2) * a.spread<2>();
}

[[nodiscard]] inline Simd3 transform_point(const Mat4& m, Simd3 a) {
    return transform_vector(m, a) + column(m, 3);
}

}  // namespace pharos::detail
