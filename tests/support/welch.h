// Welch's test: have two samples of unequal variance the same mean (Welch 1947)? And whether many
// such answers are spread as they should be.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace pharos::testing {

struct Moments {
    double count = 0.0;
    double mean = 0.0;
    double squares = 0.0;  // sum of squared deviations

    void add(double x) {
        count += 1.0;
        const double d = x - mean;
        mean += d / count;
        squares += d * (x - mean);
    }

    // Of the mean.
    [[nodiscard]] double variance() const { return squares / (count - 1.0) / count; }
};

// Probability of |T| > t for Student's distribution, by Simpson's rule over its density.
[[nodiscard]] inline double two_sided_p(double t, double degrees) {
    const double log_scale = std::lgamma(0.5 * (degrees + 1.0)) - std::lgamma(0.5 * degrees) -
                             0.5 * std::log(degrees * std::numbers::pi);
    const auto density = [&](double x) {
        return std::exp(log_scale - 0.5 * (degrees + 1.0) * std::log1p(x * x / degrees));
    };
    constexpr int kSteps = 400;
    const double h = std::min(std::abs(t), 40.0) / kSteps;
    double sum = 0.0;
    for (int i = 0; i < kSteps; i += 2) {
        sum += density(i * h) + 4.0 * density((i + 1) * h) + density((i + 2) * h);
    }
    return std::clamp(1.0 - 2.0 * sum * h / 3.0, 0.0, 1.0);
}

struct WelchResult {
    double t = 0.0;  // difference of the means in its standard errors
    double p = 1.0;
};

[[nodiscard]] inline WelchResult welch_test(const Moments& a, const Moments& b) {
    const double va = a.variance();
    const double vb = b.variance();
    if (!(va + vb > 0.0)) {
        return {0.0, a.mean == b.mean ? 1.0 : 0.0};
    }
    const double degrees =
        (va + vb) * (va + vb) / (va * va / (a.count - 1.0) + vb * vb / (b.count - 1.0));
    const double t = (a.mean - b.mean) / std::sqrt(va + vb);
    return {t, two_sided_p(t, degrees)};
}

// Probability of a spread of values in [0, 1] at least as uneven as this, were they uniform
// (Kolmogorov and Smirnov, with Stephens' correction for few values).
[[nodiscard]] inline double uniformity_p(std::vector<double> values) {
    std::ranges::sort(values);
    const auto n = static_cast<double>(values.size());
    double distance = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto k = static_cast<double>(i);
        distance = std::max({distance, values[i] - k / n, (k + 1.0) / n - values[i]});
    }
    const double root = std::sqrt(n);
    const double lambda = (root + 0.12 + 0.11 / root) * distance;
    double p = 0.0;
    for (int k = 1; k <= 100; ++k) {
        p += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * k * k * lambda * lambda);
    }
    return lambda < 0.2 ? 1.0 : std::clamp(p, 0.0, 1.0);
}

}  // namespace pharos::testing
