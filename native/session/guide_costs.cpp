#include "session/guide_costs.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <random>
#include <vector>

#include "core/parallel.h"
#include "guiding/guiding_field.h"
#include "sampling/sampler.h"
#include "sampling/warps.h"

namespace pharos {

namespace {

constexpr std::size_t kBatch = 1024;  // vertices asked at once, as a batch of paths does
constexpr int kBatches = 64;
constexpr std::size_t kRecords = 32768;

// CPU time of this thread.
double thread_seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Light from a part of the sky, everywhere in a box: every record trains.
std::vector<RadianceRecord> make_records() {
    std::mt19937 bits(1);
    const auto uniform = [&] { return bits_to_unit_float(static_cast<std::uint32_t>(bits())); };
    std::vector<RadianceRecord> records(kRecords);
    for (std::size_t i = 0; i < records.size(); ++i) {
        RadianceRecord& r = records[i];
        for (int axis = 0; axis < 3; ++axis) {
            r.position[axis] = 2.0f * uniform() - 1.0f;
        }
        const float u = uniform();
        r.wi = sample_uniform_sphere(Vec2(u, uniform()));
        r.normal = Vec3(0.0f, 0.0f, 1.0f);
        r.radiance_cos = 0.1f + std::max(0.0f, r.wi.z);
        r.pdf = uniform_sphere_pdf();
        r.key = i;
    }
    return records;
}

}  // namespace

GuideCosts measure_guide_costs(const GuidingConfig& config) {
    Bounds3 box;
    box.extend(Vec3(-1.0f));
    box.extend(Vec3(1.0f));
    GuidingField field(config, box);
    const std::vector<RadianceRecord> records = make_records();
    ThreadPool alone(1);
    GuideCosts costs;
    double begin = thread_seconds();
    const TrainStatistics trained = field.train(records, alone);
    costs.record = (thread_seconds() - begin) / static_cast<double>(trained.records);
    std::array<std::vector<float>, 6> columns;
    for (std::size_t i = 0; i < kBatch; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            columns[static_cast<std::size_t>(axis)].push_back(records[i].position[axis]);
            columns[static_cast<std::size_t>(axis) + 3].push_back(records[i].normal[axis]);
        }
    }
    const FieldQuery query{columns[0], columns[1], columns[2], columns[3], columns[4], columns[5]};
    std::vector<VmfMixture> mixtures(kBatch);
    begin = thread_seconds();
    for (int batch = 0; batch < kBatches; ++batch) {
        field.evaluate(query, mixtures);
    }
    costs.vertex = (thread_seconds() - begin) / (static_cast<double>(kBatch) * kBatches);
    return costs;
}

}  // namespace pharos
