// The pixel filter by importance sampling: offsets from the pixel's centre are drawn in proportion
// to the filter, so that every sample has weight 1 and belongs to one pixel (Ernst, Stamminger,
// Greiner 2006). Separable; each axis from a table of 1024 cells.
//
// width is the host's filter width in pixels: Blackman-Harris reaches +-width, Gaussian +-1.5
// width, box is one pixel always.
#pragma once

#include "core/math.h"
#include "film/film_description.h"
#include "sampling/distribution_1d.h"

namespace pharos {

class FilterSampler {
  public:
    explicit FilterSampler(PixelFilter filter, float width);

    [[nodiscard]] Vec2 sample(const Vec2& u) const { return Vec2(offset(u.x), offset(u.y)); }

    [[nodiscard]] float radius() const { return radius_; }

  private:
    [[nodiscard]] float offset(float u) const {
        return (2.0f * axis_.sample(u).x - 1.0f) * radius_;
    }

    float radius_ = 0.5f;
    Distribution1D axis_;
};

}  // namespace pharos
