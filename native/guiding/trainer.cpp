#include "guiding/trainer.h"

#include <atomic>
#include <cmath>
#include <functional>
#include <thread>

#include <immintrin.h>

#include "guiding/adam.h"
#include "guiding/encoding.h"

namespace pharos {

// The pool's threads for the length of one train() call: the caller leads and hands out short
// tasks, the others poll for them. A helper that the system has paused holds up nobody, since tasks
// are claimed one by one and the leader takes part.
class Trainer::Team {
  public:
    using Task = std::function<void(std::size_t)>;

    // Runs `lead` on the caller while the other threads help.
    void run(ThreadPool& pool, const std::function<void()>& lead) {
        pool.run([&](unsigned worker) {
            if (worker != 0) {
                help();
                return;
            }
            const EndGuard guard{*this};
            lead();
        });
    }

    // task(i) for i < count, from inside `lead`; returns when all are done.
    void for_each(std::size_t count, const Task& task) {
        task_ = &task;
        unfinished_.store(count, std::memory_order_relaxed);
        left_.store(static_cast<std::ptrdiff_t>(count), std::memory_order_release);
        work();
        while (unfinished_.load(std::memory_order_acquire) != 0) {
            _mm_pause();
        }
    }

  private:
    struct EndGuard {
        Team& team;

        ~EndGuard() { team.end_.store(true, std::memory_order_release); }
    };

    // Tasks are claimed by counting down: a late claim on a finished list gets nothing, and reads
    // nothing.
    void work() {
        while (true) {
            const std::ptrdiff_t i = left_.fetch_sub(1, std::memory_order_acq_rel) - 1;
            if (i < 0) {
                return;
            }
            (*task_)(static_cast<std::size_t>(i));
            unfinished_.fetch_sub(1, std::memory_order_release);
        }
    }

    void help() {
        int polls = 0;
        while (!end_.load(std::memory_order_acquire)) {
            if (left_.load(std::memory_order_relaxed) > 0) {
                work();
                polls = 0;
            } else if (++polls < 4000) {
                _mm_pause();
            } else {
                std::this_thread::yield();
            }
        }
    }

    std::atomic<std::ptrdiff_t> left_{0};
    std::atomic<std::size_t> unfinished_{0};
    std::atomic<bool> end_{false};
    const Task* task_ = nullptr;
};

Trainer::Trainer(const NetworkLayout& layout) : layout_(&layout) {
    const auto chunks = static_cast<std::size_t>(layout.config.batch_size / kTrainChunk);
    workspace_.resize(chunks);
    gradient_.resize(chunks);
    loss_.resize(chunks);
    for (std::size_t i = 0; i < chunks; ++i) {
        workspace_[i].resize(workspace_size(layout));
        gradient_[i].resize(layout.mlp_parameters);
    }
    grid_gradient_.resize(layout.grid_parameters);
}

NetworkView Trainer::view(const NetworkState& state, const AlignedFloats& parameters) const {
    return {
        layout_, parameters.data(), state.center, state.inverse_half_extent, state.radiance_scale};
}

TrainStatistics Trainer::train(NetworkState& state,
                               std::span<const RadianceRecord> records,
                               ThreadPool& pool,
                               const TrainLimits& limits) {
    TrainStatistics statistics;
    limits_ = limits;
    statistics.records = records.size();
    // Weights that something overwrote: back to the snapshot, or from the start.
    if (!all_finite(state.parameters) || !all_finite(state.average) ||
        !all_finite(state.first_moment) || !all_finite(state.second_moment)) {
        reset_weights(*layout_, state);
        if (state.generation > 0 && all_finite(state.published)) {
            state.parameters = state.published;
            restart_optimizer(state);
        }
    }
    prepare_records(layout_->config, records, state.radiance_scale, records_);
    statistics.invalid_records = records_.invalid;
    if (state.radiance_scale > 0.0f && records_.scale != state.radiance_scale) {
        reset_weights(*layout_, state);  // the light is another one by orders of magnitude
    }
    state.radiance_scale = records_.scale;
    if (records_.training.size() == 0) {
        return statistics;
    }
    Team team;
    team.run(pool, [&] {
        train_batches(state, team, statistics);
        if (!cancelled()) {
            publish_if_better(state, team, statistics);
        }
    });
    return statistics;
}

void Trainer::train_batches(NetworkState& state, Team& team, TrainStatistics& statistics) {
    const std::size_t batch_chunks = workspace_.size();
    const std::size_t chunks = records_.training.chunks();
    double loss = 0.0;
    // Few records (most had no light and were thinned) are visited several times: at the start it
    // is the number of steps that learning waits for.
    const std::size_t size = std::max<std::size_t>(1, records_.training.size());
    const std::size_t epochs =
        std::clamp<std::size_t>(limits_.visits / size, 1, kMaxVisitsOfRecord);
    const std::size_t end = epochs * chunks;
    for (std::size_t visit = 0; visit < end && !cancelled();) {
        const std::size_t first = visit % chunks;
        visit += std::min(batch_chunks, chunks - first);
        // A last batch of less than a quarter is too noisy to step on, unless it is all there is.
        const std::size_t count = std::min(batch_chunks, chunks - first);
        if (first > 0 && 4 * count < batch_chunks) {
            continue;
        }
        const bool stepped = train_batch(state, team, first, loss);
        statistics.steps += stepped ? 1 : 0;
        statistics.skipped_steps += stepped ? 0 : 1;
        statistics.trained_records +=
            std::min(records_.training.size() - first * kTrainChunk, count * kTrainChunk);
    }
    statistics.loss = static_cast<float>(
        loss / std::max<double>(1.0, static_cast<double>(statistics.trained_records)));
}

// One step; false when the gradient was not finite.
bool Trainer::train_batch(NetworkState& state, Team& team, std::size_t first_chunk, double& loss) {
    const std::size_t count = std::min(workspace_.size(), records_.training.chunks() - first_chunk);
    const NetworkView network = view(state, state.parameters);
    const TrainingColumns columns = records_.training.columns();
    team.for_each(count, [&](std::size_t i) {
        loss_[i] = static_cast<double>(train_chunk(
            network, columns, (first_chunk + i) * kTrainChunk, workspace_[i], gradient_[i]));
    });
    add_chunk_gradients(count);
    if (layout_->grid_parameters > 0) {
        add_grid_gradients(state, first_chunk, count);
    }
    // Squared norm in double, in eight partial sums.
    double partial[8] = {};
    for (std::size_t i = 0; i < gradient_[0].size(); ++i) {
        const auto g = static_cast<double>(gradient_[0][i]);
        partial[i % 8] += g * g;
    }
    for (std::size_t i = 0; i < grid_gradient_.size(); ++i) {
        const auto g = static_cast<double>(grid_gradient_[i]);
        partial[i % 8] += g * g;
    }
    double norm2 = 0.0;
    for (const double p : partial) {
        norm2 += p;
    }
    if (!std::isfinite(norm2)) {
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
        loss += loss_[i];
    }
    AdamStep step = adam_schedule(layout_->config, state.step, state.goes_on);
    const double limit = static_cast<double>(layout_->config.gradient_clip);
    const double norm = std::sqrt(norm2);
    step.gradient_scale = norm > limit ? static_cast<float>(limit / norm) : 1.0f;
    const auto update = [&](std::span<const float> gradient, std::size_t offset) {
        const auto part = [&](AlignedFloats& values) {
            return std::span<float>(values).subspan(offset, gradient.size());
        };
        adam_update(step,
                    {gradient,
                     part(state.parameters),
                     part(state.first_moment),
                     part(state.second_moment),
                     part(state.average)});
    };
    update(gradient_[0], 0);
    if (layout_->grid_parameters > 0) {
        update(grid_gradient_, layout_->mlp_parameters);
    }
    ++state.step;
    return true;
}

// Pairwise tree over the chunks, into the first.
void Trainer::add_chunk_gradients(std::size_t chunks) {
    for (std::size_t distance = 1; distance < chunks; distance *= 2) {
        for (std::size_t i = 0; i + distance < chunks; i += 2 * distance) {
            float* sum = gradient_[i].data();
            const float* other = gradient_[i + distance].data();
            for (std::size_t p = 0; p < gradient_[i].size(); ++p) {
                sum[p] += other[p];
            }
        }
    }
}

// The table's gradient, record after record.
void Trainer::add_grid_gradients(const NetworkState& state,
                                 std::size_t first_chunk,
                                 std::size_t chunks) {
    std::fill(grid_gradient_.begin(), grid_gradient_.end(), 0.0f);
    for (std::size_t c = 0; c < chunks; ++c) {
        for (std::size_t i = 0; i < kTrainChunk; ++i) {
            const std::size_t record = (first_chunk + c) * kTrainChunk + i;
            if (record < records_.training.size()) {
                const Vec3 p =
                    (records_.training.position(record) - state.center) * state.inverse_half_extent;
                scatter_grid_gradient(layout_->config,
                                      glm::clamp(p, Vec3(-1.0f), Vec3(1.0f)),
                                      workspace_[c].data() + i,
                                      kTrainChunk,
                                      grid_gradient_);
            }
        }
    }
}

namespace {

// One record under both networks; both losses share their weights, which come from the candidate
// alone.
struct HeldOutRecord {
    double target;  // radiance / pdf
    double pdf;
    double density;
    double integral;
    double other_density;
    double other_integral;
};

struct LossPair {
    double candidate = 0.0;
    double published = 0.0;
};

// Generalised KL of the unnormalised field, A - y log(A p), over the candidate's A, with y clipped
// as in training: least where both the direction and A are right.
LossPair kl_loss(const HeldOutRecord& r, double clip) {
    const double unit = 1.0 / (r.integral + static_cast<double>(kIntegralEpsilon));
    const double y = std::min(r.target * unit, clip);
    const auto floor = static_cast<double>(kDensityFloor);
    return {r.integral * unit - y * std::log(r.integral * (r.density + floor)),
            r.other_integral * unit - y * std::log(r.other_integral * (r.other_density + floor))};
}

// (L - A p)^2 / p_sampled over the larger of the two fields squared.
LossPair squared_loss(const HeldOutRecord& r) {
    const double radiance = r.target * r.pdf;
    const double a = r.integral * r.density;
    const double b = r.other_integral * r.other_density;
    const double unit =
        1.0 / (r.pdf * (std::max(a * a, b * b) + static_cast<double>(kFieldEpsilon)));
    const double limit = 1e6;
    return {std::min((radiance - a) * (radiance - a) * unit, limit),
            std::min((radiance - b) * (radiance - b) * unit, limit)};
}

}  // namespace

// The averaged weights become the snapshot unless they are worse on records that never trained.
void Trainer::publish_if_better(NetworkState& state, Team& team, TrainStatistics& statistics) {
    if (statistics.steps == 0 || !all_finite(state.average)) {
        return;
    }
    const RecordSet& set = records_.held_out;
    const std::size_t values = 2 * kTrainChunk;
    held_out_values_.resize(2 * values * set.chunks());
    const TrainingColumns columns = set.columns();
    const NetworkView networks[2] = {view(state, state.average), view(state, state.published)};
    const std::size_t slots = workspace_.size();
    for (std::size_t first = 0; first < 2 * set.chunks(); first += slots) {
        team.for_each(std::min(slots, 2 * set.chunks() - first), [&](std::size_t slot) {
            const std::size_t task = first + slot;
            evaluate_chunk(networks[task % 2],
                           columns,
                           task / 2 * kTrainChunk,
                           workspace_[slot],
                           std::span<float>(held_out_values_).subspan(task * values, values));
        });
    }
    // A field that has learned nothing yet has no unit: it is compared in the candidate's.
    const double rescale = state.generation == 0 ? 1.0
                                                 : static_cast<double>(state.published_scale) /
                                                       static_cast<double>(state.radiance_scale);
    LossPair loss;
    for (std::size_t i = 0; i < set.size(); ++i) {
        const float* candidate =
            held_out_values_.data() + i / kTrainChunk * 2 * values + i % kTrainChunk;
        const float* published = candidate + values;
        const HeldOutRecord record{static_cast<double>(set.target()[i]),
                                   static_cast<double>(set.pdf()[i]),
                                   static_cast<double>(candidate[0]),
                                   static_cast<double>(candidate[kTrainChunk]),
                                   static_cast<double>(published[0]),
                                   static_cast<double>(published[kTrainChunk]) * rescale};
        const GuidingConfig& config = layout_->config;
        const LossPair one = config.loss == GuidingLoss::KullbackLeibler
                                 ? kl_loss(record, static_cast<double>(config.weight_clip))
                                 : squared_loss(record);
        loss.candidate += one.candidate;
        loss.published += one.published;
    }
    const double unit = 1.0 / std::max<double>(1.0, static_cast<double>(set.size()));
    statistics.held_out_loss = static_cast<float>(loss.candidate * unit);
    statistics.held_out_loss_before = static_cast<float>(loss.published * unit);
    // A published loss that is not finite (overwritten weights) is worse than any.
    const bool worse = std::isfinite(loss.published) && !(loss.candidate <= loss.published);
    if (!worse && std::isfinite(loss.candidate)) {
        state.published = state.average;
        state.published_scale = state.radiance_scale;
        ++state.generation;
        statistics.published = true;
    }
}

}  // namespace pharos
