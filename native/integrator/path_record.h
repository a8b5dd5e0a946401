// The chain of recorded vertices of a path: what guiding learns from and is judged by.
//
// A record is opened when the field is asked about a vertex, completed when its direction is
// sampled, and turned into training data when the path has ended and what arrived along the
// direction is known.
#pragma once

#include <cstdint>

#include "core/math.h"
#include "guiding/selection.h"

namespace pharos {

struct VertexRecord {
    SelectionRecord selection;
    std::uint32_t path = 0;
    std::uint32_t vertex = 0;
    std::uint32_t rank = 0;  // guide_rank()
    bool complete = false;   // a smooth direction was sampled
    bool judged = false;     // the field was asked, so that selection can compare
    float nee_scale = 0.0f;  // pdf / mis_weight of the light sample
    float smooth_probability = 1.0f;
    Vec3 wi{0.0f};
    Rgb f_cos{0.0f};            // at wi
    Rgb beta{0.0f};             // throughput up to and with the scattering
    Rgb radiance_before{0.0f};  // of the path when wi was sampled
    Rgb hit_weighted{0.0f};  // part of the path's radiance that came from emission at the next hit
    float split_scale = 1.0f;  // copies made before this vertex
};

// a / b per channel where b is positive, else 0.
[[nodiscard]] inline Rgb divide_or_zero(const Rgb& a, const Rgb& b) {
    return Rgb(b.x > 0.0f ? a.x / b.x : 0.0f,
               b.y > 0.0f ? a.y / b.y : 0.0f,
               b.z > 0.0f ? a.z / b.z : 0.0f);
}

}  // namespace pharos
