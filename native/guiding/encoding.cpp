#include "guiding/encoding.h"

#include <cmath>
#include <cstdint>

namespace pharos {
namespace {

struct GridCorner {
    std::size_t entry = 0;
    float weight = 0.0f;
};

struct GridCell {
    UVec3 base{0u};
    Vec3 fraction{0.0f};
};

GridCell find_cell(const Vec3& position, int level) {
    const float resolution =
        static_cast<float>(kGridBaseResolution) * std::pow(kGridGrowth, static_cast<float>(level));
    GridCell cell;
    for (int axis = 0; axis < 3; ++axis) {
        const float x = saturate(0.5f * position[axis] + 0.5f) * resolution;
        const float base = std::floor(x);
        cell.base[axis] = static_cast<std::uint32_t>(base);
        cell.fraction[axis] = x - base;
    }
    return cell;
}

// Corner i of a cell: its entry in the level's table, by the spatial hash of the paper (eq. 4).
GridCorner find_corner(const GridCell& cell, int corner, std::size_t mask) {
    std::uint32_t hash = 0;
    float weight = 1.0f;
    constexpr std::uint32_t kPrimes[3] = {1u, 2654435761u, 805459861u};
    for (int axis = 0; axis < 3; ++axis) {
        const auto bit = static_cast<std::uint32_t>((corner >> axis) & 1);
        hash ^= (cell.base[axis] + bit) * kPrimes[axis];
        weight *= bit != 0 ? cell.fraction[axis] : 1.0f - cell.fraction[axis];
    }
    return {hash & mask, weight};
}

}  // namespace

void encode_grid(const GuidingConfig& config,
                 const float* table,
                 const Vec3& position,
                 float* features,
                 int stride) {
    const std::size_t size = std::size_t{1} << config.grid_log2_size;
    const auto width = static_cast<std::size_t>(config.grid_features);
    for (int level = 0; level < config.grid_levels; ++level) {
        const GridCell cell = find_cell(position, level);
        const float* level_table = table + static_cast<std::size_t>(level) * size * width;
        float sum[4] = {};
        for (int i = 0; i < 8; ++i) {
            const GridCorner corner = find_corner(cell, i, size - 1);
            for (std::size_t f = 0; f < width; ++f) {
                sum[f] += corner.weight * level_table[corner.entry * width + f];
            }
        }
        for (int f = 0; f < config.grid_features; ++f) {
            features[(level * config.grid_features + f) * stride] = sum[f];
        }
    }
}

void scatter_grid_gradient(const GuidingConfig& config,
                           const Vec3& position,
                           const float* feature_gradient,
                           int stride,
                           std::span<float> table_gradient) {
    const std::size_t size = std::size_t{1} << config.grid_log2_size;
    const auto width = static_cast<std::size_t>(config.grid_features);
    for (int level = 0; level < config.grid_levels; ++level) {
        const GridCell cell = find_cell(position, level);
        const std::size_t start = static_cast<std::size_t>(level) * size * width;
        for (int i = 0; i < 8; ++i) {
            const GridCorner corner = find_corner(cell, i, size - 1);
            for (int f = 0; f < config.grid_features; ++f) {
                table_gradient[start + corner.entry * width + static_cast<std::size_t>(f)] +=
                    corner.weight * feature_gradient[(level * config.grid_features + f) * stride];
            }
        }
    }
}

}  // namespace pharos
