// From the last layer's rows to mixtures, and from records to the gradient of those rows; included
// by mlp.cpp once a target, after network-inl.h.
namespace pharos {
namespace HWY_NAMESPACE {

inline constexpr float kMinKappa = 1e-2f;
inline constexpr float kIntegralRange = 15.0f;  // of log A in units of the scale

// center + half * u / sqrt(1 + u^2): slope 1 at the centre, never further than `half` from it.
struct SmoothLimit {
    V value;
    V slope;
};

PHAROS_SIMD_INLINE SmoothLimit smooth_limit(const V& x, float center, float half) {
    const V bound = simd::broadcast<V>(1e6f);
    const V u = (simd::min(simd::max(x, -bound), bound) - center) * (1.0f / half);
    const V r = simd::rsqrt<V>(1.0f + u * u);
    return {center + half * u * r, r * r * r};
}

// One mixture a lane. The second half is what the gradient needs besides.
struct Decoded {
    V weight[kMaxLobes];
    V mu[kMaxLobes][3];
    V kappa[kMaxLobes];
    V normalization[kMaxLobes];
    V integral;  // A in units of the scale

    V mu_slope[kMaxLobes][3];     // d activation / d raw
    V inverse_length[kMaxLobes];  // of the vector before normalising; 0 where it has no direction
    V log_kappa_slope[kMaxLobes];
    V log_integral_slope;
};

// Every step below is a loop of its own over the lobes: short chains of dependent operations that
// the processor can overlap, where one long chain per lobe would wait for itself.

// Softmax. No weight falls below exp(-40) of the largest: nothing becomes denormal.
[[gnu::always_inline]] inline void decode_weights(const float* rows,
                                                  int stride,
                                                  int lobes,
                                                  Decoded& out) {
    V largest = load(rows);
    for (int k = 1; k < lobes; ++k) {
        largest = simd::max(load(rows + k * stride), largest);
    }
    V sum{};
    for (int k = 0; k < lobes; ++k) {
        const V x = simd::max(load(rows + k * stride) - largest, simd::broadcast<V>(-40.0f));
        out.weight[k] = simd::exp_bounded<V>(x);
        sum += out.weight[k];
    }
    const V inverse = 1.0f / sum;
    for (int k = 0; k < lobes; ++k) {
        out.weight[k] *= inverse;
    }
}

// The slides' 2 sigmoid(x) - 1 per axis.
[[gnu::always_inline]] inline void decode_sigmoid(const float* rows,
                                                  int stride,
                                                  int k,
                                                  Decoded& out) {
    const V bound = simd::broadcast<V>(20.0f);
    V e[3];
    for (int axis = 0; axis < 3; ++axis) {
        const V raw = simd::min(simd::max(load(rows + axis * stride), -bound), bound);
        e[axis] = 1.0f + simd::exp_bounded<V>(raw);
    }
    // One division for three: 1 / (1 + e) = (product of the other two) / (product of all).
    const V all = 2.0f / (e[0] * e[1] * e[2]);
    out.mu[k][0] = 1.0f - all * (e[1] * e[2]);
    out.mu[k][1] = 1.0f - all * (e[0] * e[2]);
    out.mu[k][2] = 1.0f - all * (e[0] * e[1]);
    for (int axis = 0; axis < 3; ++axis) {
        out.mu_slope[k][axis] = 0.5f - 0.5f * out.mu[k][axis] * out.mu[k][axis];
    }
}

// Normalises the directions. A vector too short or too long for that becomes +z, with gradient
// zero.
[[gnu::always_inline]] inline void normalize_mu(int k, Decoded& out) {
    V* v = out.mu[k];
    const V length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    const V limited =
        simd::min(simd::max(length2, simd::broadcast<V>(1e-10f)), simd::broadcast<V>(1e20f));
    const auto usable = limited == length2;
    const V inverse = simd::select(usable, simd::rsqrt<V>(limited), V{});
    out.inverse_length[k] = inverse;
    v[0] = v[0] * inverse;
    v[1] = v[1] * inverse;
    v[2] = simd::select(usable, v[2] * inverse, simd::broadcast<V>(1.0f));
}

[[gnu::always_inline]] inline void decode_mu(const float* rows,
                                             int stride,
                                             const GuidingConfig& config,
                                             Decoded& out) {
    const int lobes = config.lobes;
    for (int k = 0; k < lobes; ++k) {
        if (config.mu == MuActivation::Sigmoid) {
            decode_sigmoid(rows + k * stride, lobes * stride, k, out);
        } else {
            for (int axis = 0; axis < 3; ++axis) {
                out.mu[k][axis] = load(rows + (axis * lobes + k) * stride);
                out.mu_slope[k][axis] = simd::broadcast<V>(1.0f);
            }
        }
    }
    for (int k = 0; k < lobes; ++k) {
        normalize_mu(k, out);
    }
}

[[gnu::always_inline]] inline void decode_kappa(const float* rows,
                                                int stride,
                                                const GuidingConfig& config,
                                                Decoded& out) {
    const int lobes = config.lobes;
    if (config.kappa == KappaActivation::Exponential) {
        const float low = __builtin_logf(kMinKappa);
        const float high = __builtin_logf(config.kappa_max);
        for (int k = 0; k < lobes; ++k) {
            const SmoothLimit limited =
                smooth_limit(load(rows + k * stride), 0.5f * (low + high), 0.5f * (high - low));
            out.kappa[k] = limited.value;
            out.log_kappa_slope[k] = limited.slope;
        }
        for (int k = 0; k < lobes; ++k) {
            out.kappa[k] = simd::exp_bounded<V>(out.kappa[k]);
        }
    } else {
        // x^2 / (1 + x^2 / max) + min
        const V bound = simd::broadcast<V>(1e6f);
        for (int k = 0; k < lobes; ++k) {
            const V x = simd::min(simd::max(load(rows + k * stride), -bound), bound);
            const V shrink = 1.0f / (1.0f + x * x * (1.0f / config.kappa_max));
            out.kappa[k] = x * x * shrink + kMinKappa;
            out.log_kappa_slope[k] = 2.0f * x * shrink * shrink / out.kappa[k];
        }
    }
    for (int k = 0; k < lobes; ++k) {
        out.normalization[k] = vmf::normalization_of_sharp<V>(out.kappa[k]);
    }
}

// `rows` points at one vector of samples in the last layer's first row.
inline void decode(const float* rows, int stride, const GuidingConfig& config, Decoded& out) {
    const int lobes = config.lobes;
    decode_weights(rows, stride, lobes, out);
    decode_mu(rows + lobes * stride, stride, config, out);
    decode_kappa(rows + 4 * lobes * stride, stride, config, out);
    const SmoothLimit limited = smooth_limit(load(rows + 5 * lobes * stride), 0.0f, kIntegralRange);
    out.integral = simd::exp_bounded<V>(limited.value);
    out.log_integral_slope = limited.slope;
}

// The mixture's density at wi, and each lobe's part in it.
struct LobeDensities {
    V part[kMaxLobes];  // weight * vMF density
    V chord2[kMaxLobes];
    V sum;
};

PHAROS_SIMD_INLINE LobeDensities lobe_densities(const Decoded& mixture, int lobes, const V wi[3]) {
    LobeDensities out;
    out.sum = V{};
    for (int k = 0; k < lobes; ++k) {
        const V x = wi[0] - mixture.mu[k][0];
        const V y = wi[1] - mixture.mu[k][1];
        const V z = wi[2] - mixture.mu[k][2];
        out.chord2[k] = x * x + y * y + z * z;
        out.part[k] = mixture.weight[k] * mixture.normalization[k] *
                      vmf::falloff<V>(mixture.kappa[k], out.chord2[k]);
        out.sum += out.part[k];
    }
    return out;
}

struct RecordVector {
    V wi[3];
    V target;
    V pdf;
    V weight;
};

// What multiplies d log pdf and d log A in a record's gradient, and the loss itself.
struct LossTerms {
    V log_pdf;
    V log_integral;
    V loss;
};

// One-sample KL: -w log(pdf), w = min(target / (A + eps), clip) with A held; and half the relative
// squared error of A with its denominator held (the slides' loss for A).
PHAROS_SIMD_INLINE LossTerms kl_terms(const GuidingConfig& config,
                                      const V& integral,
                                      const V& density,
                                      const V& target,
                                      const V& weight) {
    const V inverse = 1.0f / (integral + kIntegralEpsilon);
    const V w = weight * simd::min(target * inverse, simd::broadcast<V>(config.weight_clip));
    const V relative = (integral - target) * inverse;
    const V raw = 0.5f * integral * inverse * relative;
    const V limit = simd::broadcast<V>(kGradientLimit);
    const V slope = simd::min(simd::max(raw, -limit), limit);
    const V loss = -w * simd::log<V>(density + kDensityFloor) +
                   weight * simd::min(0.25f * relative * relative, simd::broadcast<V>(1e6f));
    return {-w, weight * slope, loss};
}

// The slides' loss: (A pdf - L)^2 / (A pdf)^2, denominator held, as its mean over the sphere
// (importance weighted by 1 / (4 pi p)), so that its clip means the same as that of the KL weight.
PHAROS_SIMD_INLINE LossTerms relative_squared_terms(const V& integral,
                                                    const V& density,
                                                    const RecordVector& record,
                                                    float clip) {
    const V field = integral * density;
    const V radiance = record.target * record.pdf;
    const V inverse = 0.0795774715f / (record.pdf * (field * field + kFieldEpsilon));
    const V difference = field - radiance;
    const V limit = simd::broadcast<V>(clip);
    const V slope = simd::min(simd::max(2.0f * field * difference * inverse, -limit), limit);
    const V loss = simd::min(difference * difference * inverse, simd::broadcast<V>(1e6f));
    return {record.weight * slope, record.weight * slope, record.weight * loss};
}

// Gradients too small to matter become zero before they turn into denormals, which cost a hundred
// times.
[[gnu::always_inline]] inline void store_gradient(float* p, const V& g) {
    store(p, simd::select(simd::abs(g) < 1e-18f, V{}, g));
}

// How one record's gradient goes into the rows of its lobes.
struct LobeGradients {
    const Decoded& mixture;
    const LobeDensities& densities;
    const RecordVector& record;
    V share_scale;    // times a lobe's part of the density: what multiplies d log p_k
    V density_share;  // the same for the whole density
    int lobes;
    int stride;
    float* rows;

    [[gnu::always_inline]] void store_lobe(int k) const {
        // rho_k = pi_k p_k / p: the lobe's responsibility; d log p / d logit_k = rho_k - pi_k
        const V responsible = densities.part[k] * share_scale;
        store_gradient(rows + k * stride, responsible - density_share * mixture.weight[k]);
        // d log p / d log kappa = 1 - 2k / expm1(2k) - k chord^2 / 2. The middle term is
        // 4 pi normalization - 2k, to a few 1e-6, and nothing beyond kappa 8.
        const V kappa = mixture.kappa[k];
        const V middle = mixture.normalization[k] * 12.5663706f - 2.0f * kappa;
        const V dlogkappa =
            1.0f - simd::select(kappa > 8.0f, V{}, middle) - 0.5f * kappa * densities.chord2[k];
        store_gradient(rows + (4 * lobes + k) * stride,
                       responsible * dlogkappa * mixture.log_kappa_slope[k]);
        // d log p / d mu = kappa (e - mu (mu . e)), e = w - mu, then through normalisation and
        // activation
        const V* mu = mixture.mu[k];
        V e[3];
        for (int axis = 0; axis < 3; ++axis) {
            e[axis] = record.wi[axis] - mu[axis];
        }
        const V along = e[0] * mu[0] + e[1] * mu[1] + e[2] * mu[2];
        const V scale = responsible * kappa * mixture.inverse_length[k];
        for (int axis = 0; axis < 3; ++axis) {
            store_gradient(rows + ((1 + axis) * lobes + k) * stride,
                           scale * (e[axis] - mu[axis] * along) * mixture.mu_slope[k][axis]);
        }
    }
};

// Gradient of one vector of records into the last layer's rows, which hold the raw outputs on
// entry. Returns the losses.
inline V record_gradient(const GuidingConfig& config,
                         const RecordVector& record,
                         float inverse_batch,
                         int stride,
                         float* rows) {
    Decoded mixture;
    decode(rows, stride, config, mixture);
    const int lobes = config.lobes;
    const LobeDensities densities = lobe_densities(mixture, lobes, record.wi);
    const LossTerms terms =
        config.loss == GuidingLoss::KullbackLeibler
            ? kl_terms(config, mixture.integral, densities.sum, record.target, record.weight)
            : relative_squared_terms(mixture.integral, densities.sum, record, config.weight_clip);
    const V share_scale = terms.log_pdf * inverse_batch / (densities.sum + kDensityFloor);
    const V density_share = densities.sum * share_scale;
    const LobeGradients gradients{
        mixture, densities, record, share_scale, density_share, lobes, stride, rows};
    for (int k = 0; k < lobes; ++k) {
        gradients.store_lobe(k);
    }
    store_gradient(rows + 5 * lobes * stride,
                   terms.log_integral * inverse_batch * mixture.log_integral_slope);
    return terms.loss;
}

}  // namespace HWY_NAMESPACE
}  // namespace pharos
