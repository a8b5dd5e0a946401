// The material and the guiding field together: one-sample MIS between a hit's closures and the
// learned mixture (Veach 1997; Mueller, Gross, Novak 2017, section 3).
//
// With D the probability of choosing a delta closure and a the guide's share of the rest, a
// direction has the density p = (1 - a) p_bsdf + a (1 - D) q. Where the closures cannot sample
// (p_bsdf = 0) the guide's directions are rejected and p is 0, so that guided and unguided renders
// have one support.
#pragma once

#include <optional>

#include "guiding/directional_mixture.h"
#include "materials/bsdf.h"

namespace pharos {

// What guides a vertex; mixture null or share 0: nothing.
struct Guide {
    const VmfMixture* mixture = nullptr;
    float share = 0.0f;
    float delta_probability = 0.0f;
    bool glossy = false;  // the lobes it serves are
};

[[nodiscard]] inline float guided_pdf(const Guide& guide, float bsdf_pdf, const Vec3& wi) {
    if (guide.share == 0.0f || bsdf_pdf <= 0.0f) {
        return bsdf_pdf;
    }
    return (1.0f - guide.share) * bsdf_pdf +
           guide.share * (1.0f - guide.delta_probability) * mixture_pdf(*guide.mixture, wi);
}

// Random numbers of one scattering decision, each in [0, 1).
struct ScatteringRandom {
    float closure = 0.0f;
    float guide = 0.0f;
    Vec2 direction{0.0f};
};

[[nodiscard]] inline std::optional<BsdfSample> sample_guided(const Bsdf& bsdf,
                                                             const Guide& guide,
                                                             const ScatteringRandom& u) {
    const bool choose_guide = u.guide < guide.share &&
                              !(guide.delta_probability > 0.0f && chooses_delta(bsdf, u.closure));
    if (!choose_guide) {
        std::optional<BsdfSample> sample = sample_bsdf(bsdf, u.closure, u.direction);
        if (sample && !(sample->lobe & kLobeDelta)) {
            sample->pdf = guided_pdf(guide, sample->pdf, sample->wi);
        }
        return sample;
    }
    BsdfSample sample;
    sample.wi = sample_mixture(*guide.mixture, u.guide / guide.share, u.direction);
    const BsdfEval scattering = eval_bsdf(bsdf, sample.wi);
    if (scattering.pdf > 0.0f) {
        sample.f_cos = scattering.f_cos;
        sample.pdf = guided_pdf(guide, scattering.pdf, sample.wi);
    } else {
        sample.pdf =
            guide.share * (1.0f - guide.delta_probability) * mixture_pdf(*guide.mixture, sample.wi);
    }
    sample.lobe = guided_lobe(bsdf, u.closure, sample.wi);
    return sample;
}

}  // namespace pharos
