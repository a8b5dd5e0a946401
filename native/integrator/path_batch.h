// The state of one thread's batch of paths: structure of arrays, reused from batch to batch.
//
// A *root* is one camera sample (pixel and sample index); a *path* is one of possibly several
// continuations of it (splitting). Paths in flight are listed in `active`, in a fixed order; the
// arrays under "rays" run parallel to `active`, those under "surfaces" parallel to the hits among
// them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "core/work_counter.h"
#include "film/film.h"
#include "geometry/accelerator.h"
#include "geometry/surface_interaction.h"
#include "guiding/directional_mixture.h"
#include "integrator/guided_sampling.h"
#include "integrator/path_record.h"
#include "lights/light.h"
#include "materials/material.h"

namespace pharos {

// Bounce counters by Cycles' meaning (cycles-parity 2.4) and what the last scattering was.
struct PathCounters {
    std::uint16_t depth = 0;   // vertices so far, transparent ones included: sampler dimensions
    std::uint16_t bounce = 0;  // scatterings, transparent ones excluded
    std::uint16_t diffuse = 0;
    std::uint16_t glossy = 0;
    std::uint16_t transmission = 0;
    std::uint16_t transparent = 0;
    bool terminate_at_surface =
        false;                   // a limit was reached: emission of the next surface, then the end
    bool from_camera = true;     // nothing but transparent surfaces since the camera
    bool after_diffuse = false;  // some scattering so far was diffuse (caustics switches)
    bool features_done = false;  // albedo and normal for denoising are taken
    bool passes_done = false;    // passes of a single surface are taken
    std::uint8_t ray_kind = 1;   // PathInfo::kind of the ray under way: the camera's
    float straight_length = 0.0f;  // of the ray's parts before transparent surfaces
};

// A shadow ray waiting for its answer.
struct ShadowRay {
    Rgb contribution{0.0f};
    std::uint32_t path = 0;
    std::uint32_t record = kNone;  // vertex record that wants to know
    std::uint32_t emitter = kNone;
};

// Who emits: a lamp by its place in the description, a surface by its instance with this bit, or
// the world.
inline constexpr std::uint32_t kSurfaceEmitter = 0x80000000u;
inline constexpr std::uint32_t kWorldEmitter = 0xfffffffeu;

// Light that has reached a camera sample.
struct Arrival {
    std::uint32_t root = 0;
    std::uint32_t emitter = kNone;
    float luminance = 0.0f;
};

// Light samples whose radiance a node program gives.
struct PendingLight {
    SurfaceInteraction emitter;  // emissive triangle
    Vec3 direction;              // world
    std::uint32_t shadow = 0;    // into shadow_rays
};

struct PathBatch {
    // `roots` camera samples, and as many again for split paths.
    explicit PathBatch(std::uint32_t max_roots);

    // Empties the batch; begin_path() then starts `count` paths, one of each root.
    void begin(std::uint32_t count);
    void begin_path(std::uint32_t path, std::uint32_t hash, std::uint32_t sample);

    std::uint32_t capacity;
    std::uint32_t max_roots;
    std::uint32_t roots = 0;  // in use
    std::uint32_t paths = 0;  // in use; the first `roots` paths are the roots' own

    // --- roots ---
    std::vector<std::uint32_t> root_pixel;  // in the rendered window
    std::vector<FilmSample> root_sample;
    std::vector<float> root_passes;  // on request: PassLayout::sample_size() of each
    std::vector<Arrival> arrivals;   // of all roots, while notes_arrivals
    bool notes_arrivals = false;

    // --- paths ---
    std::vector<std::uint32_t> root;
    std::vector<std::uint32_t> sampler_hash;
    std::vector<std::uint32_t> sample_index;
    std::vector<Rgb> beta;
    std::vector<Rgb> radiance;
    std::vector<Rgb> albedo_product;  // for roulette
    std::vector<float> scatter_pdf;   // solid angle, of the last scattering; 0: camera or delta
    std::vector<LightSampleContext> origin;  // of the last scattering, for MIS of chance hits
    std::vector<PathCounters> counters;
    std::vector<std::uint32_t>
        path_visibility;  // bit of the last scattering that was not transparent

    std::vector<std::uint32_t> last_record;  // completed record of the last scattering, else kNone
    std::vector<float> split_scale;  // recorded paths: copies made so far, else 0 = not recorded
    std::vector<Rgb> recorded_radiance;  // of recorded paths: as if the copies were this one

    // --- rays, parallel to active ---
    std::vector<std::uint32_t> active;
    std::vector<Ray> rays;
    std::vector<std::uint32_t> visibility;
    std::vector<Hit> hits;
    std::vector<std::uint32_t> next_active;
    std::vector<Ray> next_rays;
    std::vector<std::uint32_t> next_visibility;

    // --- surfaces ---
    std::vector<std::uint32_t> surface_path;
    std::vector<SurfaceInteraction> surfaces;
    std::vector<std::uint32_t> material_order;  // indices into surfaces, grouped by material
    std::vector<std::uint32_t> material_count;
    ClosureBatch closures;
    std::vector<Bsdf> bsdfs;
    std::vector<BsdfTraits> traits;

    // --- guiding, parallel to surfaces (empty while guiding is off) ---
    std::vector<Guide> guides;
    std::vector<std::uint32_t> vertex_record;  // open record of the surface, else kNone
    std::vector<std::uint32_t> query_surface;  // the surfaces the field is asked about
    std::vector<const Closure*> query_lobe;    // and the closure that matters most there
    std::array<std::vector<float>, 6> query;   // their positions and normals
    std::vector<VmfMixture> mixtures;          // the answers
    std::vector<VertexRecord> records;         // of the whole batch

    // --- rays that left the scene ---
    std::vector<std::uint32_t> escaped;  // indices into active
    std::vector<Vec3> escaped_directions;
    std::vector<Rgb> escaped_radiance;

    // --- shadow rays ---
    std::vector<ShadowRay> shadow_rays;
    std::vector<Ray> shadow_queries;  // parallel to shadow_rays
    std::vector<std::uint8_t> occluded;
    // those at transparent surfaces, waiting for the programs there
    std::vector<SurfaceInteraction> shadow_surfaces;
    std::vector<std::uint32_t> shadow_places;  // of each, into shadow_rays
    std::vector<std::uint32_t> shadow_order;   // by material
    std::vector<Rgb> transmittances;
    WorkCounter transmission;  // at transparent surfaces, since somebody asked
    std::vector<PendingLight> pending_triangles;
    std::vector<PendingLight> pending_lamps;  // those with a program; the emitter's material is it
    std::vector<PendingLight> pending_worlds;
    std::vector<SurfaceInteraction> pending_surfaces;
    std::vector<Vec3> pending_directions;
    std::vector<Rgb> pending_radiance;

    std::vector<PathInfo> path_infos;  // where programs ask how paths came

    // --- passes that materials write ---
    std::vector<std::uint32_t> aov_paths;  // of the hits that write
    std::vector<Vec3> aov_values;

    ShadingScratch scratch;
};

}  // namespace pharos
