#include "guiding/record_set.h"

#include <algorithm>
#include <array>
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

// Sorts by hash: radix passes over the upper half of the bits, then insertion for what they leave
// (equal upper halves are rare). Equal hashes keep the order of arrival: keys are unique by
// contract.
void sort_by_hash(std::vector<OrderedRecord>& records) {
    constexpr int kBits = 11;
    constexpr std::size_t kBuckets = std::size_t{1} << kBits;
    std::vector<OrderedRecord> other(records.size());
    for (int shift = 64 - 3 * kBits; shift < 64; shift += kBits) {
        const auto bucket = [shift](const OrderedRecord& r) {
            return static_cast<std::size_t>(r.hash >> shift) & (kBuckets - 1);
        };
        std::array<std::uint32_t, kBuckets + 1> start{};
        for (const OrderedRecord& r : records) {
            ++start[bucket(r) + 1];
        }
        for (std::size_t i = 1; i <= kBuckets; ++i) {
            start[i] += start[i - 1];
        }
        for (const OrderedRecord& r : records) {
            other[start[bucket(r)]++] = r;
        }
        records.swap(other);
    }
    for (std::size_t i = 1; i < records.size(); ++i) {
        const OrderedRecord r = records[i];
        std::size_t at = i;
        for (; at > 0 && r.hash < records[at - 1].hash; --at) {
            records[at] = records[at - 1];
        }
        records[at] = r;
    }
}

// Mean of min(target / unit, limit), added up in whole numbers so that order does not matter.
double limited_mean(const std::vector<OrderedRecord>& records, float unit, float limit) {
    constexpr double kStep = 0x1p-20;
    const double scale = 1.0 / (static_cast<double>(unit) * kStep);
    const double largest = static_cast<double>(limit) / kStep;
    std::int64_t sum = 0;
    for (const OrderedRecord& r : records) {
        sum += static_cast<std::int64_t>(std::min(static_cast<double>(r.target) * scale, largest));
    }
    return static_cast<double>(sum) * kStep /
           std::max<double>(1.0, static_cast<double>(records.size()));
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
    const double mean = static_cast<double>(*middle) * limited_mean(records, *middle, 1000.0f);
    return static_cast<float>(std::clamp(mean, 1e-30, 1e30));
}

float update_scale(const std::vector<OrderedRecord>& records, float scale) {
    if (!(scale > 0.0f)) {
        return robust_mean(records);
    }
    const double ratio = limited_mean(records, scale, 1e6f);
    if (ratio > 1e-4 && ratio < 1e4) {
        return scale;
    }
    const float measured = robust_mean(records);
    const bool left = measured > 0.0f && (measured > 1e4f * scale || measured < 1e-4f * scale);
    return left ? measured : scale;
}

// Fills a set in the order of hashes.
void fill_set(std::span<const RadianceRecord> records,
              std::vector<OrderedRecord>& order,
              float scale,
              float zero_weight,
              RecordSet& set) {
    constexpr std::size_t kAhead = 12;
    sort_by_hash(order);
    set.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i + kAhead < order.size()) {
            __builtin_prefetch(&records[order[i + kAhead].index]);
        }
        const float target = std::min(order[i].target / scale, kTargetLimit);
        set.set(i, records[order[i].index], target, order[i].target == 0.0f ? zero_weight : 1.0f);
    }
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
    std::vector<OrderedRecord> valid;
    valid.reserve(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        if (is_valid(records[i])) {
            valid.push_back(
                {mix_bits(records[i].key + 0x9e3779b97f4a7c15ull * (config.seed + 1ull)),
                 static_cast<std::uint32_t>(i),
                 raw_target(config, records[i])});
        }
    }
    out.invalid = records.size() - valid.size();
    out.scale = update_scale(valid, scale);
    // Held out, thinned or trained on: by bits of the hash, so by the key alone.
    const auto limit_of = [](float share) {
        return static_cast<std::uint64_t>(static_cast<double>(share) * 0x1p32);
    };
    const std::uint64_t held_out_limit = limit_of(config.held_out);
    const std::uint64_t keep_limit = limit_of(config.zero_keep);
    std::vector<OrderedRecord> training;
    std::vector<OrderedRecord> held_out;
    training.reserve(valid.size());
    for (const OrderedRecord& r : valid) {
        if (!(out.scale > 0.0f)) {
            break;
        }
        if ((r.hash & 0xffffffffull) < held_out_limit) {
            held_out.push_back(r);
        } else if (r.target > 0.0f || (mix_bits(r.hash) >> 32) < keep_limit) {
            training.push_back(r);
        }
    }
    fill_set(records, training, out.scale, 1.0f / config.zero_keep, out.training);
    fill_set(records, held_out, out.scale, 1.0f, out.held_out);
}

}  // namespace pharos
