// Schedules of the optimiser: learning rate, bias corrections (Kingma and Ba 2015) and averaging of
// the weights, as functions of the step. The update itself is adam_update in mlp.h.
#pragma once

#include <cmath>
#include <cstdint>

#include "guiding/guiding_config.h"
#include "guiding/mlp.h"

namespace pharos {

// `step` counts from 0. rate * (floor + (1 - floor) exp(-step / steps)), with other steps where the
// weights go on after an edit; the average's decay warms up as step / (step + 10), so that the
// first step is taken whole.
[[nodiscard]] inline AdamStep adam_schedule(const GuidingConfig& config,
                                            std::uint64_t step,
                                            bool goes_on = false) {
    const auto t = static_cast<double>(step);
    const float steps = goes_on ? config.relearning_rate_steps : config.learning_rate_steps;
    const auto floor = static_cast<double>(config.learning_rate_floor);
    const double decay = floor + (1.0 - floor) * std::exp(-t / static_cast<double>(steps));
    AdamStep out;
    const double correction1 = 1.0 - std::pow(static_cast<double>(out.beta1), t + 1.0);
    const double correction2 = std::sqrt(1.0 - std::pow(static_cast<double>(out.beta2), t + 1.0));
    out.rate = static_cast<float>(static_cast<double>(config.learning_rate) * decay * correction2 /
                                  correction1);
    out.epsilon = static_cast<float>(1e-8 * correction2);
    out.ema = static_cast<float>(std::min(static_cast<double>(config.ema_decay), t / (t + 10.0)));
    return out;
}

}  // namespace pharos
