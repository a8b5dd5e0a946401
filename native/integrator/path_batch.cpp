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

void PathBatch::begin(std::uint32_t count) {
    roots = count;
    paths = count;
    records.clear();
    active.clear();
    rays.clear();
    visibility.clear();
}

void PathBatch::begin_path(std::uint32_t path, std::uint32_t hash, std::uint32_t sample) {
    root_sample[path] = FilmSample{};
    root[path] = path;
    sampler_hash[path] = hash;
    sample_index[path] = sample;
    beta[path] = Rgb(1.0f);
    radiance[path] = Rgb(0.0f);
    albedo_product[path] = Rgb(1.0f);
    scatter_pdf[path] = 0.0f;
    counters[path] = PathCounters{};
    path_visibility[path] = kVisibleCamera;
    last_record[path] = kNone;
    recorded_radiance[path] = Rgb(0.0f);
    split_scale[path] = 0.0f;
}

}  // namespace pharos
