#include "session/guide_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "session/pixel_estimate.h"

namespace pharos {

namespace {

constexpr double kRecordsPerPass = 32768.0;
// Hard scenes starve on that, few of their paths find the light: their records a vertex, and the
// most of a pass. What is learned early serves all passes after it, what is learned late only few.
constexpr double kMaxRecordsPerPass = 524288.0;

[[nodiscard]] double hard_records(std::uint32_t pass) {
    return pass < 8 ? 0.8 : pass < 20 ? 0.4 : 0.2;
}

// At the start it is steps that learning waits for, not records: in small pictures each is visited
// several times (kMaxVisitsOfRecord), so many visits in a pass.
constexpr std::uint32_t kEagerPasses = 10;
constexpr std::size_t kEagerVisits = 4 * kTrainingVisits;

// Where paths are quiet, learning takes no more than a few percent of a pass: records a vertex.
constexpr double kEasyRecords = 0.06;
constexpr float kFirstRecordProbability = 0.1f;
constexpr float kSlidesShare = 0.5f;

// In a hard scene (PassWeights) paths that find the light are too rare to prove the guide's worth
// region by region. There it serves everywhere at once, in every pass before which the second
// moments of all records together speak for it: they speak against a guide that learned nothing, or
// lies, from the first pass on.
constexpr float kMaxHardShare = kLargestShare;
// Where A is not what arrives the densities may be wrong as well, and a guide that takes so much
// would narrow on its own samples.
constexpr float kMaxDoubtfulShare = 0.5f;
constexpr std::uint32_t kHardTrialPasses = 12;
constexpr double kHardMaxMomentRatio = 0.97;        // after so many passes; until then
constexpr double kHardFirstMaxMomentRatio = 0.999;  // any gain will do
constexpr std::uint32_t kProbingPasses = 8;
constexpr std::uint32_t kEstimateEveryPass = 16;  // then every fourth; quiet pictures sooner
constexpr std::uint32_t kEasyEstimateEveryPass = 4;

// A pass takes this part of the samples so far: the field and the selection change less and less,
// and every pass costs something whatever its size.
constexpr std::uint32_t kHardPassPart = 16;
constexpr std::uint32_t kEasyPassPart = 4;

// The first pass with roulette by the adjoint: two that nothing has shaped decide how hard the
// picture is. It may come so soon since two of five paths survive whatever was learned by then
// (WeightWindow::min_survival), and splitting feeds the training where light is rare.
constexpr std::uint32_t kFirstRoulettePass = 2;
// The adjoint's sum over all records must be that of what arrived within this factor.
constexpr double kMaxCalibration = 4.0;

// A frame that goes on from another learns as from this pass on: it starts guided, and with as many
// records as a start takes. With those of later passes it follows a lamp that moves too slowly.
constexpr std::uint32_t kPassGoneOnFrom = 2;

// The field sees positions in units of the box it was made for; far out of it, or in a small part,
// it cannot tell them apart.
constexpr float kMaxGrowth = 2.0f;
constexpr float kMinPart = 0.25f;

[[nodiscard]] bool is_neural(GuidingMode mode) {
    return mode == GuidingMode::Neural || mode == GuidingMode::NeuralReflection ||
           mode == GuidingMode::NeuralRadiance;
}

}  // namespace

GuidingConfig guiding_config(GuidingMode mode) {
    switch (mode) {
        case GuidingMode::Off:
        case GuidingMode::Neural:
        case GuidingMode::NeuralReflection:
        case GuidingMode::NeuralRadiance:
            break;
        case GuidingMode::Slides:
            return GuidingConfig::slides();
        case GuidingMode::SlidesPosition:
            return GuidingConfig::slides(false);
        case GuidingMode::SlidesMixture: {
            GuidingConfig config = GuidingConfig::slides();
            config.lobes = GuidingConfig::neural().lobes;
            return config;
        }
    }
    return GuidingConfig::neural();
}

GuideController::GuideController(GuidingMode mode, const Bounds3& scene_box, std::uint64_t pixels)
    : mode_(mode),
      enabled_(mode != GuidingMode::Off && !scene_box.empty()),
      box_(scene_box),
      pixels_(pixels),
      record_probability_(pixels < 65536 ? 1.0f : kFirstRecordProbability) {
    status_.enabled = enabled_;
    if (enabled_) {
        field_.emplace(guiding_config(mode), scene_box);
        if (is_neural(mode)) {
            selection_.emplace(scene_box);
        }
    }
    plan_next();
}

void GuideController::begin_picture(const Bounds3& scene_box, std::uint64_t pixels, bool edited) {
    if (!enabled_) {
        return;
    }
    box_ = scene_box;
    pixels_ = pixels;
    pixel_estimate_.clear();
    weights_ = PassWeights();
    continued_ = field_->generation() > 0;
    if (!edited && pass_ > 1) {
        plan_next();
        return;
    }
    field_->restart_optimizer();
    if (selection_) {
        selection_.emplace(scene_box);
    }
    pass_ = 0;
    hard_share_ = {};
    adjoint_scale_ = {};
    status_.closed = false;
    status_.guided_share = 0.0;
    plan_next();
}

void GuideController::stay_out() {
    status_.brief = selection_.has_value();
}

void GuideController::stay_out_if_quiet() {
    short_ = selection_.has_value();
}

void GuideController::judge_length() {
    if (short_ && weights_.quiet()) {
        stay_out();
    }
}

void GuideController::set_budget(const GuideBudget& budget) {
    budget_ = budget;
    plan_next();
}

// What every path of a pass asked for, by those that were recorded.
void GuideController::count_rates(const RecordBuffer& records, const SelectionPass& work) {
    if (records.recorded_paths == 0 || work.paths <= 0.0) {
        return;
    }
    rates_.vertices = work.vertices / work.paths;
    for (std::uint32_t rank = 0; rank < kGuideRanks; ++rank) {
        rates_.demand[rank] =
            static_cast<double>(records.demand[rank]) / static_cast<double>(records.recorded_paths);
    }
}

void GuideController::plan_next() {
    GuideWish wish;
    wish.pixels = pixels_;
    wish.record_probability = record_probability_;
    wish.visits = hard_ && pass_ < kEagerPasses ? kEagerVisits : kTrainingVisits;
    if (field_ && field_->generation() > 0) {
        wish.guides_unproven = !selection_ || serves_unproven();
        wish.guides_proven = wish.guides_unproven || status_.guided_share > 0.0;
    }
    plan_ = plan_guide(budget_, rates_, wish);
    status_.fitting = plan_.fitting;
}

std::array<double, 2> GuideController::weight(std::uint32_t first_sample) const {
    return continued_ || status_.brief ? std::array{1.0, 1.0} : weights_.of(first_sample);
}

std::uint32_t GuideController::most_samples(std::uint32_t done) const {
    if (!learning() && (frozen_ || !enabled_ || !continued_ || done > 1)) {
        return std::numeric_limits<std::uint32_t>::max();
    }
    return std::max<std::uint32_t>(1, done / (hard_ ? kHardPassPart : kEasyPassPart));
}

void GuideController::see(const Film& film, std::uint32_t done) {
    // SLIDES guides from pass 1 on: what it shows there is no longer independent of pass 0.
    if (selection_ && !frozen_) {
        weights_.see(film, done);
        judge_length();
        if (continued_ && done == 2 && !hard_ && weights_.hard()) {
            // Another scene than the easy one before, after a cut say: its trial begins.
            hard_ = true;
            status_.closed = false;
            selection_.emplace(box_);
            pass_ = std::min(pass_, kPassGoneOnFrom);
        }
    }
}

GuidingContext GuideController::next_pass() const {
    GuidingContext context;
    if (!enabled_ || status_.closed || status_.brief) {
        return context;
    }
    context.record = !frozen_;
    context.record_probability = plan_.record_probability;
    context.limit = plan_.limit;
    context.pixel_estimate = pixel_estimate_;
    if (field_->generation() == 0) {
        return context;
    }
    context.field = &*field_;
    context.guides_transmission = mode_ != GuidingMode::NeuralReflection;
    context.multiplies = mode_ != GuidingMode::NeuralRadiance;
    if (!selection_) {
        context.fixed_share = {kSlidesShare, kSlidesShare};
        return context;
    }
    context.selection = &*selection_;
    context.selection_serves = status_.guided_share > 0.0;
    context.fixed_share = hard_share_;
    context.probe = !frozen_;
    if (pass_ >= kFirstRoulettePass) {
        context.adjoint_scale = adjoint_scale_;
    }
    return context;
}

void GuideController::learn(RecordBuffer records,
                            const SelectionPass& work,
                            const Film& film,
                            ThreadPool& pool,
                            const CancelFlag* cancel) {
    if (!learning()) {
        return;
    }
    const double recorded = static_cast<double>(records.radiance.size());
    const TrainStatistics trained = field_->train(records.radiance, pool, cancel, plan_.visits);
    if (cancel != nullptr && cancel->cancelled()) {
        return;
    }
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
        calibrate(selected.calibration);
        judge_hardness(selected);
        status_.guided_share = served_part(selected);
        status_.moment_ratio = selected.best.moment_ratio;
        status_.closed = selected.closed && !hard_;
        if (hard_) {
            wanted = std::clamp(hard_records(pass_) * work.vertices, wanted, kMaxRecordsPerPass);
        } else if (pass_ > 0) {
            wanted = std::min(wanted, kEasyRecords * work.vertices);
        }
        if (pass_ >= kProbingPasses) {
            wanted *= std::clamp(4.0 * status_.guided_share, 1.0 / 16.0, 1.0);
        }
    } else {
        status_.guided_share = 1.0;
    }
    if (recorded > 0.0) {
        const double per_probability = recorded / static_cast<double>(plan_.record_probability);
        record_probability_ = static_cast<float>(std::clamp(wanted / per_probability, 0.005, 1.0));
    }
    if (pass_ < (hard_ ? kEstimateEveryPass : kEasyEstimateEveryPass) || pass_ % 4 == 0 ||
        pixel_estimate_.empty()) {
        pixel_estimate_ = estimate_pixels(film);
    }
    ++pass_;
    count_rates(records, work);
    plan_next();
}

void GuideController::rest() {
    if (enabled_ && selection_ && !frozen_ && !status_.brief) {
        status_.closed = selection_->update({}, {}).closed;
    }
}

void GuideController::save(StateWriter& out) const {
    out(pass_, hard_, hard_share_, adjoint_scale_, record_probability_, pixel_estimate_, weights_);
    out(status_);
    if (enabled_) {
        out(field_->save());
    }
    if (selection_) {
        selection_->save(out);
    }
}

void GuideController::read_state(StateReader& in) {
    const bool enabled = enabled_;
    in(pass_, hard_, hard_share_, adjoint_scale_, record_probability_, pixel_estimate_, weights_);
    in(status_);
    StateReader::require(status_.enabled == enabled && record_probability_ > 0.0f &&
                         record_probability_ <= 1.0f);
    for (const float share : hard_share_) {
        StateReader::require(share >= 0.0f && share <= kMaxHardShare);
    }
    for (const float scale : adjoint_scale_) {
        StateReader::require(scale >= 0.0f && scale <= static_cast<float>(kMaxCalibration));
    }
    for (const float pixel : pixel_estimate_) {
        StateReader::require(pixel > 0.0f && std::isfinite(pixel));
    }
    if (enabled_) {
        std::vector<std::byte> field;
        in(field);
        try {
            field_->load(field);
        } catch (const std::invalid_argument& error) {
            throw StateError(error.what());
        }
    }
    if (selection_) {
        selection_->load(in);
    }
    plan_next();
}

void GuideController::load(StateReader& in) {
    read_state(in);
    StateReader::require((pixel_estimate_.empty() || pixel_estimate_.size() == pixels_) &&
                         weights_.fits(pixels_));
    judge_length();
}

void GuideController::load_frozen(StateReader& in) {
    read_state(in);
    weights_ = {};
    if (pixel_estimate_.size() != pixels_) {
        pixel_estimate_.clear();
    }
    frozen_ = true;
}

void GuideController::load_earlier(StateReader& in) {
    read_state(in);
    pixel_estimate_.clear();
    weights_ = {};
    frozen_ = false;
    continued_ = field_ && field_->generation() > 0;
    pass_ = std::min(pass_, kPassGoneOnFrom);
}

bool GuideController::serves(const Bounds3& scene_box) const {
    if (!field_) {
        return true;
    }
    const Bounds3 box = field_->box();
    const Vec3 joint = glm::max(box.upper, scene_box.upper) - glm::min(box.lower, scene_box.lower);
    const float own = max_component(box.extent());
    return max_component(joint) <= kMaxGrowth * own &&
           max_component(scene_box.extent()) >= kMinPart * own;
}

// A is only an adjoint where what it expects arrives.
void GuideController::calibrate(const std::array<double, 2>& calibration) {
    for (std::size_t kind = 0; kind < 2; ++kind) {
        const double c = calibration[kind];
        const bool plausible = c >= 1.0 / kMaxCalibration && c <= kMaxCalibration;
        adjoint_scale_[kind] = plausible ? static_cast<float>(1.0 / c) : 0.0f;
    }
}

// Of the recorded vertices: those of a kind that is served everywhere, and the proven ones.
double GuideController::served_part(const SelectionStatistics& selected) const {
    double part = 0.0;
    for (std::size_t kind = 0; kind < 2; ++kind) {
        part += hard_share_[kind] > 0.0f ? selected.best_of_kind[kind].part : 0.0;
    }
    return std::max(part, selected.guided_share);
}

void GuideController::judge_hardness(const SelectionStatistics& selected) {
    if (pass_ == 1) {
        hard_ = weights_.hard();
    } else if (pass_ >= kHardTrialPasses && selected.best.moment_ratio > kHardMaxMomentRatio) {
        hard_ = false;
    }
    for (std::size_t kind = 0; kind < 2; ++kind) {
        const BestShare& best = selected.best_of_kind[kind];
        const bool gains = best.moment_ratio < kHardFirstMaxMomentRatio;
        // The weight window adds to what the moments can see: more than the best share, while it
        // still gains.
        const float most = adjoint_scale_[kind] > 0.0f ? kMaxHardShare : kMaxDoubtfulShare;
        const float share = std::min(std::max(best.share, best.largest), most);
        hard_share_[kind] = hard_ && gains ? share : 0.0f;
    }
}

}  // namespace pharos
