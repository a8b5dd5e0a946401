#include "guiding/selection.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "guiding/selection_moments.h"

namespace pharos {

namespace {

constexpr int kGrid = 32;
constexpr int kParentGrid = kGrid / 4;
constexpr int kDirections = 6 * 2;  // dominant normal axis x glossy or not
constexpr std::size_t kCells = std::size_t{kGrid} * kGrid * kGrid * kDirections;
constexpr std::size_t kParents = std::size_t{kParentGrid} * kParentGrid * kParentGrid * kDirections;
constexpr std::uint32_t kUntouched = 0xffffffffu;

constexpr double kDecay = 0.9;  // of all sums, a pass
// Counted work, in the proportion that whole renders showed: of a guided vertex beyond that of any
// (inference, two more densities, its records and their training), and of any vertex.
constexpr double kGuideCost = 500.0;
constexpr double kVertexCost = 900.0;
constexpr double kStay = 0.8;        // hysteresis: a cell that is on stays on with less,
constexpr double kEnter = 1.2;       // and one that is off needs more
constexpr double kConfidence = 0.5;  // standard errors taken off the gain before it counts
constexpr double kKeepShare = 1.03;  // another share must be this much better
constexpr double kClearGain = 0.95;  // S_a / S_0 of a share that gains whatever the best one does
// Guided everywhere once so many vertices are in on-cells, and no longer when it is fewer by a
// third. The more a path varies, the more the weight window adds to what the moments can see
// (prototype: a factor of two on noisy scenes, a loss on quiet ones): above a relative variance of
// 2 it takes fewer.
constexpr double kOverrideShare = 0.45;
constexpr double kOverrideStay = 2.0 / 3.0;
constexpr double kQuietVariance = 2.0;
constexpr double kMinNoiseFactor = 0.2;  // early variances are those of the pixel estimate as well
// Nearly nothing is on: the whole machinery closes (with fewer where it is noisy, likewise).
constexpr double kGateShare = 0.12;
constexpr std::uint32_t kGatePasses = 9;  // after so many judged passes
// Sooner in a picture that is not noisy where the guide, asked everywhere, would gain next to
// nothing: the few regions it helps do not pay for records, training and look-ups.
constexpr std::uint32_t kHopelessPasses = 3;
constexpr double kHopelessRatio = 0.99;  // of the global moments
constexpr double kHopelessNoise = 0.4;   // least noise_factor
constexpr std::uint32_t kProbeEvery = 64;
constexpr std::uint32_t kProbePasses = 2;

// Sums of a pass are whole numbers of these units, so that the order of records does not matter.
constexpr double kContributionUnit = 0x1p-32;
constexpr double kCountUnit = 0x1p-20;

// A sum in a file above this is not one of ours: no render lasts so long.
constexpr double kMaxLoadedSum = 1e100;
constexpr double kMaxLoadedCount = 1e12;  // of records: in whole numbers of kSquareUnit it fits

// Index of the share for the next pass, from the one in use.
std::uint8_t decide(const MomentEstimate& e, std::uint8_t current, double threshold) {
    std::uint8_t best = 1;
    for (std::uint8_t a = 2; a < kShares; ++a) {
        best = e.mean[a] < e.mean[best] ? a : best;
    }
    if (current > 0 && e.mean[current] <= kKeepShare * e.mean[best]) {
        best = current;
    }
    const double gain = e.mean[0] - e.mean[best] - kConfidence * e.gain_error[best];
    return gain > threshold * (current > 0 ? kStay : kEnter) ? best : std::uint8_t{0};
}

BestShare best_share(const Moments& moments) {
    BestShare best;
    if (!(moments.moment[0] > 0.0)) {
        return best;
    }
    best.moment_ratio = kInfinity;
    for (std::size_t a = 1; a < kShares; ++a) {
        const double ratio = moments.moment[a] / moments.moment[0];
        if (ratio < best.moment_ratio) {
            best.share = kShare[a];
            best.moment_ratio = ratio;
        }
        best.largest = ratio < kClearGain ? kShare[a] : best.largest;
    }
    return best;
}

}  // namespace

struct GuideSelection::Impl {
    struct Cell {
        std::uint32_t index = 0;
        std::uint32_t parent = 0;
        std::uint8_t share = 0;
        Moments sums;
        PassSums pass;
    };

    struct Parent {
        std::uint8_t share = 0;
        Moments sums;
    };

    // Between passes: what a pass adds up is empty.
    template <class Archive>
    friend void state_fields(Archive& archive, Cell& cell) {
        archive(cell.index, cell.share, cell.sums);
    }

    template <class Archive>
    friend void state_fields(Archive& archive, Parent& parent) {
        archive(parent.share, parent.sums);
    }

    Vec3 lower{0.0f};
    Vec3 scale{0.0f};
    ShareTable share{kCells};         // index into kShare, per cell: what alpha() reads
    std::vector<std::uint32_t> slot;  // of the touched cells
    std::vector<Cell> cells;
    std::vector<Parent> parents;
    Moments global;
    std::array<Moments, 2> of_kind;            // diffuse, glossy
    std::array<Contributions, 2> contributed;  // diffuse, glossy
    double variance_sum = 0.0;
    double variance_count = 0.0;
    std::uint32_t judged_passes = 0;
    std::uint32_t closed_passes = 0;
    double noise_factor = 1.0;
    bool override_on = false;
    bool closed = false;
    std::uint32_t gate_at = kGatePasses;

    [[nodiscard]] std::uint32_t cell_of(const Vec3& p, const Vec3& n, bool glossy) const;
    Cell& touch(std::uint32_t index);
    void add_records(std::span<const SelectionRecord> records, double variance);
    void fold_pass(double variance);
    void decide_parents(double threshold);
    void decide_cells(double threshold);
    SelectionStatistics publish(double variance);
    void update_gate(const SelectionStatistics& statistics);
};

// Position, then dominant axis with its sign, then glossy. Non-finite input lands in some cell.
std::uint32_t GuideSelection::Impl::cell_of(const Vec3& p, const Vec3& n, bool glossy) const {
    std::uint32_t index = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const float x = (p[axis] - lower[axis]) * scale[axis];
        const float limited = x > 0.0f ? std::min(x, static_cast<float>(kGrid - 1)) : 0.0f;
        index = index * kGrid + static_cast<std::uint32_t>(limited);
    }
    const Vec3 size = glm::abs(n);
    const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    const auto direction = static_cast<std::uint32_t>(2 * axis + (n[axis] < 0.0f ? 1 : 0));
    return (index * 6 + direction) * 2 + (glossy ? 1 : 0);
}

namespace {

std::uint32_t parent_of(std::uint32_t cell) {
    const std::uint32_t direction = cell % kDirections;
    const std::uint32_t position = cell / kDirections;
    const std::uint32_t x = position / (kGrid * kGrid) / 4;
    const std::uint32_t y = position / kGrid % kGrid / 4;
    const std::uint32_t z = position % kGrid / 4;
    return ((x * kParentGrid + y) * kParentGrid + z) * kDirections + direction;
}

// The 64 cells of a parent, one after the other.
template <class Visit>
void for_each_child(std::uint32_t parent, const Visit& visit) {
    const std::uint32_t direction = parent % kDirections;
    const std::uint32_t position = parent / kDirections;
    const std::uint32_t x = position / (kParentGrid * kParentGrid) * 4;
    const std::uint32_t y = position / kParentGrid % kParentGrid * 4;
    const std::uint32_t z = position % kParentGrid * 4;
    for (std::uint32_t i = 0; i < 64; ++i) {
        const std::uint32_t cell = ((x + i / 16) * kGrid + y + i / 4 % 4) * kGrid + z + i % 4;
        visit(cell * kDirections + direction);
    }
}

}  // namespace

GuideSelection::Impl::Cell& GuideSelection::Impl::touch(std::uint32_t index) {
    if (slot[index] == kUntouched) {
        slot[index] = static_cast<std::uint32_t>(cells.size());
        Cell cell;
        cell.index = index;
        cell.parent = parent_of(index);
        cell.share = parents[cell.parent].share;
        cells.push_back(cell);
    }
    return cells[slot[index]];
}

void GuideSelection::Impl::add_records(std::span<const SelectionRecord> records, double variance) {
    std::array<std::int64_t, 2> expected{};
    std::array<std::int64_t, 2> arrived{};
    for (const SelectionRecord& r : records) {
        if (!is_valid(r)) {
            continue;
        }
        PassSums& sums = touch(cell_of(r.position, r.normal, r.glossy)).pass;
        if (!sums.add(record_moments(r), variance)) {
            continue;
        }
        const Contributions c = contributions(r);
        expected[r.glossy] += std::llrint(c.expected / kContributionUnit);
        arrived[r.glossy] += std::llrint(c.arrived / kContributionUnit);
    }
    for (std::size_t kind = 0; kind < 2; ++kind) {
        Contributions& sum = contributed[kind];
        sum.expected =
            kDecay * sum.expected + static_cast<double>(expected[kind]) * kContributionUnit;
        sum.arrived = kDecay * sum.arrived + static_cast<double>(arrived[kind]) * kContributionUnit;
    }
}

// Older passes fade, the new one joins: in cells, parents and the global sum. Cells are visited in
// order of first touch, which is not canonical: parents therefore add up whole numbers first.
void GuideSelection::Impl::fold_pass(double variance) {
    std::vector<PassSums> parent_pass(parents.size());
    std::array<PassSums, 2> kind_pass;
    for (Cell& cell : cells) {
        cell.sums.scale_by(kDecay);
        if (cell.pass.count > 0) {
            cell.sums.add(cell.pass.moments(variance), 1.0);
            parent_pass[cell.parent].add(cell.pass);
            kind_pass[cell.index % 2].add(cell.pass);
            cell.pass = {};
        }
    }
    for (std::size_t i = 0; i < parents.size(); ++i) {
        parents[i].sums.scale_by(kDecay);
        parents[i].sums.add(parent_pass[i].moments(variance), 1.0);
    }
    PassSums global_pass;
    for (std::size_t kind = 0; kind < 2; ++kind) {
        global_pass.add(kind_pass[kind]);
        of_kind[kind].scale_by(kDecay);
        of_kind[kind].add(kind_pass[kind].moments(variance), 1.0);
    }
    global.scale_by(kDecay);
    global.add(global_pass.moments(variance), 1.0);
}

// A parent's decision stands for its cells that no record has visited.
void GuideSelection::Impl::decide_parents(double threshold) {
    for (std::size_t i = 0; i < parents.size(); ++i) {
        Parent& parent = parents[i];
        if (parent.sums.count < 1.0) {
            continue;
        }
        const Moments shrunk = shrink(parent.sums, global);
        const double records = parent.sums.count + std::min(global.count, kPriorCount);
        const std::uint8_t next = decide(estimate(shrunk, records), parent.share, threshold);
        if (next != parent.share) {
            parent.share = next;
            for_each_child(static_cast<std::uint32_t>(i), [&](std::uint32_t child) {
                if (slot[child] == kUntouched) {
                    share.set(child, next);
                }
            });
        }
    }
}

void GuideSelection::Impl::decide_cells(double threshold) {
    for (Cell& cell : cells) {
        const Parent& parent = parents[cell.parent];
        const Moments above = shrink(parent.sums, global);
        const Moments shrunk = shrink(cell.sums, above);
        const double records = cell.sums.count + std::min(parent.sums.count, kPriorCount);
        cell.share = decide(estimate(shrunk, records), cell.share, threshold);
        share.set(cell.index, cell.share);
    }
}

SelectionStatistics GuideSelection::Impl::publish(double variance) {
    SelectionStatistics statistics;
    // Counts are decayed whole numbers; the order of cells is not fixed, so the sums are rounded
    // ones.
    std::int64_t on = 0;
    std::int64_t all = 0;
    for (const Cell& cell : cells) {
        const auto count = static_cast<std::int64_t>(cell.sums.count / kCountUnit);
        all += count;
        on += cell.share > 0 ? count : 0;
        statistics.cells_on += cell.share > 0 ? 1 : 0;
    }
    statistics.cells = static_cast<std::uint32_t>(cells.size());
    const double on_share = all > 0 ? static_cast<double>(on) / static_cast<double>(all) : 0.0;
    // A picture that has become quiet through guiding is still judged as the noisy one it was.
    noise_factor =
        std::min(noise_factor,
                 std::max(kQuietVariance / std::max(variance, kQuietVariance), kMinNoiseFactor));
    const double enough = kOverrideShare * noise_factor;
    override_on = on_share > (override_on ? kOverrideStay * enough : enough);
    statistics.guided_share = override_on ? 1.0 : on_share;
    statistics.best = best_share(global);
    for (std::size_t kind = 0; kind < 2; ++kind) {
        statistics.best_of_kind[kind] = best_share(shrink(of_kind[kind], global));
        statistics.best_of_kind[kind].part =
            global.count > 0.0 ? of_kind[kind].count / global.count : 0.0;
        if (contributed[kind].arrived > 0.0) {
            statistics.calibration[kind] = contributed[kind].expected / contributed[kind].arrived;
        }
    }
    return statistics;
}

// Closes when nearly nothing is on; opens again for two passes in 64 that it is told of.
void GuideSelection::Impl::update_gate(const SelectionStatistics& statistics) {
    const bool unused =
        judged_passes >= gate_at && statistics.guided_share < kGateShare * noise_factor;
    const bool first_time = gate_at == kGatePasses;
    const bool hopeless = first_time && judged_passes >= kHopelessPasses &&
                          noise_factor >= kHopelessNoise &&
                          statistics.best.moment_ratio > kHopelessRatio;
    if (unused || hopeless) {
        closed = true;
        closed_passes = 0;
    }
}

GuideSelection::GuideSelection(const Bounds3& scene_box) : impl_(std::make_unique<Impl>()) {
    if (!scene_box.empty() && is_finite(scene_box.lower) && is_finite(scene_box.upper)) {
        impl_->lower = scene_box.lower;
        for (int axis = 0; axis < 3; ++axis) {
            const float extent = scene_box.upper[axis] - scene_box.lower[axis];
            impl_->scale[axis] = extent > 1e-30f ? static_cast<float>(kGrid) / extent : 0.0f;
        }
    }
    impl_->slot.assign(kCells, kUntouched);
    impl_->parents.resize(kParents);
}

GuideSelection::~GuideSelection() = default;
GuideSelection::GuideSelection(GuideSelection&&) noexcept = default;
GuideSelection& GuideSelection::operator=(GuideSelection&&) noexcept = default;

float GuideSelection::alpha(const Vec3& position, const Vec3& normal, bool glossy) const {
    if (impl_->closed) {
        return 0.0f;
    }
    const float share = kShare[impl_->share[impl_->cell_of(position, normal, glossy)]];
    return impl_->override_on ? std::max(share, kShare[1]) : share;
}

SelectionStatistics GuideSelection::update(std::span<const SelectionRecord> records,
                                           const SelectionPass& pass) {
    Impl& s = *impl_;
    if (s.closed && ++s.closed_passes >= kProbeEvery) {
        s.closed = false;
        s.gate_at = s.judged_passes + kProbePasses;
    }
    if (std::isfinite(pass.relative_variance) && pass.relative_variance > 0.0) {
        // Passes weigh as in the moments: by their records. The first ones are the noisiest and
        // have the most, so that any other weight would let gains grow against the threshold.
        const auto count = static_cast<double>(records.size());
        s.variance_sum = kDecay * s.variance_sum + pass.relative_variance * count;
        s.variance_count = kDecay * s.variance_count + count;
    }
    SelectionStatistics statistics;
    if (!s.closed && !records.empty() && s.variance_count > 0.0 && pass.vertices > 0.0) {
        const double variance = s.variance_sum / s.variance_count;
        s.add_records(records, variance);
        s.fold_pass(variance);
        ++s.judged_passes;
        const double path_cost = pass.vertices / pass.paths * kVertexCost;
        const double threshold = variance * kGuideCost / std::max(path_cost, kVertexCost);
        s.decide_parents(threshold);
        s.decide_cells(threshold);
        statistics = s.publish(variance);
        s.update_gate(statistics);
    }
    statistics.closed = s.closed;
    if (s.closed) {
        statistics.guided_share = 0.0;
    }
    return statistics;
}

bool GuideSelection::closed() const {
    return impl_->closed;
}

void GuideSelection::save(StateWriter& out) const {
    Impl& s = *impl_;
    out(s.lower,
        s.scale,
        s.share.bytes(),
        s.cells,
        s.parents,
        s.global,
        s.of_kind,
        s.contributed,
        s.variance_sum);
    out(s.variance_count, s.judged_passes, s.closed_passes, s.noise_factor, s.override_on);
    out(s.closed, s.gate_at);
}

void GuideSelection::load(StateReader& in) {
    Impl& s = *impl_;
    in(s.lower, s.scale);
    in.expect(s.share.bytes());
    in(s.cells);
    in.expect(s.parents);
    in(s.global, s.of_kind, s.contributed, s.variance_sum);
    in(s.variance_count, s.judged_passes, s.closed_passes, s.noise_factor, s.override_on);
    in(s.closed, s.gate_at);
    const auto is_amount = [](double x) { return x >= 0.0 && x < kMaxLoadedSum; };
    const auto is_sound = [&](const Moments& m) {
        return std::ranges::all_of(m.moment, is_amount) &&
               std::ranges::all_of(m.square, is_amount) && m.count >= 0.0 &&
               m.count < kMaxLoadedCount;
    };
    StateReader::require(is_finite(s.lower) && is_finite(s.scale) && is_sound(s.global) &&
                         std::ranges::all_of(s.of_kind, is_sound) && is_amount(s.variance_count) &&
                         is_amount(s.variance_sum) &&
                         (s.variance_count == 0.0 || s.variance_sum / s.variance_count > 0.0) &&
                         s.noise_factor > 0.0 && s.noise_factor <= 1.0);
    const auto is_share = [](std::uint8_t share) { return share < kShares; };
    StateReader::require(std::ranges::all_of(s.parents, is_share, &Impl::Parent::share) &&
                         std::ranges::all_of(s.parents, is_sound, &Impl::Parent::sums));
    std::ranges::fill(s.slot, kUntouched);
    for (std::size_t i = 0; i < s.cells.size(); ++i) {
        Impl::Cell& cell = s.cells[i];
        StateReader::require(cell.index < kCells && s.slot[cell.index] == kUntouched &&
                             is_share(cell.share) && is_sound(cell.sums));
        s.slot[cell.index] = static_cast<std::uint32_t>(i);
        cell.parent = parent_of(cell.index);
    }
}

}  // namespace pharos
