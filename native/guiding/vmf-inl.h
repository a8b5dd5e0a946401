// von Mises-Fisher distribution on the sphere over `F` = float or a vector of floats (see vmf.h for
// the contract). Included once per instruction set, like simd_math-inl.h, which must come first.
namespace pharos {
namespace PHAROS_SIMD_NAMESPACE {
namespace vmf {

// kappa as every function below wants it: [0, 1e7]; NaN and negative become 0, infinity 1e7.
template <class F>
PHAROS_SIMD_INLINE F clamp_kappa(const F& kappa) {
    return simd::select(kappa > 0.0f, simd::min(kappa, simd::broadcast<F>(kMaxKappa)), F{});
}

// 2 kappa / (1 - exp(-2 kappa)): x / expm1(x) at x = -2 kappa, 1 at 0.
template <class F>
PHAROS_SIMD_INLINE F two_kappa_over_one_minus_exp(const F& kappa) {
    const F x = -2.0f * kappa;
    const F safe = simd::select(kappa < 1e-7f, simd::broadcast<F>(-1.0f), x);
    return simd::select(kappa < 1e-7f, 1.0f + kappa, safe / simd::expm1<F>(safe));
}

// Density at the lobe's centre: kappa / (2 pi (1 - exp(-2 kappa))).
template <class F>
PHAROS_SIMD_INLINE F normalization(const F& kappa) {
    return two_kappa_over_one_minus_exp<F>(kappa) * 0.0795774715f;
}

// The same for kappa >= 1e-3, without the care that smaller ones need.
template <class F>
PHAROS_SIMD_INLINE F normalization_of_sharp(const F& kappa) {
    const F x = simd::max<F>(-2.0f * kappa, simd::broadcast<F>(-87.0f));
    const simd::ExpParts<F> parts = simd::exp_parts<F>(x);
    const F one_minus_exp = (1.0f - parts.scale) - parts.scale * parts.expm1;
    return 0.159154943f * kappa / one_minus_exp;
}

// Density relative to the centre; `chord2` = |w - mu|^2.
template <class F>
PHAROS_SIMD_INLINE F falloff(const F& kappa, const F& chord2) {
    return simd::exp<F>(-0.5f * kappa * chord2);
}

template <class F>
PHAROS_SIMD_INLINE F pdf(const F& kappa, const F& chord2) {
    return normalization<F>(kappa) * falloff<F>(kappa, chord2);
}

template <class F>
PHAROS_SIMD_INLINE F log_pdf(const F& kappa, const F& chord2) {
    return simd::log<F>(normalization<F>(kappa)) - 0.5f * kappa * chord2;
}

// d log pdf / d log kappa = 1 - 2k / expm1(2k) - k |w - mu|^2 / 2. `two_k_ratio` is
// two_kappa_over_one_minus_exp(kappa). Below kappa = 0.5 the Bernoulli series of the first two
// terms.
template <class F>
PHAROS_SIMD_INLINE F dlogpdf_dlogkappa(const F& kappa, const F& two_k_ratio, const F& chord2) {
    const F x = 2.0f * kappa;
    const F x2 = x * x;
    F series = x2 * -8.26719577e-7f + 3.30687831e-5f;
    series = series * x2 - 1.38888889e-3f;
    series = (series * x2 + 8.33333333e-2f) * x2;
    const F small = kappa * (1.0f - 0.5f * chord2) - series;
    const F large = 1.0f - two_k_ratio * simd::exp<F>(-x) - 0.5f * kappa * chord2;
    return simd::select(kappa < 0.5f, small, large);
}

// 1 - cos(w, mu) of a sample: -log1p(u expm1(-2k)) / k, 2u at kappa 0.
template <class F>
PHAROS_SIMD_INLINE F sample_one_minus_cos(const F& kappa, const F& u) {
    const F tiny = simd::broadcast<F>(3e-8f);
    const F safe = simd::max(kappa, tiny);
    const F value = -simd::log1p<F>(u * simd::expm1<F>(-2.0f * safe)) / safe;
    const F r = simd::select(kappa < tiny, 2.0f * u, value);
    return simd::min(simd::max(r, F{}), simd::broadcast<F>(2.0f));
}

// One direction; u in [0, 1)^2.
PHAROS_SIMD_INLINE Vec3 sample(const Vec3& mu, float kappa, const Vec2& u) {
    const float r = sample_one_minus_cos<float>(clamp_kappa<float>(kappa), u.x);
    const float sine = __builtin_sqrtf(r * (2.0f - r));
    const simd::SinCos<float> azimuth = simd::sincos_turns<float>(u.y);
    const Frame frame = Frame::from_z(mu);
    return frame.to_world(Vec3(sine * azimuth.cos, sine * azimuth.sin, 1.0f - r));
}

}  // namespace vmf
}  // namespace PHAROS_SIMD_NAMESPACE
}  // namespace pharos
