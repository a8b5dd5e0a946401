#include "integrator/stages.h"
#include "sampling/sampler.h"

namespace pharos {

namespace {

constexpr std::uint32_t kRecordSalt = 0x9b1a3f77u;

// A random share of the camera samples is recorded, whole paths at a time.
[[nodiscard]] bool is_recorded(const GuidingContext& guiding,
                               std::uint32_t hash,
                               std::uint32_t sample) {
    return guiding.record && bits_to_unit_float(hash_combine(hash ^ kRecordSalt, sample)) <
                                 guiding.record_probability;
}

}  // namespace

std::uint64_t generate_camera_rays(const RenderContext& context,
                                   const BatchWork& work,
                                   PathBatch& batch) {
    const FilmDescription& film = context.scene.description.film;
    batch.begin(work.pixels);
    for (std::uint32_t path = 0; path < work.pixels; ++path) {
        const std::uint32_t pixel = work.first_pixel + path;
        const std::uint32_t x = film.crop_x + pixel % film.crop_width;
        const std::uint32_t y = film.crop_y + pixel / film.crop_width;
        const std::uint32_t hash = pixel_hash(context.settings().seed, x, y);
        const Vec4 u = sobol_4d(hash, work.sample, 0);
        const Vec2 offset = context.filter.sample(Vec2(u.x, u.y));
        const Vec2 raster(static_cast<float>(x) + 0.5f + offset.x,
                          static_cast<float>(y) + 0.5f + offset.y);

        batch.root_pixel[path] = pixel;
        batch.begin_path(path, hash, work.sample);
        batch.split_scale[path] = is_recorded(context.guiding, hash, work.sample) ? 1.0f : 0.0f;
        batch.active.push_back(path);
        batch.rays.push_back(context.camera.generate_ray(raster, Vec2(u.z, u.w)));
        batch.visibility.push_back(kVisibleCamera);
    }
    return work.pixels;
}

}  // namespace pharos
