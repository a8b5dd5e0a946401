// Piecewise-constant density over [0, 1)^2 as rows: a marginal over rows (y) and a conditional
// within each row (x). Exactness and treatment of bad weights as in Distribution1D.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "sampling/distribution_1d.h"

namespace pharos {

class Distribution2D {
  public:
    Distribution2D();  // uniform, one cell

    // width * height weights, row by row. Throws std::invalid_argument for a wrong count.
    Distribution2D(std::span<const float> weights, std::uint32_t width, std::uint32_t height);

    struct Sample {
        Vec2 uv;
        float pdf = 0.0f;  // with respect to uv
        std::uint32_t x = 0;
        std::uint32_t y = 0;
        Vec2 offset;  // within the cell, [0, 1)
    };

    [[nodiscard]] Sample sample(const Vec2& u) const {
        const Distribution1D::Sample row = rows_.sample(u.y);
        const float ux = std::clamp(u.x, 0.0f, kOneMinusEpsilon);
        const float* cdf = row_cdf(row.cell);
        const std::uint32_t* guide = guide_.data() + row.cell * (std::size_t{buckets_} + 1);
        const std::uint32_t x = detail::find_cell(cdf, guide, buckets_, ux);
        const float mass = cdf[x + 1] - cdf[x];
        const float offset = std::min((ux - cdf[x]) / mass, kOneMinusEpsilon);
        const float cells = static_cast<float>(width_);
        const float u_out = std::min((static_cast<float>(x) + offset) / cells, kOneMinusEpsilon);
        return {
            Vec2(u_out, row.x), row.pdf * (mass * cells), x, row.cell, Vec2(offset, row.offset)};
    }

    [[nodiscard]] float pdf(const Vec2& uv) const {
        const float cells = static_cast<float>(width_) * static_cast<float>(height());
        return pmf(cell_of(uv.x, width_), cell_of(uv.y, height())) * cells;
    }

    // The u for which sample() returns uv.
    [[nodiscard]] Vec2 invert(const Vec2& uv) const {
        const float* cdf = row_cdf(cell_of(uv.y, height()));
        const std::uint32_t x = cell_of(uv.x, width_);
        const float offset = saturate(uv.x * static_cast<float>(width_) - static_cast<float>(x));
        return Vec2(cdf[x] + offset * (cdf[x + 1] - cdf[x]), rows_.invert(uv.y));
    }

    // Probability of cell (x, y).
    [[nodiscard]] float pmf(std::uint32_t x, std::uint32_t y) const {
        const float* cdf = row_cdf(y);
        return rows_.pmf(y) * (cdf[x + 1] - cdf[x]);
    }

    [[nodiscard]] std::uint32_t width() const { return width_; }

    [[nodiscard]] std::uint32_t height() const { return rows_.size(); }

    [[nodiscard]] std::uint64_t bytes() const {
        return cdf_.size() * sizeof(float) + guide_.size() * sizeof(std::uint32_t);
    }

  private:
    [[nodiscard]] const float* row_cdf(std::uint32_t y) const {
        return cdf_.data() + y * (std::size_t{width_} + 1);
    }

    [[nodiscard]] static std::uint32_t cell_of(float x, std::uint32_t cells) {
        const float scaled = std::clamp(x, 0.0f, kOneMinusEpsilon) * static_cast<float>(cells);
        return std::min(static_cast<std::uint32_t>(scaled), cells - 1);
    }

    std::uint32_t width_ = 1;
    std::uint32_t buckets_ = 1;
    Distribution1D rows_;
    std::vector<float> cdf_;            // (width + 1) values a row
    std::vector<std::uint32_t> guide_;  // (buckets + 1) values a row
};

}  // namespace pharos
