#include "guiding/record_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pharos {
namespace {

inline constexpr float kTargetLimit = 1e8f;  // in units of the scale

// Finaliser of SplitMix64 (Steele et al. 2014).
std::uint64_t mix_bits(std::uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9ull;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

bool is_valid(const RadianceRecord& r) {
    const float wi2 = length_squared(r.wi);
    return is_finite(r.position) && is_finite(r.normal) && wi2 > 0.99f && wi2 < 1.01f &&
           r.radiance_cos >= 0.0f && std::isfinite(r.radiance_cos) && r.pdf > 0.0f &&
           std::isfinite(r.pdf);
}

// radiance (* cos) / pdf: what the integral A is the mean of.
float raw_target(const GuidingConfig& config, const RadianceRecord& r) {
    float radiance = r.radiance_cos;
    if (!config.target_cosine) {
        radiance /= std::max(std::abs(glm::dot(r.normal, r.wi)), 1e-2f);
    }
    return std::min(radiance / r.pdf, std::numeric_limits<float>::max());
}

struct OrderedRecord {
    std::uint64_t hash;
    std::uint32_t index;
    float target;  // raw, not in units of the scale
};

// Sorts by hash: one pass over buckets of the top bits, then each small bucket.
void sort_by_hash(std::vector<OrderedRecord>& records) {
    constexpr int kBits = 12;
    std::vector<std::uint32_t> start((1u << kBits) + 1, 0);
    for (const OrderedRecord& r : records) {
        ++start[(r.hash >> (64 - kBits)) + 1];
    }
    for (std::size_t i = 1; i < start.size(); ++i) {
        start[i] += start[i - 1];
    }
    std::vector<OrderedRecord> sorted(records.size());
    std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
    for (const OrderedRecord& r : records) {
        sorted[next[r.hash >> (64 - kBits)]++] = r;
    }
    for (std::size_t i = 0; i + 1 < start.size(); ++i) {
        std::sort(sorted.begin() + start[i],
                  sorted.begin() + start[i + 1],
                  [](const OrderedRecord& a, const OrderedRecord& b) {
                      return a.hash != b.hash ? a.hash < b.hash : a.index < b.index;
                  });
    }
    records.swap(sorted);
}

// Mean with outliers cut at 1000 medians of the positive values, 0 without any.
float robust_mean(const std::vector<OrderedRecord>& records) {
    std::vector<float> positive;
    for (const OrderedRecord& r : records) {
        if (r.target > 0.0f) {
            positive.push_back(r.target);
        }
    }
    if (positive.empty()) {
        return 0.0f;
    }
    const auto middle = positive.begin() + static_cast<std::ptrdiff_t>(positive.size() / 2);
    std::nth_element(positive.begin(), middle, positive.end());
    const double limit = 1000.0 * static_cast<double>(*middle);
    double sum = 0.0;
    for (const OrderedRecord& r : records) {
        sum += std::min(static_cast<double>(r.target), limit);
    }
    return static_cast<float>(std::clamp(sum / static_cast<double>(records.size()), 1e-30, 1e30));
}

float update_scale(const std::vector<OrderedRecord>& records, float scale) {
    if (scale > 0.0f) {
        const double limit = 1e6 * static_cast<double>(scale);
        double sum = 0.0;
        for (const OrderedRecord& r : records) {
            sum += std::min(static_cast<double>(r.target), limit);
        }
        const double mean = sum / std::max<double>(1.0, static_cast<double>(records.size()));
        const double ratio = mean / static_cast<double>(scale);
        if (ratio > 1e-4 && ratio < 1e4) {
            return scale;
        }
        const float measured = robust_mean(records);
        const bool left = measured > 0.0f && (measured > 1e4f * scale || measured < 1e-4f * scale);
        return left ? measured : scale;
    }
    return robust_mean(records);
}

}  // namespace

void RecordSet::resize(std::size_t size) {
    size_ = size;
    const std::size_t padded = chunks() * kTrainChunk;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        columns_[c].resize(padded);
        std::fill(columns_[c].begin() + static_cast<std::ptrdiff_t>(size),
                  columns_[c].end(),
                  c == 10 ? 1.0f : 0.0f);
    }
}

void RecordSet::set(std::size_t i, const RadianceRecord& record, float target, float weight) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        columns_[a][i] = record.position[axis];
        columns_[3 + a][i] = record.normal[axis];
        columns_[6 + a][i] = record.wi[axis];
    }
    columns_[9][i] = target;
    columns_[10][i] = std::clamp(record.pdf, 1e-6f, 1e8f);
    columns_[11][i] = weight;
}

TrainingColumns RecordSet::columns() const {
    TrainingColumns out;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        out.position[axis] = columns_[axis].data();
        out.normal[axis] = columns_[3 + axis].data();
        out.wi[axis] = columns_[6 + axis].data();
    }
    out.target = columns_[9].data();
    out.pdf = columns_[10].data();
    out.weight = columns_[11].data();
    return out;
}

void prepare_records(const GuidingConfig& config,
                     std::span<const RadianceRecord> records,
                     float scale,
                     PreparedRecords& out) {
    std::vector<OrderedRecord> order;
    order.reserve(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        if (is_valid(records[i])) {
            order.push_back(
                {mix_bits(records[i].key + 0x9e3779b97f4a7c15ull * (config.seed + 1ull)),
                 static_cast<std::uint32_t>(i),
                 raw_target(config, records[i])});
        }
    }
    out.invalid = records.size() - order.size();
    sort_by_hash(order);
    out.scale = update_scale(order, scale);
    // Which set a record goes to, by bits of its own: 0 dropped, 1 training, 2 held out.
    const auto held_out_limit =
        static_cast<std::uint64_t>(static_cast<double>(config.held_out) * 0x1p32);
    const auto keep_limit =
        static_cast<std::uint64_t>(static_cast<double>(config.zero_keep) * 0x1p32);
    std::vector<std::uint8_t> destination(order.size());
    std::size_t count[3] = {};
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool held_out = (order[i].hash & 0xffffffffull) < held_out_limit;
        const bool thinned =
            order[i].target == 0.0f && (mix_bits(order[i].hash) >> 32) >= keep_limit;
        destination[i] = held_out ? 2 : (thinned ? 0 : 1);
        ++count[destination[i]];
    }
    out.training.resize(out.scale > 0.0f ? count[1] : 0);
    out.held_out.resize(out.scale > 0.0f ? count[2] : 0);
    if (!(out.scale > 0.0f)) {
        return;
    }
    std::size_t next[3] = {};
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (destination[i] == 0) {
            continue;
        }
        const float target = std::min(order[i].target / out.scale, kTargetLimit);
        RecordSet& set = destination[i] == 1 ? out.training : out.held_out;
        const float weight =
            destination[i] == 1 && order[i].target == 0.0f ? 1.0f / config.zero_keep : 1.0f;
        set.set(next[destination[i]]++, records[order[i].index], target, weight);
    }
}

}  // namespace pharos
