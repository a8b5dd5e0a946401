#include "lights/facing_tables.h"

namespace pharos {

namespace {

constexpr float kHiddenShare = 0.05f;
constexpr int kSubdivisions = 4;  // directions averaged along a cell's edge

// Direction through (a, b) in [-1, 1]^2 of a cube's face; faces are +x -x +y -y +z -z.
Vec3 cube_direction(int face, float a, float b) {
    const int axis = face / 2;
    Vec3 direction(0.0f);
    direction[axis] = face % 2 == 0 ? 1.0f : -1.0f;
    direction[(axis + 1) % 3] = a;
    direction[(axis + 2) % 3] = b;
    return glm::normalize(direction);
}

}  // namespace

FacingTables::FacingTables(std::span<const Vec3> normals, std::span<const float> weights) {
    constexpr int kFine = kSide * kSubdivisions;
    const auto coordinate = [](int i) {
        return (static_cast<float>(i) + 0.5f) * (2.0f / kFine) - 1.0f;
    };
    std::vector<float> facing(normals.size());
    for (int bin = 0; bin < 6 * kSide * kSide; ++bin) {
        const int face = bin / (kSide * kSide);
        const int row = bin / kSide % kSide;
        const int column = bin % kSide;
        std::fill(facing.begin(), facing.end(), 0.0f);
        for (int k = 0; k < kSubdivisions * kSubdivisions; ++k) {
            const Vec3 direction =
                cube_direction(face,
                               coordinate(column * kSubdivisions + k % kSubdivisions),
                               coordinate(row * kSubdivisions + k / kSubdivisions));
            for (std::size_t i = 0; i < normals.size(); ++i) {
                facing[i] += std::max(glm::dot(normals[i], direction), 0.0f);
            }
        }
        for (std::size_t i = 0; i < normals.size(); ++i) {
            facing[i] = weights[i] * (facing[i] / (kSubdivisions * kSubdivisions) + kHiddenShare);
        }
        tables_.emplace_back(facing);
    }
}

std::size_t FacingTables::bin_of(const Vec3& direction) {
    const Vec3 size = glm::abs(direction);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const float scale = 0.5f * kSide / std::max(size[axis], 1e-30f);
    const auto cell = [scale](float x) {
        return std::clamp(static_cast<int>(x * scale + 0.5f * kSide), 0, kSide - 1);
    };
    const int face = 2 * axis + (direction[axis] < 0.0f ? 1 : 0);
    const int column = cell(direction[(axis + 1) % 3]);
    const int row = cell(direction[(axis + 2) % 3]);
    const int bin = (face * kSide + row) * kSide + column;
    return static_cast<std::size_t>(bin);
}

}  // namespace pharos
