// Pearson's chi-square test of sampling code against its own density, on the sphere or a rectangle.
//
// A histogram of samples is compared with the density integrated over each cell (adaptive Gauss
// quadrature in double). Cells expecting fewer than five samples are pooled; failed draws
// (std::nullopt) form one more cell, expecting the mass that the density leaves to one. The test
// fails when a sample falls where the density integrates to nothing, or when the p-value is below
// 1 - (1 - significance)^(1 / tests) (Sidak: `tests` is the number of tests of the family).
//
//     const ChiSquareResult r = chi_square_sphere(sample, pdf, options);
//     EXPECT_TRUE(r.passed) << r.message;
//
// sample: (Random&) -> std::optional<Vec3> (or Vec2); pdf: (point) -> float.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/math.h"
#include "support/random.h"

namespace pharos::test {

struct ChiSquareOptions {
    std::uint64_t seed = 1;
    int samples = 100000;
    int rows = 20;     // cos theta, or y
    int columns = 40;  // phi, or x
    double significance = 0.01;
    int tests = 1;
    Frame frame = Frame::from_z(Vec3(0, 0, 1));  // the sphere's poles; turn peaks away from them
    int max_depth = 6;  // of the quadrature; raise for very narrow densities
};

struct ChiSquareResult {
    bool passed = false;
    double p_value = 0.0;
    double total_mass = 0.0;  // integral of the density over the domain
    std::string message;
};

// Upper tail Q(a, x) of the gamma distribution: power series below x = a + 1, else the continued
// fraction (modified Lentz).
inline double upper_gamma(double a, double x) {
    if (x <= 0.0) {
        return 1.0;
    }
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1.0) {
        double term = 1.0 / a;
        double sum = term;
        for (int i = 1; i < 10000 && term > sum * 1e-15; ++i) {
            term *= x / (a + i);
            sum += term;
        }
        return std::clamp(1.0 - front * sum, 0.0, 1.0);
    }
    constexpr double kTiny = 1e-300;
    double b = x + 1.0 - a;
    double c = 1.0 / kTiny;
    double d = 1.0 / b;
    double value = d;
    for (int i = 1; i < 10000; ++i) {
        const double numerator = -i * (i - a);
        b += 2.0;
        d = numerator * d + b;
        d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
        c = b + numerator / c;
        c = std::abs(c) < kTiny ? kTiny : c;
        value *= d * c;
        if (std::abs(d * c - 1.0) < 1e-15) {
            break;
        }
    }
    return std::clamp(front * value, 0.0, 1.0);
}

// Integral of f over a rectangle: 3x3 Gauss points, split until four quarters agree with the whole.
template <class F>
double integrate_cell(const F& f, const std::array<double, 4>& cell, double tolerance, int depth) {
    constexpr std::array<double, 3> kNode{0.1127016653792583, 0.5, 0.8872983346207417};
    constexpr std::array<double, 3> kWeight{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    const auto rule = [&f, &kNode, &kWeight](const std::array<double, 4>& r) {
        double sum = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                sum += kWeight[i] * kWeight[j] *
                       f(r[0] + (r[2] - r[0]) * kNode[i], r[1] + (r[3] - r[1]) * kNode[j]);
            }
        }
        return sum * (r[2] - r[0]) * (r[3] - r[1]);
    };
    const double mx = 0.5 * (cell[0] + cell[2]);
    const double my = 0.5 * (cell[1] + cell[3]);
    const std::array<std::array<double, 4>, 4> quarters{{{cell[0], cell[1], mx, my},
                                                         {mx, cell[1], cell[2], my},
                                                         {cell[0], my, mx, cell[3]},
                                                         {mx, my, cell[2], cell[3]}}};
    double fine = 0.0;
    for (const auto& q : quarters) {
        fine += rule(q);
    }
    if (depth <= 0 || std::abs(fine - rule(cell)) <= tolerance) {
        return fine;
    }
    double sum = 0.0;
    for (const auto& q : quarters) {
        sum += integrate_cell(f, q, 0.5 * tolerance, depth - 1);
    }
    return sum;
}

// Midpoint rule on a fine grid.
template <class F>
double integrate_densely(const F& f, const std::array<double, 4>& cell) {
    constexpr int kSide = 200;
    double sum = 0.0;
    for (int i = 0; i < kSide * kSide; ++i) {
        sum += f(cell[0] + (cell[2] - cell[0]) * (i % kSide + 0.5) / kSide,
                 cell[1] + (cell[3] - cell[1]) * (i / kSide + 0.5) / kSide);
    }
    return sum * (cell[2] - cell[0]) * (cell[3] - cell[1]) / (kSide * kSide);
}

// The comparison itself: both arrays hold counts and include the cell of failed draws.
inline ChiSquareResult compare_histograms(const std::vector<double>& observed,
                                          const std::vector<double>& expected,
                                          const ChiSquareOptions& options) {
    constexpr double kMinExpected = 5.0;
    ChiSquareResult result;
    std::ostringstream out;
    std::vector<std::size_t> order(observed.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        order[i] = i;
        if (expected[i] < 1e-14 * options.samples && observed[i] > 0.0) {
            out << observed[i] << " samples in cell " << i << " where the density is zero";
            result.message = out.str();
            return result;
        }
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return expected[a] < expected[b];
    });
    double statistic = 0.0;
    double pooled_expected = 0.0;
    double pooled_observed = 0.0;
    int cells = 0;
    std::size_t worst = 0;
    double worst_term = 0.0;
    for (const std::size_t i : order) {
        pooled_expected += expected[i];
        pooled_observed += observed[i];
        if (pooled_expected >= kMinExpected) {
            const double difference = pooled_observed - pooled_expected;
            const double term = difference * difference / pooled_expected;
            if (term > worst_term) {
                worst_term = term;
                worst = i;
            }
            statistic += term;
            pooled_expected = pooled_observed = 0.0;
            ++cells;
        }
    }
    const double degrees = cells - 1;
    result.p_value = degrees >= 1.0 ? upper_gamma(0.5 * degrees, 0.5 * statistic) : 1.0;
    const double limit = 1.0 - std::pow(1.0 - options.significance, 1.0 / options.tests);
    result.passed = result.p_value >= limit;
    out << "chi-square " << statistic << ", degrees of freedom " << degrees << ", p "
        << result.p_value << " (limit " << limit << "), worst cell " << worst << ": observed "
        << observed[worst] << ", expected " << expected[worst];
    result.message = out.str();
    return result;
}

namespace detail {

// Shared by both domains: `cell_of` maps a sample to its cell, `density` is over the rectangle.
template <class Sample, class CellOf, class Density>
ChiSquareResult chi_square_rows(const Sample& sample,
                                const CellOf& cell_of,
                                const Density& density,
                                const std::array<double, 4>& domain,
                                const ChiSquareOptions& options) {
    const std::size_t cells = static_cast<std::size_t>(options.rows * options.columns);
    std::vector<double> observed(cells + 1, 0.0);
    std::vector<double> expected(cells + 1, 0.0);
    Random random(options.seed);
    for (int i = 0; i < options.samples; ++i) {
        const auto drawn = sample(random);
        ++observed[drawn ? cell_of(*drawn) : cells];
    }
    const double width = (domain[2] - domain[0]) / options.columns;
    const double height = (domain[3] - domain[1]) / options.rows;
    const double tolerance = 0.05 / options.samples;
    double mass = 0.0;
    for (std::size_t i = 0; i < cells; ++i) {
        const double x =
            domain[0] + width * static_cast<double>(i % static_cast<std::size_t>(options.columns));
        const double y =
            domain[1] + height * static_cast<double>(i / static_cast<std::size_t>(options.columns));
        const std::array<double, 4> cell{x, y, x + width, y + height};
        double m = integrate_cell(density, cell, tolerance, options.max_depth);
        // An edge of the support may cut a corner that no quadrature point met.
        if (observed[i] > 0.0 && m < 1e-8) {
            m = integrate_densely(density, cell);
        }
        expected[i] = m * options.samples;
        mass += m;
    }
    expected[cells] = std::max(1.0 - mass, 0.0) * options.samples;
    // A density that integrates to one leaves rounding of the quadrature: no draw may fail then.
    if (expected[cells] < 1e-4 * options.samples &&
        observed[cells] < 5.0 + 1e-4 * options.samples) {
        observed[cells] = expected[cells] = 0.0;
    }
    ChiSquareResult result = compare_histograms(observed, expected, options);
    result.total_mass = mass;
    if (mass > 1.002) {
        result.passed = false;
        result.message += "; the density integrates to " + std::to_string(mass);
    }
    return result;
}

inline std::size_t cell_index(double t, int count) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(t * count), 0, count - 1));
}

}  // namespace detail

// Directions on the unit sphere; pdf per solid angle.
template <class Sample, class Pdf>
ChiSquareResult chi_square_sphere(const Sample& sample,
                                  const Pdf& pdf,
                                  const ChiSquareOptions& options) {
    constexpr double kTwoPi = 2.0 * std::numbers::pi;
    const auto cell_of = [&options](const Vec3& world) {
        const Vec3 w = options.frame.to_local(world);
        const double phi = std::atan2(static_cast<double>(w.y), static_cast<double>(w.x));
        const std::size_t row =
            detail::cell_index(0.5 * (static_cast<double>(w.z) + 1.0), options.rows);
        const std::size_t column =
            detail::cell_index(phi < 0 ? phi / kTwoPi + 1.0 : phi / kTwoPi, options.columns);
        return row * static_cast<std::size_t>(options.columns) + column;
    };
    const auto density = [&options, &pdf](double phi, double z) {
        const double r = std::sqrt(std::max(1.0 - z * z, 0.0));
        const Vec3 w(static_cast<float>(r * std::cos(phi)),
                     static_cast<float>(r * std::sin(phi)),
                     static_cast<float>(z));
        return static_cast<double>(pdf(options.frame.to_world(w)));
    };
    return detail::chi_square_rows(sample, cell_of, density, {0.0, -1.0, kTwoPi, 1.0}, options);
}

// Points in [lower, upper]; pdf per unit area.
template <class Sample, class Pdf>
ChiSquareResult chi_square_rectangle(const Sample& sample,
                                     const Pdf& pdf,
                                     const Vec2& lower,
                                     const Vec2& upper,
                                     const ChiSquareOptions& options) {
    const auto cell_of = [&](const Vec2& p) {
        const Vec2 t = (p - lower) / (upper - lower);
        return detail::cell_index(static_cast<double>(t.y), options.rows) *
                   static_cast<std::size_t>(options.columns) +
               detail::cell_index(static_cast<double>(t.x), options.columns);
    };
    const auto density = [&pdf](double x, double y) {
        return static_cast<double>(pdf(Vec2(static_cast<float>(x), static_cast<float>(y))));
    };
    return detail::chi_square_rows(sample,
                                   cell_of,
                                   density,
                                   {static_cast<double>(lower.x),
                                    static_cast<double>(lower.y),
                                    static_cast<double>(upper.x),
                                    static_cast<double>(upper.y)},
                                   options);
}

}  // namespace pharos::test
