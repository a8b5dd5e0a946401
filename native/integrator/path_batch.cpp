#include "integrator/path_batch.h"

namespace pharos {

PathBatch::PathBatch(std::uint32_t root_count) : capacity(2 * root_count), max_roots(root_count) {
    const std::uint32_t size = capacity;
    root_pixel.resize(max_roots);
    root_sample.resize(max_roots);
    root.resize(size);
    sampler_hash.resize(size);
    sample_index.resize(size);
    beta.resize(size);
    radiance.resize(size);
    albedo_product.resize(size);
    scatter_pdf.resize(size);
    origin.resize(size);
    counters.resize(size);
    path_visibility.resize(size);
    last_record.resize(size);
    split_scale.resize(size);
    recorded_radiance.resize(size);
    for (auto* list : {&active,
                       &visibility,
                       &next_active,
                       &next_visibility,
                       &surface_path,
                       &material_order,
                       &escaped}) {
        list->reserve(size);
    }
    rays.reserve(size);
    next_rays.reserve(size);
    hits.resize(size);
    surfaces.reserve(size);
    bsdfs.reserve(size);
    traits.reserve(size);
    shadow_rays.reserve(size);
    shadow_queries.reserve(size);
    occluded.reserve(size);
}

}  // namespace pharos
