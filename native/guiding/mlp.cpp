#include "guiding/mlp.h"

#include <cmath>

#include "core/check.h"
#include "guiding/encoding.h"
#include "guiding/guiding_field.h"

// Instruction sets the kernels exist for: plain SSE2, SSE4, AVX2 and AVX-512.
#undef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "guiding/mlp.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
#define PHAROS_SIMD_NAMESPACE HWY_NAMESPACE
// clang-format off
#include "guiding/simd_math-inl.h"
#include "guiding/vmf-inl.h"
#include "guiding/mixture-inl.h"
#include "guiding/network-inl.h"
#include "guiding/decode-inl.h"
#include "guiding/kernels-inl.h"
// clang-format on
#undef PHAROS_SIMD_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pharos {

HWY_EXPORT(evaluate_kernel);
HWY_EXPORT(evaluate_chunk_kernel);
HWY_EXPORT(train_chunk_kernel);
HWY_EXPORT(adam_kernel);
HWY_EXPORT(sample_mixtures_kernel);
HWY_EXPORT(mixture_pdfs_kernel);

std::size_t workspace_size(const NetworkLayout& layout) {
    // All activations, and two buffers of gradients that swap.
    int rows = layout.inputs + 2 * widest_rows(layout);
    for (int l = 0; l < layout.layers; ++l) {
        rows += layout.layer[static_cast<std::size_t>(l)].rows;
    }
    return static_cast<std::size_t>(rows) * kTrainChunk;
}

void evaluate_network(const NetworkView& view,
                      const FieldQuery& query,
                      std::span<VmfMixture> mixtures) {
    CHECK_EQ(query.px.size(), mixtures.size());
    HWY_DYNAMIC_DISPATCH(evaluate_kernel)(view, query, mixtures);
}

void evaluate_chunk(const NetworkView& view,
                    const TrainingColumns& columns,
                    std::size_t first,
                    std::span<float> workspace,
                    std::span<float> pdf_and_integral) {
    CHECK_GE(workspace.size(), workspace_size(*view.layout));
    CHECK_EQ(pdf_and_integral.size(), std::size_t{2 * kTrainChunk});
    HWY_DYNAMIC_DISPATCH(evaluate_chunk_kernel)
    (view, columns, first, workspace.data(), pdf_and_integral.data());
}

float train_chunk(const NetworkView& view,
                  const TrainingColumns& columns,
                  std::size_t first,
                  std::span<float> workspace,
                  std::span<float> gradient) {
    CHECK_GE(workspace.size(), workspace_size(*view.layout));
    CHECK_EQ(gradient.size(), view.layout->mlp_parameters);
    return HWY_DYNAMIC_DISPATCH(train_chunk_kernel)(
        view, columns, first, workspace.data(), gradient.data());
}

void sample_mixtures(std::span<const VmfMixture> mixtures,
                     std::span<const float> u_lobe,
                     std::span<const Vec2> u,
                     std::span<Vec3> wi) {
    CHECK_EQ(mixtures.size(), u_lobe.size());
    CHECK_EQ(mixtures.size(), u.size());
    CHECK_EQ(mixtures.size(), wi.size());
    HWY_DYNAMIC_DISPATCH(sample_mixtures_kernel)(mixtures, u_lobe, u, wi);
}

void mixture_pdfs(std::span<const VmfMixture> mixtures,
                  std::span<const Vec3> wi,
                  std::span<float> pdf) {
    CHECK_EQ(mixtures.size(), wi.size());
    CHECK_EQ(mixtures.size(), pdf.size());
    HWY_DYNAMIC_DISPATCH(mixture_pdfs_kernel)(mixtures, wi, pdf);
}

void adam_update(const AdamStep& step, const AdamArrays& arrays) {
    CHECK_EQ(arrays.gradient.size() % 16, std::size_t{0});
    CHECK_EQ(arrays.gradient.size(), arrays.parameters.size());
    CHECK_EQ(arrays.gradient.size(), arrays.first_moment.size());
    CHECK_EQ(arrays.gradient.size(), arrays.second_moment.size());
    CHECK_EQ(arrays.gradient.size(), arrays.average.size());
    HWY_DYNAMIC_DISPATCH(adam_kernel)(step, arrays);
}

}  // namespace pharos
#endif
