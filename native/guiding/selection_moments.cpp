#include "guiding/selection_moments.h"

#include <algorithm>
#include <cmath>

namespace pharos {

namespace {

constexpr double kMaxMoment = 50.0;        // of one record, in units of the picture's variance
constexpr double kMaxContribution = 50.0;  // of one record, in pixels
constexpr double kMomentUnit = 0x1p-32;
constexpr double kSquareUnit = 0x1p-20;

}  // namespace

void Moments::add(const Moments& other, double scale) {
    for (std::size_t a = 0; a < kShares; ++a) {
        moment[a] += scale * other.moment[a];
        square[a] += scale * other.square[a];
    }
    count += scale * other.count;
}

void Moments::scale_by(double factor) {
    for (std::size_t a = 0; a < kShares; ++a) {
        moment[a] *= factor;
        square[a] *= factor;
    }
    count *= factor;
}

bool PassSums::add(const std::array<double, kShares>& moments, double variance) {
    double largest = 0.0;
    for (const double value : moments) {
        if (!std::isfinite(value)) {
            return false;
        }
        largest = std::max(largest, value);
    }
    const double unit = std::min(1.0, kMaxMoment * variance / std::max(largest, 1e-300)) / variance;
    ++count;
    for (std::size_t a = 0; a < kShares; ++a) {
        const double value = moments[a] * unit;
        const double gain = moments[0] * unit - value;
        moment[a] += std::llrint(value / kMomentUnit);
        square[a] += std::llrint(gain * gain / kSquareUnit);
    }
    return true;
}

void PassSums::add(const PassSums& other) {
    for (std::size_t a = 0; a < kShares; ++a) {
        moment[a] += other.moment[a];
        square[a] += other.square[a];
    }
    count += other.count;
}

Moments PassSums::moments(double variance) const {
    Moments out;
    for (std::size_t a = 0; a < kShares; ++a) {
        out.moment[a] = static_cast<double>(moment[a]) * kMomentUnit * variance;
        out.square[a] = static_cast<double>(square[a]) * kSquareUnit * variance * variance;
    }
    out.count = static_cast<double>(count);
    return out;
}

bool is_valid(const SelectionRecord& r) {
    return is_finite(r.position) && is_finite(r.normal) && r.weight > 0.0f && r.pdf_used > 0.0f &&
           std::isfinite(r.weight) && std::isfinite(r.pdf_used);
}

std::array<double, kShares> record_moments(const SelectionRecord& r) {
    std::array<double, kShares> out{};
    for (std::size_t i = 0; i < kShares; ++i) {
        const auto a = static_cast<double>(kShare[i]);
        const auto mix = [a](float guide, float bsdf) {
            return a * static_cast<double>(guide) + (1.0 - a) * static_cast<double>(bsdf);
        };
        const double light_pdf =
            static_cast<double>(r.nee_pdf_light) + mix(r.nee_pdf_guide, r.nee_pdf_bsdf);
        const double n =
            r.nee_radiance > 0.0f ? static_cast<double>(r.nee_radiance) / light_pdf : 0.0;
        const double p = mix(r.pdf_guide, r.pdf_bsdf);
        const double hit = r.hit_radiance > 0.0f ? static_cast<double>(r.hit_radiance) /
                                                       (static_cast<double>(r.hit_pdf_light) + p)
                                                 : 0.0;
        // (p / p_used) (2 N B + B^2) with B = hit + fL / p, arranged so that p = 0 needs no care
        // where nothing arrived.
        const double indirect = r.indirect > 0.0f ? static_cast<double>(r.indirect) / p : 0.0;
        const double b = hit + indirect;
        const double along =
            b > 0.0 ? p / static_cast<double>(r.pdf_used) * (2.0 * n * b + b * b) : 0.0;
        out[i] = static_cast<double>(r.weight) * (n * n + along);
    }
    return out;
}

Contributions contributions(const SelectionRecord& r) {
    const auto p = static_cast<double>(r.pdf_used);
    const double hit = r.hit_radiance > 0.0f ? static_cast<double>(r.hit_radiance) /
                                                   (static_cast<double>(r.hit_pdf_light) + p)
                                             : 0.0;
    const double indirect = r.indirect > 0.0f ? static_cast<double>(r.indirect) / p : 0.0;
    const double scale = std::sqrt(static_cast<double>(r.weight));
    const auto limited = [scale](double x) {
        return std::min(scale * std::max(x, 0.0), kMaxContribution);
    };
    return {limited(static_cast<double>(r.expected)), limited(hit + indirect)};
}

Moments shrink(const Moments& own, const Moments& above) {
    Moments out = own;
    if (above.count > 0.0) {
        out.add(above, kPriorCount / above.count);
    }
    return out;
}

MomentEstimate estimate(const Moments& shrunk, double records) {
    MomentEstimate out;
    const double unit = 1.0 / std::max(shrunk.count, 1e-12);
    for (std::size_t a = 0; a < kShares; ++a) {
        out.mean[a] = shrunk.moment[a] * unit;
    }
    for (std::size_t a = 0; a < kShares; ++a) {
        const double gain = out.mean[0] - out.mean[a];
        const double variance = std::max(shrunk.square[a] * unit - gain * gain, 0.0);
        out.gain_error[a] = std::sqrt(variance / std::max(records, 1.0));
    }
    return out;
}

}  // namespace pharos
