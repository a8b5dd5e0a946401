// The stages of a path's life over a whole batch; one function and one file each, called in this
// order by render_batch() (integrator.cpp) until no path is left.
//
// Every stage reads and writes the batch only, and returns the number of items it worked on.
#pragma once

#include <cstdint>
#include <span>

#include "integrator/path_batch.h"
#include "integrator/render_context.h"

namespace pharos {

// The camera samples of a batch: pixels [first, first + count) of the rendered window, one sample
// index.
struct BatchWork {
    std::uint32_t first_pixel = 0;
    std::uint32_t pixels = 0;
    std::uint32_t sample = 0;
};

std::uint64_t generate_camera_rays(const RenderContext& context,
                                   const BatchWork& work,
                                   PathBatch& batch);

// Fills batch.hits.
std::uint64_t intersect_closest(const RenderContext& context, PathBatch& batch);

// Lamps with a surface, hit by chance in front of the nearest triangle; they let the ray pass.
std::uint64_t add_lamp_radiance(const RenderContext& context, PathBatch& batch);

// World and suns for the rays that hit nothing; those paths end.
std::uint64_t add_escaped_radiance(const RenderContext& context, PathBatch& batch);

// Hits to interactions, grouped by material, to closures, emission and traits.
std::uint64_t evaluate_materials(const RenderContext& context, PathBatch& batch);

// Emission of surfaces hit by chance, weighted against next-event estimation.
std::uint64_t add_emitted_radiance(const RenderContext& context, PathBatch& batch);

// Passes on request: what the camera sees directly. Skipped where none is wanted.
std::uint64_t write_passes(const RenderContext& context, PathBatch& batch);

// One inference for all vertices that the guide serves or that are recorded.
std::uint64_t query_guiding_field(const RenderContext& context, PathBatch& batch);

// Next-event estimation: one light a vertex, into batch.shadow_rays.
std::uint64_t sample_direct_light(const RenderContext& context, PathBatch& batch);

// Adds the contributions of unoccluded shadow rays.
std::uint64_t trace_shadow_rays(const RenderContext& context, PathBatch& batch);

// Samples the next direction, plays roulette and replaces the active paths by those that go on.
std::uint64_t sample_scattering(const RenderContext& context, PathBatch& batch);

// Turns the records of the batch's paths into training data.
std::uint64_t record_radiance(const RenderContext& context, PathBatch& batch, RecordBuffer& buffer);

// Drops and counts non-finite radiance: the number of dropped samples.
std::uint64_t finish_paths(PathBatch& batch);

}  // namespace pharos
