// Kernels against the network in double: values, and gradients against central differences of the
// loss, for every encoding, activation and loss.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "guiding/adam.h"
#include "guiding/network_state.h"
#include "native/guiding/network_reference.h"
#include "support/random.h"

namespace pharos {
namespace {

using test::Random;
using test::ReferenceMixture;

struct Case {
    std::string name;
    GuidingConfig config;
};

std::vector<Case> cases() {
    std::vector<Case> out;
    GuidingConfig c;
    out.push_back({"default", c});
    c.lobes = 3;
    c.mu = MuActivation::Sigmoid;
    c.kappa = KappaActivation::Quadratic;
    out.push_back({"sigmoid, quadratic, 3 lobes", c});
    c = GuidingConfig::slides();
    out.push_back({"slides", c});
    c = GuidingConfig::slides(false);
    c.octaves = 0;
    c.kappa = KappaActivation::Quadratic;
    out.push_back({"slides, position only, raw", c});
    c = {};
    c.loss = GuidingLoss::RelativeSquared;
    c.width = 40;
    c.hidden_layers = 3;
    c.lobes = 5;
    out.push_back({"relative squared, 40 x 3", c});
    c = {};
    c.encoding = Encoding::HashGrid;
    c.grid_levels = 3;
    c.grid_features = 2;
    c.grid_log2_size = 8;
    c.lobes = 2;
    out.push_back({"grid", c});
    return out;
}

struct Problem {
    NetworkLayout layout;
    NetworkState state;
    RecordSet records;
    std::vector<RadianceRecord> raw;
    std::vector<float> target;
    std::vector<float> weight;

    explicit Problem(const GuidingConfig& config, std::size_t count)
        : layout(make_network_layout(config)) {
        Bounds3 box;
        box.extend(Vec3(-1.0f, -2.0f, 0.0f));
        box.extend(Vec3(2.0f, 1.0f, 3.0f));
        state = make_network_state(layout, box);
        state.radiance_scale = 1.0f;
        Random random(11);
        // Larger last-layer weights than at the start, so that lobes differ from place to place.
        for (float& p : state.parameters) {
            p *= 1.5f;
        }
        records.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            RadianceRecord r;
            r.position = box.lower + random.uniform3() * box.extent();
            r.normal = random.direction();
            r.wi = random.direction();
            r.pdf = random.uniform(0.05f, 2.0f);
            raw.push_back(r);
            target.push_back(i % 5 == 0 ? 0.0f : random.log_uniform(1e-2f, 50.0f));
            weight.push_back(i % 5 == 0 ? 4.0f : 1.0f);
            records.set(i, r, target.back(), weight.back());
        }
    }

    [[nodiscard]] NetworkView view() const {
        return {&layout,
                state.parameters.data(),
                state.center,
                state.inverse_half_extent,
                state.radiance_scale};
    }

    [[nodiscard]] std::vector<double> parameters() const {
        return {state.parameters.begin(), state.parameters.end()};
    }

    [[nodiscard]] ReferenceMixture mixture(const std::vector<double>& p, std::size_t i) const {
        return test::reference_evaluate(layout, p, view(), raw[i].position, raw[i].normal);
    }

    // The coefficients that the losses hold constant, at the parameters in use.
    struct Held {
        double log_pdf, log_integral;
    };

    [[nodiscard]] Held held(std::size_t i) const {
        const ReferenceMixture m = mixture(parameters(), i);
        const auto y = static_cast<double>(target[i]);
        const auto w = static_cast<double>(weight[i]);
        if (layout.config.loss == GuidingLoss::KullbackLeibler) {
            const double unit = 1.0 / (m.integral + 1e-3);
            const double slope =
                std::clamp(0.5 * m.integral * (m.integral - y) * unit * unit, -20.0, 20.0);
            return {-w * std::min(y * unit, static_cast<double>(layout.config.weight_clip)),
                    w * slope};
        }
        const auto pdf = static_cast<double>(raw[i].pdf);
        const double field = m.integral * m.pdf(raw[i].wi);
        const double slope = 0.25 * M_1_PI * 2.0 * field * (field - y * pdf) /
                             (pdf * (field * field + static_cast<double>(kFieldEpsilon)));
        const auto clip = static_cast<double>(layout.config.weight_clip);
        return {w * std::clamp(slope, -clip, clip), w * std::clamp(slope, -clip, clip)};
    }

    // The function whose gradient the kernels give.
    [[nodiscard]] double surrogate(const std::vector<double>& p, const std::vector<Held>& h) const {
        double sum = 0.0;
        for (std::size_t i = 0; i < raw.size(); ++i) {
            const ReferenceMixture m = mixture(p, i);
            sum += h[i].log_pdf * std::log(m.pdf(raw[i].wi) + static_cast<double>(kDensityFloor)) +
                   h[i].log_integral * std::log(m.integral);
        }
        return sum / static_cast<double>(layout.config.batch_size);
    }
};

std::vector<double> kernel_gradient(const Problem& problem) {
    AlignedFloats workspace(workspace_size(problem.layout));
    AlignedFloats gradient(problem.layout.mlp_parameters);
    const float loss =
        train_chunk(problem.view(), problem.records.columns(), 0, workspace, gradient);
    EXPECT_TRUE(std::isfinite(loss));
    std::vector<double> out(gradient.begin(), gradient.end());
    if (problem.layout.grid_parameters > 0) {
        std::vector<float> table(problem.layout.grid_parameters, 0.0f);
        for (std::size_t i = 0; i < problem.raw.size(); ++i) {
            const Vec3 p = (problem.raw[i].position - problem.state.center) *
                           problem.state.inverse_half_extent;
            scatter_grid_gradient(
                problem.layout.config, p, workspace.data() + i, kTrainChunk, table);
        }
        out.insert(out.end(), table.begin(), table.end());
    }
    return out;
}

TEST(Network, EvaluationMatchesDouble) {
    for (const Case& c : cases()) {
        const Problem problem(c.config, 100);
        AlignedFloats workspace(workspace_size(problem.layout));
        AlignedFloats values(2 * kTrainChunk);
        evaluate_chunk(problem.view(), problem.records.columns(), 0, workspace, values);
        for (std::size_t i = 0; i < problem.raw.size(); ++i) {
            const ReferenceMixture m = problem.mixture(problem.parameters(), i);
            const double pdf = m.pdf(problem.raw[i].wi);
            ASSERT_NEAR(static_cast<double>(values[i]), pdf, 1e-4 * pdf + 1e-7) << c.name;
            ASSERT_NEAR(static_cast<double>(values[kTrainChunk + i]), m.integral, 1e-4 * m.integral)
                << c.name;
        }
    }
}

TEST(Network, GradientsMatchFiniteDifferences) {
    for (const Case& c : cases()) {
        const Problem problem(c.config, 37);
        const std::vector<double> gradient = kernel_gradient(problem);
        std::vector<Problem::Held> held;
        for (std::size_t i = 0; i < problem.raw.size(); ++i) {
            held.push_back(problem.held(i));
        }
        double norm2 = 0.0;
        for (const double g : gradient) {
            norm2 += g * g;
        }
        ASSERT_GT(norm2, 0.0);
        // A random set of parameters of each kind; leaky kinks can spoil a single difference, so a
        // few may miss.
        Random random(12);
        int missed = 0;
        constexpr int kTried = 150;
        for (int i = 0; i < kTried; ++i) {
            const std::size_t at = random.index(static_cast<std::uint32_t>(gradient.size()));
            std::vector<double> p = problem.parameters();
            const double h = 1e-5;
            p[at] += h;
            const double plus = problem.surrogate(p, held);
            p[at] -= 2.0 * h;
            const double minus = problem.surrogate(p, held);
            const double slope = (plus - minus) / (2.0 * h);
            const double tolerance = 2e-4 * std::abs(slope) + 2e-5 * std::sqrt(norm2);
            missed += std::abs(gradient[at] - slope) > tolerance ? 1 : 0;
        }
        EXPECT_LE(missed, 1) << c.name;
    }
}

TEST(Network, InstructionSetsAgreeWithinRounding) {
    const std::int64_t available = hwy::SupportedTargets();
    for (const Case& c : cases()) {
        const Problem problem(c.config, 128);
        std::vector<double> first;
        for (const std::int64_t target : {HWY_AVX3, HWY_AVX2, HWY_SSE4, HWY_EMU128, HWY_SCALAR}) {
            if ((available & target) == 0) {
                continue;
            }
            hwy::SetSupportedTargetsForTest(target);
            hwy::GetChosenTarget().Update(hwy::SupportedTargets());
            const std::vector<double> gradient = kernel_gradient(problem);
            if (first.empty()) {
                first = gradient;
            }
            double norm2 = 0.0;
            double difference2 = 0.0;
            for (std::size_t i = 0; i < first.size(); ++i) {
                norm2 += first[i] * first[i];
                difference2 += (gradient[i] - first[i]) * (gradient[i] - first[i]);
            }
            EXPECT_LE(difference2, 1e-9 * norm2) << c.name << " target " << target;
        }
        hwy::SetSupportedTargetsForTest(0);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
}

TEST(Network, AdamMatchesItsFormula) {
    const GuidingConfig config;
    Random random(13);
    AlignedFloats gradient(32);
    AlignedFloats parameters(32);
    AlignedFloats first(32);
    AlignedFloats second(32);
    AlignedFloats average(32);
    std::vector<double> w(32);
    std::vector<double> m(32);
    std::vector<double> v(32);
    std::vector<double> mean(32);
    for (std::uint64_t t = 0; t < 50; ++t) {
        const AdamStep step = adam_schedule(config, t);
        const double rate = 0.01 * (0.1 + 0.9 * std::exp(-static_cast<double>(t) / 2400.0));
        const double decay = std::min(0.98, static_cast<double>(t) / static_cast<double>(t + 10));
        for (std::size_t i = 0; i < 32; ++i) {
            gradient[i] = random.uniform(-1.0f, 1.0f);
            const auto g = static_cast<double>(gradient[i]);
            m[i] = 0.9 * m[i] + 0.1 * g;
            v[i] = 0.99 * v[i] + 0.01 * g * g;
            const double m_hat = m[i] / (1.0 - std::pow(0.9, static_cast<double>(t + 1)));
            const double v_hat = v[i] / (1.0 - std::pow(0.99, static_cast<double>(t + 1)));
            w[i] -= rate * m_hat / (std::sqrt(v_hat) + 1e-8);
            mean[i] = decay * mean[i] + (1.0 - decay) * w[i];
        }
        adam_update(step, {gradient, parameters, first, second, average});
    }
    for (std::size_t i = 0; i < 32; ++i) {
        EXPECT_NEAR(static_cast<double>(parameters[i]), w[i], 1e-5);
        EXPECT_NEAR(static_cast<double>(average[i]), mean[i], 1e-5);
    }
}

TEST(Network, ConfigurationsOutOfLimitsAreNamed) {
    GuidingConfig config;
    config.lobes = 9;
    try {
        (void)make_network_layout(config);
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("lobes"), std::string::npos);
    }
    config = {};
    config.width = 20;
    EXPECT_THROW((void)make_network_layout(config), std::invalid_argument);
    config = {};
    config.batch_size = 100;
    EXPECT_THROW((void)make_network_layout(config), std::invalid_argument);
}

}  // namespace
}  // namespace pharos
