// How much of the guide's work fits into a frame of a live picture, and what is left out where not
// all does: counted vertices and records times costs that were measured once.
//
// A frame is one sample of every pixel, or where that takes longer than the screen waits for a
// redraw, as many frames as there are redraws in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "guiding/guiding_field.h"
#include "integrator/guide_limit.h"
#include "session/guide_costs.h"

namespace pharos {

// CPU seconds of all threads.
struct GuideBudget {
    double guide = std::numeric_limits<double>::infinity();  // of a frame
    double frame = std::numeric_limits<double>::infinity();  // between two redraws, at least
    GuideCosts costs;
    double vertex = 0.0;  // of a vertex without the guide; 0: unknown, a sample is one frame

    [[nodiscard]] bool limited() const { return guide < std::numeric_limits<double>::infinity(); }
};

// What a path of the last pass was.
struct GuideRates {
    std::array<double, kGuideRanks> demand{};  // vertices that a guide could serve, by rank
    double vertices = 0.0;                     // all
};

// What the next pass would do without a budget.
struct GuideWish {
    std::uint64_t pixels = 0;
    float record_probability = 0.0f;
    bool guides_proven = false;            // vertices of regions that have proven something
    bool guides_unproven = false;          // and all others
    std::size_t visits = kTrainingVisits;  // of training records
};

struct GuidePlan {
    GuideLimit limit;
    float record_probability = 0.0f;
    std::size_t visits = 0;  // of training records, at most
    double fitting = 1.0;    // share of the wish, by cost
};

// Records come first with half of the budget, or with what the guided vertices leave; then guided
// vertices by rank.
[[nodiscard]] GuidePlan plan_guide(const GuideBudget& budget,
                                   const GuideRates& rates,
                                   const GuideWish& wish);

}  // namespace pharos
