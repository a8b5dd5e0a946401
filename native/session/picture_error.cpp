#include "session/picture_error.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace pharos {

double trimmed_error(std::span<const float> picture, std::span<const float> reference) {
    std::vector<double> errors(reference.size() / 4);
    for (std::size_t i = 0; i < errors.size(); ++i) {
        for (std::size_t c = 4 * i; c < 4 * i + 3; ++c) {
            const auto r = static_cast<double>(reference[c]);
            const double d = static_cast<double>(picture[c]) - r;
            errors[i] += d * d / (r * r + 0.01) / 3.0;
        }
    }
    const std::size_t kept = errors.size() - errors.size() / 1000;
    std::ranges::nth_element(errors, errors.begin() + static_cast<std::ptrdiff_t>(kept - 1));
    errors.resize(kept);
    return std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(kept);
}

}  // namespace pharos
