// Sampling and density of a VmfMixture, lobes in lanes; included once per instruction set, like
// vmf-inl.h, after it and VmfMixture.
namespace pharos {
namespace PHAROS_SIMD_NAMESPACE {

using Lobes8 [[gnu::vector_size(32)]] = float;

PHAROS_SIMD_INLINE float sum_of_lobes(const Lobes8& v) {
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

PHAROS_SIMD_INLINE float largest_lobe(const Lobes8& v) {
    const auto larger = [](float a, float b) { return a > b ? a : b; };
    return larger(larger(larger(v[0], v[4]), larger(v[2], v[6])),
                  larger(larger(v[1], v[5]), larger(v[3], v[7])));
}

PHAROS_SIMD_INLINE Lobes8 load_lobes(const float* values) {
    return *reinterpret_cast<const Lobes8*>(values);
}

// Density of sample_mixture at wi, per solid angle.
PHAROS_SIMD_INLINE float mixture_pdf(const VmfMixture& mixture, const Vec3& wi) {
    const Lobes8 dx = load_lobes(mixture.mu_x) - wi.x;
    const Lobes8 dy = load_lobes(mixture.mu_y) - wi.y;
    const Lobes8 dz = load_lobes(mixture.mu_z) - wi.z;
    const Lobes8 chord2 = dx * dx + dy * dy + dz * dz;
    return sum_of_lobes(load_lobes(mixture.coefficient) *
                        vmf::falloff<Lobes8>(load_lobes(mixture.kappa), chord2));
}

// Which lobe u_lobe in [0, 1) picks. A lobe of weight 0 is never picked.
PHAROS_SIMD_INLINE int choose_lobe(const VmfMixture& mixture, float u_lobe) {
    float cdf[kMaxLobes];
    cdf[0] = mixture.weight[0];
    for (int k = 1; k < kMaxLobes; ++k) {
        cdf[k] = cdf[k - 1] + mixture.weight[k];
    }
    const float x = u_lobe * cdf[kMaxLobes - 1];
    int chosen = 0;
    for (int k = 0; k < kMaxLobes - 1; ++k) {
        chosen += x >= cdf[k] ? 1 : 0;
    }
    return chosen;
}

PHAROS_SIMD_INLINE Vec3 sample_mixture(const VmfMixture& mixture, float u_lobe, const Vec2& u) {
    const int k = PHAROS_SIMD_NAMESPACE::choose_lobe(mixture, u_lobe);
    return vmf::sample(
        Vec3(mixture.mu_x[k], mixture.mu_y[k], mixture.mu_z[k]), mixture.kappa[k], u);
}

}  // namespace PHAROS_SIMD_NAMESPACE
}  // namespace pharos
