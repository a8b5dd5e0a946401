#include "scene/world.h"

#include <algorithm>
#include <utility>

namespace pharos {

namespace {

constexpr std::uint32_t kDefaultWidth = 1024;
constexpr std::uint32_t kMaxWidth = 4096;
constexpr std::uint32_t kScattered = kVisibleDiffuse | kVisibleGlossy | kVisibleTransmission;

struct MapSize {
    std::uint32_t width = kDefaultWidth;
    std::uint32_t height = kDefaultWidth / 2;
};

// As asked for, else that of the largest environment image the program reads.
MapSize map_size(const Scene& scene) {
    if (const std::uint32_t asked = scene.description.world.map_resolution; asked > 0) {
        const std::uint32_t width = std::clamp(asked, 4u, kMaxWidth);
        return {width, width / 2};
    }
    std::uint32_t width = 0;
    for (const NodeOp& op : scene.world.program.ops) {
        if (op.code == NodeOpCode::Sky && scene.world.skies[op.mode]->has_disc()) {
            width = kMaxWidth;  // the sun's disc is half a degree wide
        }
        if (op.code == NodeOpCode::EnvironmentImage &&
            op.mode < scene.world.program.images.size()) {
            const std::uint32_t image = scene.world.program.images[op.mode].image;
            if (image < scene.textures.size()) {
                width = std::max(width, scene.textures[image].width());
            }
        }
    }
    if (width == 0) {
        return {};
    }
    width = std::clamp(width, 4u, kMaxWidth);
    return {width, width / 2};
}

Rgb finite_or_black(const Rgb& radiance) {
    return is_finite(radiance) ? radiance : Rgb(0.0f);
}

// The program over the texel centres, bottom row first, as light sees it: no Is Camera Ray.
std::vector<Rgb> evaluate_map(const Scene& scene,
                              const MapSize& size,
                              ThreadPool& pool,
                              const CancelFlag& cancel) {
    std::vector<Rgb> radiance(std::size_t{size.width} * size.height);
    std::vector<ShadingScratch> scratch(pool.size());
    PathInfo light_ray;
    light_ray.kind = 0;
    const std::vector<PathInfo> paths(size.width, light_ray);
    ShadingContext context = scene.shading;
    context.paths = paths;
    pool.parallel_for(size.height, [&](std::size_t y, unsigned worker) {
        throw_if_cancelled(cancel);
        std::vector<Vec3> directions(size.width);
        for (std::uint32_t x = 0; x < size.width; ++x) {
            const Vec2 uv((static_cast<float>(x) + 0.5f) / static_cast<float>(size.width),
                          (static_cast<float>(y) + 0.5f) / static_cast<float>(size.height));
            directions[x] = equirectangular_to_direction(uv);
        }
        const std::span<Rgb> row = std::span(radiance).subspan(y * size.width, size.width);
        evaluate_world(scene.world, context, directions, scratch[worker], row);
        std::ranges::transform(row, row.begin(), finite_or_black);
    });
    return radiance;
}

bool is_black(const Rgb& radiance) {
    return is_zero(radiance);
}

}  // namespace

void prepare_world(Scene& scene,
                   ThreadPool& pool,
                   const CancelFlag& cancel,
                   std::unique_ptr<EnvironmentLight> kept) {
    const WorldDescription& world = scene.description.world;
    SceneNeeds& needs = scene.needs;
    needs.environment = !scene.world.program.ops.empty() && world.visibility != 0;
    if (!needs.environment) {
        return;
    }
    // A world that some scattered rays do not see is left to chance hits: a light's sample does not
    // know which kind of ray it stands for.
    const bool sampled = world.use_mis && (world.visibility & kScattered) == kScattered;
    std::vector<Rgb> radiance;
    MapSize size{1, 1};
    if (scene.world.constant) {
        const Vec3 up(0, 0, 1);
        ShadingScratch scratch;
        evaluate_world(scene.world,
                       scene.shading,
                       std::span(&up, 1),
                       scratch,
                       std::span(&scene.constant_world, 1));
        scene.constant_world = finite_or_black(scene.constant_world);
        needs.constant_environment = true;
        needs.environment = !is_black(scene.constant_world);
        radiance.assign(1, scene.constant_world);
    } else if (sampled && kept != nullptr) {
        scene.environment = std::move(kept);
        return;
    } else if (sampled) {
        size = map_size(scene);
        radiance = evaluate_map(scene, size, pool, cancel);
    }
    // A map that is black at every texel's centre is left to chance hits.
    if (sampled && !std::ranges::all_of(radiance, is_black)) {
        scene.environment =
            std::make_unique<EnvironmentLight>(radiance, size.width, size.height, &cancel);
    }
}

}  // namespace pharos
