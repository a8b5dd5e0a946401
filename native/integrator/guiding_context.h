// What a pass knows of the guide: the frozen field, where it is used, and what is recorded. All
// null and false when guiding is off: the stages then skip it without a look at any path.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "guiding/guiding_field.h"
#include "guiding/roulette.h"
#include "guiding/selection.h"
#include "integrator/guide_limit.h"

namespace pharos {

struct GuidingContext {
    const GuidingField* field = nullptr;        // null: the field has nothing to say yet
    const GuideSelection* selection = nullptr;  // null: fixed_share everywhere
    bool selection_serves = true;               // false: it is off everywhere
    // The least share where there is a selection, at diffuse and at glossy vertices.
    std::array<float, 2> fixed_share{};
    bool guides_transmission = true;  // transmitting lobes too; false: they sample themselves
    bool multiplies = true;           // the mixture by narrow reflecting lobes
    GuideLimit limit;    // vertices that are asked about anyway are served whatever it says
    bool probe = false;  // ask the field at every vertex of recorded paths, to judge it
    bool record = false;
    float record_probability = 0.0f;  // of a camera sample
    // Weight window where the guide is on, by what the mixture expects times this as the adjoint,
    // at diffuse and at glossy vertices; 0: roulette by the albedos there too.
    std::array<float, 2> adjoint_scale{};
    WeightWindow window;
    std::span<const float> pixel_estimate;  // luminance per pixel of the window; empty: none yet

    [[nodiscard]] bool active() const { return field != nullptr || record; }

    // Some vertex may be guided.
    [[nodiscard]] bool serves() const {
        return field != nullptr && (fixed_share[0] > 0.0f || fixed_share[1] > 0.0f ||
                                    (selection != nullptr && selection_serves));
    }
};

// What the paths of a pass teach, one buffer a thread; order is restored by the records' keys.
struct RecordBuffer {
    std::vector<RadianceRecord> radiance;
    std::vector<SelectionRecord> selection;
    std::uint64_t recorded_paths = 0;
    std::uint64_t variance_sum = 0;  // of kVarianceUnit: whole numbers add up alike in any order
    GuideDemand demand{};            // of one pass: not kept in files

    static constexpr double kVarianceUnit = 1.0 / (1 << 20);

    void clear() {
        radiance.clear();
        selection.clear();
        recorded_paths = 0;
        variance_sum = 0;
        demand = {};
    }

    void append(const RecordBuffer& other) {
        radiance.insert(radiance.end(), other.radiance.begin(), other.radiance.end());
        selection.insert(selection.end(), other.selection.begin(), other.selection.end());
        recorded_paths += other.recorded_paths;
        variance_sum += other.variance_sum;
        for (std::uint32_t rank = 0; rank < kGuideRanks; ++rank) {
            demand[rank] += other.demand[rank];
        }
    }
};

template <class Archive>
void state_fields(Archive& archive, RecordBuffer& records) {
    archive(records.radiance, records.selection, records.recorded_paths, records.variance_sum);
}

}  // namespace pharos
