// Choice among the triangles of a closed emitter by where it is seen from: its far side is hidden
// and its rim foreshortened, so triangles are weighted by their mean cosine towards the receiver.
// One alias table for each of a few dozen directions; for a sphere the relative variance of a light
// sample falls from 2 to a quarter.
//
// Every triangle keeps a small share, so that nothing depends on the surface being really opaque.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "sampling/alias_table.h"

namespace pharos {

class FacingTables {
  public:
    static constexpr std::size_t kMaxTriangles = 2048;  // memory: 54 x 12 bytes a triangle

    FacingTables() = default;

    // Outward unit normals and the weights (area times radiance) of the triangles.
    FacingTables(std::span<const Vec3> normals, std::span<const float> weights);

    [[nodiscard]] bool empty() const { return tables_.empty(); }

    // The table for a receiver in `direction` (of any length) from the emitter.
    [[nodiscard]] const AliasTable& towards(const Vec3& direction) const {
        return tables_[bin_of(direction)];
    }

  private:
    static constexpr int kSide = 3;  // cells along a cube's edge

    [[nodiscard]] static std::size_t bin_of(const Vec3& direction);

    std::vector<AliasTable> tables_;
};

}  // namespace pharos
