#include "guiding/directional_mixture.h"

#include "core/check.h"

namespace pharos {

void sample_mixtures(std::span<const VmfMixture> mixtures,
                     std::span<const float> u_lobe,
                     std::span<const Vec2> u,
                     std::span<Vec3> wi) {
    CHECK_EQ(mixtures.size(), u_lobe.size());
    CHECK_EQ(mixtures.size(), u.size());
    CHECK_EQ(mixtures.size(), wi.size());
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
        wi[i] = sample_mixture(mixtures[i], u_lobe[i], u[i]);
    }
}

void mixture_pdfs(std::span<const VmfMixture> mixtures,
                  std::span<const Vec3> wi,
                  std::span<float> pdf) {
    CHECK_EQ(mixtures.size(), wi.size());
    CHECK_EQ(mixtures.size(), pdf.size());
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
        pdf[i] = mixture_pdf(mixtures[i], wi[i]);
    }
}

}  // namespace pharos
