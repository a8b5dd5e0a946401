#include "session/guide_controller.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/color.h"

namespace pharos {

namespace {

constexpr double kRecordsPerPass = 32768.0;
// Where paths are quiet, learning takes no more than a few percent of a pass: records a vertex.
constexpr double kEasyRecords = 0.06;
constexpr float kFirstRecordProbability = 0.1f;
constexpr float kSlidesShare = 0.5f;

// A scene whose paths differ from their pixels by this much (relative variance) is hard: paths that
// find the light are too rare to prove the guide's worth from records of unguided paths. There the
// guide serves everywhere at once, as long as the second moments measured under it do not speak
// against it.
constexpr double kHardVariance = 4.0;
constexpr float kHardShare = 0.5f;
constexpr std::uint32_t kHardTrialPasses = 12;
constexpr double kHardMaxMomentRatio = 0.97;
constexpr std::uint32_t kProbingPasses = 8;
constexpr std::uint32_t kEstimateEveryPass = 16;  // then every fourth; quiet pictures sooner
constexpr std::uint32_t kEasyEstimateEveryPass = 4;
constexpr int kBlurRadius = 3;
constexpr float kEstimateFloor = 0.1f;  // of the picture's mean
constexpr std::uint32_t kRampPasses = 2;

// The adjoint must have been learned before paths are killed by it: after so many paths.
constexpr std::uint64_t kPathsBeforeRoulette = 1u << 18;
constexpr std::uint32_t kMinPassesBeforeRoulette = 4;
constexpr std::uint32_t kMaxPassesBeforeRoulette = 16;

// Separable box blur with clamped edges, along one axis.
void blur_axis(const std::vector<float>& in,
               std::vector<float>& out,
               std::array<int, 2> size,
               int axis) {
    const int width = size[0];
    const int height = size[1];
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            double sum = 0.0;
            int count = 0;
            for (int d = -kBlurRadius; d <= kBlurRadius; ++d) {
                const int u = axis == 0 ? x + d : x;
                const int v = axis == 0 ? y : y + d;
                if (u >= 0 && u < width && v >= 0 && v < height) {
                    sum += static_cast<double>(in[static_cast<std::size_t>(v * width + u)]);
                    ++count;
                }
            }
            out[static_cast<std::size_t>(y * width + x)] = static_cast<float>(sum / count);
        }
    }
}

}  // namespace

double pass_weight(std::uint32_t pass) {
    return std::min(1.0, static_cast<double>(pass + 1) / kRampPasses);
}

GuideController::GuideController(GuidingMode mode, const Bounds3& scene_box, std::uint64_t pixels)
    : mode_(mode),
      enabled_(mode != GuidingMode::Off && !scene_box.empty()),
      pixels_(pixels),
      record_probability_(pixels < 65536 ? 1.0f : kFirstRecordProbability) {
    status_.enabled = enabled_;
    if (!enabled_) {
        return;
    }
    const bool slides = mode == GuidingMode::Slides;
    field_.emplace(slides ? GuidingConfig::slides() : GuidingConfig::neural(), scene_box);
    if (!slides) {
        selection_.emplace(scene_box);
    }
}

GuidingContext GuideController::next_pass() const {
    GuidingContext context;
    if (!learning()) {
        return context;
    }
    context.record = true;
    context.record_probability = record_probability_;
    context.pixel_estimate = pixel_estimate_;
    if (field_->generation() == 0) {
        return context;
    }
    context.field = &*field_;
    if (!selection_) {
        context.fixed_share = kSlidesShare;
        return context;
    }
    context.selection = &*selection_;
    context.selection_serves = status_.guided_share > 0.0;
    context.fixed_share = hard_ ? kHardShare : 0.0f;
    context.probe = true;
    const auto patience = static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(kPathsBeforeRoulette / std::max<std::uint64_t>(1, pixels_),
                                  kMinPassesBeforeRoulette,
                                  kMaxPassesBeforeRoulette));
    context.roulette = pass_ >= patience;
    return context;
}

void GuideController::learn(RecordBuffer records,
                            const SelectionPass& work,
                            const Film& film,
                            ThreadPool& pool) {
    if (!learning()) {
        return;
    }
    const double recorded = static_cast<double>(records.radiance.size());
    const TrainStatistics trained = field_->train(records.radiance, pool);
    status_.loss = trained.loss;
    status_.held_out_loss =
        trained.published ? trained.held_out_loss : trained.held_out_loss_before;
    status_.snapshots = field_->generation();
    status_.records += records.radiance.size();
    status_.skipped_steps += trained.skipped_steps;
    double wanted = kRecordsPerPass;
    if (selection_) {
        SelectionPass counted = work;
        counted.relative_variance = records.recorded_paths > 0
                                        ? static_cast<double>(records.variance_sum) *
                                              RecordBuffer::kVarianceUnit /
                                              static_cast<double>(records.recorded_paths)
                                        : 0.0;
        const SelectionStatistics selected = selection_->update(records.selection, counted);
        judge_hardness(counted.relative_variance, selected.moment_ratio);
        status_.guided_share = hard_ ? 1.0 : selected.guided_share;
        status_.moment_ratio = selected.moment_ratio;
        status_.closed = selected.closed && !hard_;
        if (!hard_ && pass_ > 0) {
            wanted = std::min(wanted, kEasyRecords * work.vertices);
        }
        if (pass_ >= kProbingPasses) {
            wanted *= std::clamp(4.0 * status_.guided_share, 1.0 / 16.0, 1.0);
        }
    } else {
        status_.guided_share = 1.0;
    }
    if (recorded > 0.0) {
        const double per_probability = recorded / static_cast<double>(record_probability_);
        record_probability_ = static_cast<float>(std::clamp(wanted / per_probability, 0.005, 1.0));
    }
    if (pass_ < (hard_ ? kEstimateEveryPass : kEasyEstimateEveryPass) || pass_ % 4 == 0) {
        update_pixel_estimate(film);
    }
    ++pass_;
}

void GuideController::rest() {
    if (enabled_ && selection_) {
        status_.closed = selection_->update({}, {}).closed;
    }
}

void GuideController::judge_hardness(double relative_variance, double moment_ratio) {
    if (pass_ == 1) {
        hard_ = relative_variance > kHardVariance;
    } else if (pass_ >= kHardTrialPasses && moment_ratio > kHardMaxMomentRatio) {
        hard_ = false;
    }
}

void GuideController::update_pixel_estimate(const Film& film) {
    const std::size_t pixels = std::size_t{film.width()} * film.height();
    std::vector<float> combined(pixels * 4);
    film.read(FilmPass::Combined, combined);
    std::vector<float> value(pixels);
    double mean = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
        value[i] = luminance(Rgb(combined[4 * i], combined[4 * i + 1], combined[4 * i + 2]));
        mean += static_cast<double>(value[i]);
    }
    mean /= static_cast<double>(pixels);
    pixel_estimate_.clear();
    if (!(mean > 0.0)) {
        return;
    }
    const std::array<int, 2> size{static_cast<int>(film.width()), static_cast<int>(film.height())};
    std::vector<float> half(pixels);
    blur_axis(value, half, size, 0);
    blur_axis(half, value, size, 1);
    const float floor = kEstimateFloor * static_cast<float>(mean);
    for (float& v : value) {
        v = std::max(v, floor);
    }
    pixel_estimate_ = std::move(value);
}

}  // namespace pharos
