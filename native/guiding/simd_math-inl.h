// Elementary functions over `F` = float or a GCC vector of floats: one source for scalar and SIMD
// code.
//
// No include guard on purpose: vmf.h includes it once for the instruction set of the including
// file, the network kernels once per Highway target. PHAROS_SIMD_NAMESPACE names the namespace, so
// that copies compiled for different instruction sets never share a symbol. Relative error about
// 1e-7 unless said.
namespace pharos {
namespace PHAROS_SIMD_NAMESPACE {
namespace simd {

template <class F>
struct IntOfImpl {
    using Type = decltype(F{} < F{});  // what comparing two vectors gives
};

template <>
struct IntOfImpl<float> {
    using Type = std::int32_t;
};

template <class F>
using IntOf = typename IntOfImpl<F>::Type;

template <class To, class From>
PHAROS_SIMD_INLINE To bit_cast(const From& x) {
    return __builtin_bit_cast(To, x);
}

template <class F>
PHAROS_SIMD_INLINE F broadcast(float x) {
    return F{} + x;
}

template <class Mask, class F>
PHAROS_SIMD_INLINE F select(const Mask& mask, const F& a, const F& b) {
    return mask ? a : b;
}

template <class F>
PHAROS_SIMD_INLINE F min(const F& a, const F& b) {
    return a < b ? a : b;
}

template <class F>
PHAROS_SIMD_INLINE F max(const F& a, const F& b) {
    return a > b ? a : b;
}

template <class F>
PHAROS_SIMD_INLINE F abs(const F& x) {
    return bit_cast<F>(bit_cast<IntOf<F>>(x) & 0x7fffffff);
}

// 1 / sqrt(x) for normal x > 0: the exponent halved on the bits, then three Newton steps. Cheaper
// than a square root and a division on every machine of today.
template <class F>
PHAROS_SIMD_INLINE F rsqrt(const F& x) {
    F y = bit_cast<F>(0x5f375a86 - (bit_cast<IntOf<F>>(x) >> 1));
    const F half = 0.5f * x;
    y = y * (1.5f - half * y * y);
    y = y * (1.5f - half * y * y);
    return y + y * (0.5f - half * y * y);
}

// 0 <= x < 1e38; a few units in the last place.
template <class F>
PHAROS_SIMD_INLINE F sqrt(const F& x) {
    return x * rsqrt<F>(x);
}

// Nearest integer to |x| < 2^22, as float and as int: adding 1.5 * 2^23 leaves no room for a
// fraction.
template <class F>
PHAROS_SIMD_INLINE F round_to_int(const F& x, IntOf<F>& integer) {
    const F shifted = x + 12582912.0f;
    integer = bit_cast<IntOf<F>>(shifted) - 0x4b400000;
    return shifted - 12582912.0f;
}

// x = n ln 2 + r; returns r and 2^n, and exp(r) - 1 by a polynomial of our own fit (2.5e-8).
template <class F>
struct ExpParts {
    F scale;  // 2^n
    F expm1;  // exp(r) - 1
};

template <class F>
PHAROS_SIMD_INLINE ExpParts<F> exp_parts(const F& x) {
    IntOf<F> n;
    const F rounded = round_to_int<F>(x * 1.44269504f, n);
    // ln 2 in two parts: the first has trailing zeros, so that its product with n is exact.
    const F r = (x - rounded * 0.693359375f) + rounded * 2.12194440e-4f;
    F poly = r * 0.001393391f + 0.0083633356f;
    poly = poly * r + 0.0416664624f;
    poly = poly * r + 0.16666576f;
    poly = poly * r + 0.500000001f;
    return {bit_cast<F>((n + 127) << 23), r + (r * r) * poly};
}

// |x| <= 87.
template <class F>
PHAROS_SIMD_INLINE F exp_bounded(const F& x) {
    const ExpParts<F> parts = exp_parts(x);
    return parts.scale + parts.scale * parts.expm1;
}

// 0 below -87, largest finite power above 88.
template <class F>
PHAROS_SIMD_INLINE F exp(const F& x) {
    const F clamped = simd::min(simd::max(x, broadcast<F>(-87.0f)), broadcast<F>(88.0f));
    const ExpParts<F> parts = exp_parts(clamped);
    return select(x < -87.0f, F{}, parts.scale + parts.scale * parts.expm1);
}

// exp(x) - 1 for x <= 88 without cancellation.
template <class F>
PHAROS_SIMD_INLINE F expm1(const F& x) {
    const F clamped = simd::min(simd::max(x, broadcast<F>(-87.0f)), broadcast<F>(88.0f));
    const ExpParts<F> parts = exp_parts(clamped);
    const F value = parts.scale * parts.expm1 + (parts.scale - 1.0f);
    return select(simd::abs(x) < 1e-4f, x + 0.5f * x * x, value);
}

// log(1 + f) + low / (1 + f) scaled by 2^e: the common part of log and log1p. x = 1 + f > 0,
// normal.
template <class F>
PHAROS_SIMD_INLINE F log_with_correction(const F& x, const F& low) {
    // The exponent is chosen so that the mantissa lies in [sqrt(1/2), sqrt(2)).
    using I = IntOf<F>;
    const I bits = bit_cast<I>(x) - 0x3f3504f3;
    const I e = bits >> 23;
    const F m = bit_cast<F>((bits & 0x007fffff) + 0x3f3504f3);
    F exponent;
    if constexpr (std::is_same_v<F, float>) {
        exponent = static_cast<float>(e);
    } else {
        exponent = __builtin_convertvector(e, F);
    }
    // log m = 2 atanh(z), z = (m - 1) / (m + 1), arranged so that the leading term is m - 1 itself.
    const F f = m - 1.0f;
    const F z = f / (2.0f + f);
    const F z2 = z * z;
    F tail = z2 * 0.222222222f + 0.285714286f;
    tail = tail * z2 + 0.4f;
    tail = (tail * z2 + 0.666666667f) * z2;
    const F half_square = 0.5f * f * f;
    const F small = exponent * -2.12194440e-4f + low / x;
    return exponent * 0.693359375f + ((small - (half_square - z * (half_square + tail))) + f);
}

// x > 0 and normal.
template <class F>
PHAROS_SIMD_INLINE F log(const F& x) {
    return log_with_correction<F>(x, F{});
}

// log(1 + x) for x > -1: `low` is what rounding 1 + x lost.
template <class F>
PHAROS_SIMD_INLINE F log1p(const F& x) {
    const F sum = 1.0f + x;
    const F low = x - (sum - 1.0f);
    return select(simd::abs(x) < 1e-4f, x - 0.5f * x * x, log_with_correction<F>(sum, low));
}

template <class F>
struct SinCos {
    F sin, cos;
};

// Sine and cosine of `turns` * 2 pi, |turns| < 1e5: the reduction by quarter turns is exact.
template <class F>
PHAROS_SIMD_INLINE SinCos<F> sincos_turns(const F& turns) {
    using I = IntOf<F>;
    I quarter;
    const F rounded = round_to_int<F>(turns * 4.0f, quarter);
    const F t = (turns - rounded * 0.25f) * 6.28318531f;
    const F t2 = t * t;
    F s = t2 * -0.000195873827f + 0.00833274581f;
    s = (s * t2 - 0.166666646f) * (t2 * t) + t;
    F c = t2 * 2.43441936e-05f - 0.00138867304f;
    c = (c * t2 + 0.0416666404f) * (t2 * t2) + (1.0f - 0.5f * t2);
    const auto swapped = (quarter & 1) != 0;
    const F sine = select(swapped, c, s);
    const F cosine = select(swapped, s, c);
    // Signs by quadrant: sine is negative in quadrants 2 and 3, cosine in 1 and 2.
    const I sine_sign = (quarter & 2) << 30;
    const I cosine_sign = ((quarter + 1) & 2) << 30;
    return {bit_cast<F>(bit_cast<I>(sine) ^ sine_sign),
            bit_cast<F>(bit_cast<I>(cosine) ^ cosine_sign)};
}

}  // namespace simd
}  // namespace PHAROS_SIMD_NAMESPACE
}  // namespace pharos
