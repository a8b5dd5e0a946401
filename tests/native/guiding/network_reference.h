// The network once more, in double and without SIMD: what the kernels are checked against.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "guiding/encoding.h"
#include "guiding/mlp.h"
#include "guiding/record_set.h"

namespace pharos::test {

struct ReferenceLobe {
    double weight, kappa;
    std::array<double, 3> mu;
};

struct ReferenceMixture {
    std::vector<ReferenceLobe> lobes;
    double integral = 0.0;  // in units of the scale

    [[nodiscard]] double pdf(const Vec3& w) const {
        double sum = 0.0;
        for (const ReferenceLobe& lobe : lobes) {
            double chord2 = 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                const double d =
                    static_cast<double>(w[axis]) - lobe.mu[static_cast<std::size_t>(axis)];
                chord2 += d * d;
            }
            sum += lobe.weight * lobe.kappa / (-std::expm1(-2.0 * lobe.kappa)) * 0.5 * M_1_PI *
                   std::exp(-0.5 * lobe.kappa * chord2);
        }
        return sum;
    }
};

inline double smooth_limit(double x, double center, double half) {
    const double u = (x - center) / half;
    return center + half * u / std::sqrt(1.0 + u * u);
}

inline std::vector<double> reference_inputs(const NetworkLayout& layout,
                                            const std::vector<double>& parameters,
                                            const NetworkView& view,
                                            const Vec3& position,
                                            const Vec3& normal) {
    std::vector<double> x(static_cast<std::size_t>(layout.inputs));
    const GuidingConfig& config = layout.config;
    Vec3 p = (position - view.center) * view.inverse_half_extent;
    if (config.encoding == Encoding::Frequency) {
        const auto octaves = static_cast<std::size_t>(config.octaves);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double c =
                std::clamp(static_cast<double>(p[static_cast<int>(axis)]), -1.25, 1.25);
            x[axis] = c;
            for (std::size_t k = 0; k < octaves; ++k) {
                const double angle = 0.5 * M_PI * std::exp2(static_cast<double>(k)) * c;
                x[3 + axis * 2 * octaves + 2 * k] = std::sin(angle);
                x[3 + axis * 2 * octaves + 2 * k + 1] = std::cos(angle);
            }
        }
    } else {
        // The features are linear in the table: one look-up in float per feature would lose the
        // small steps of a finite difference, so each corner is read in double through its
        // gradient.
        std::vector<float> corner_weight(layout.grid_parameters);
        for (int f = 0; f < layout.position_inputs; ++f) {
            std::vector<float> one(static_cast<std::size_t>(layout.position_inputs), 0.0f);
            one[static_cast<std::size_t>(f)] = 1.0f;
            std::fill(corner_weight.begin(), corner_weight.end(), 0.0f);
            scatter_grid_gradient(config, p, one.data(), 1, corner_weight);
            double sum = 0.0;
            for (std::size_t i = 0; i < corner_weight.size(); ++i) {
                sum +=
                    static_cast<double>(corner_weight[i]) * parameters[layout.mlp_parameters + i];
            }
            x[static_cast<std::size_t>(f)] = sum;
        }
    }
    for (int axis = 0; axis < 3 && config.use_normal; ++axis) {
        x[static_cast<std::size_t>(layout.position_inputs + axis)] =
            static_cast<double>(normal[axis]);
    }
    return x;
}

inline ReferenceMixture reference_decode(const GuidingConfig& config,
                                         const std::vector<double>& y) {
    ReferenceMixture out;
    const auto lobes = static_cast<std::size_t>(config.lobes);
    double sum = 0.0;
    for (std::size_t k = 0; k < lobes; ++k) {
        sum += std::exp(y[k]);
    }
    for (std::size_t k = 0; k < lobes; ++k) {
        ReferenceLobe lobe{};
        lobe.weight = std::exp(y[k]) / sum;
        double length2 = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double raw = y[(1 + axis) * lobes + k];
            lobe.mu[axis] =
                config.mu == MuActivation::Sigmoid ? 2.0 / (1.0 + std::exp(-raw)) - 1.0 : raw;
            length2 += lobe.mu[axis] * lobe.mu[axis];
        }
        for (double& m : lobe.mu) {
            m /= std::sqrt(length2);
        }
        const double x = y[4 * lobes + k];
        const double high = std::log(static_cast<double>(config.kappa_max));
        const double low = std::log(1e-2);
        lobe.kappa = config.kappa == KappaActivation::Exponential
                         ? std::exp(smooth_limit(x, 0.5 * (low + high), 0.5 * (high - low)))
                         : x * x / (1.0 + x * x / static_cast<double>(config.kappa_max)) + 1e-2;
        out.lobes.push_back(lobe);
    }
    out.integral = std::exp(smooth_limit(y[5 * lobes], 0.0, 15.0));
    return out;
}

inline ReferenceMixture reference_evaluate(const NetworkLayout& layout,
                                           const std::vector<double>& parameters,
                                           const NetworkView& view,
                                           const Vec3& position,
                                           const Vec3& normal) {
    std::vector<double> x = reference_inputs(layout, parameters, view, position, normal);
    for (int l = 0; l < layout.layers; ++l) {
        const LayerShape& shape = layout.layer[static_cast<std::size_t>(l)];
        std::vector<double> y(static_cast<std::size_t>(shape.outputs));
        for (std::size_t row = 0; row < y.size(); ++row) {
            double sum = parameters[shape.biases + row];
            for (std::size_t k = 0; k < x.size(); ++k) {
                sum += parameters[shape.weights + row * x.size() + k] * x[k];
            }
            const bool leak = l + 1 < layout.layers && sum < 0.0;
            y[row] = leak ? static_cast<double>(layout.config.leaky_slope) * sum : sum;
        }
        x = std::move(y);
    }
    return reference_decode(layout.config, x);
}

}  // namespace pharos::test
