// Which light a receiver samples, and with what probability.
//
// Up to kMaxEstimated groups (a lamp, the emissive triangles of one material on one instance, the
// world): in proportion to an estimate of each one's irradiance at the receiver, from strength,
// distance and bounds on both cosines; zero only where nothing can arrive. More: by strength alone,
// from an alias table. A scene with one group pays nothing.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "lights/lamp.h"
#include "lights/light.h"
#include "sampling/alias_table.h"

namespace pharos {

enum class EmitterOrientation : std::uint8_t {
    Any,       // the same in all directions
    Front,     // cosine around axis, nothing behind the plane through the center
    TwoSided,  // |cosine| around axis
    Cone,      // a spot's
};

enum class EmitterDistance : std::uint8_t { Local, Distant, Ambient };

// What the choice knows of a group.
struct LightBound {
    EmitterDistance distance = EmitterDistance::Local;
    EmitterOrientation orientation = EmitterOrientation::Any;
    float strength = 0.0f;  // irradiance across: Local at 1 m in the main direction, else anywhere
    float radius = 0.0f;    // of a sphere around the emitter; Distant: sine of the half angle
    float area = 0.0f;      // keeps irradiance finite nearby
    float cos_limit = -1.0f;  // Cone: no light outside
    float cos_width = 0.0f;   // Cone: full light this much further in
    float reach = kInfinity;  // Front with spread: tangent of the widest angle
    float spread_scale = 1.0f;
    Vec3 center;  // Distant: direction towards it
    Vec3 axis;    // of the emission
};

[[nodiscard]] LightBound bound_lamp(const Lamp& lamp);

class LightSelection {
  public:
    static constexpr std::uint32_t kMaxEstimated = 32;

    LightSelection() = default;

    // `scene_radius` brings local and distant lights to one scale where strength alone decides.
    LightSelection(std::span<const LightBound> bounds, float scene_radius);

    struct Choice {
        std::uint32_t group = 0;
        float pmf = 0.0f;
        double u = 0.0;  // what is left of the random number
    };

    [[nodiscard]] bool empty() const { return count_ == 0; }

    [[nodiscard]] std::uint32_t size() const { return count_; }

    // nullopt: nothing arrives from any group.
    [[nodiscard]] std::optional<Choice> choose(const LightSampleContext& context, double u) const;

    [[nodiscard]] float pmf(const LightSampleContext& context, std::uint32_t group) const;

  private:
    using Column = std::array<float, kMaxEstimated>;

    // The bounds as one branch-free formula, in columns for SIMD; unused entries have strength 0.
    struct Columns {
        Column center_x{}, center_y{}, center_z{};
        Column axis_x{}, axis_y{}, axis_z{};
        Column local{};  // 1: seen from the receiver; 0: center is the direction
        Column strength{};
        Column radius{};
        Column min_distance2{};
        Column min_received{};  // floor of the receiver's cosine
        Column mirror{};        // -1: both sides emit
        Column cutoff{};        // no light below this cosine
        Column cone_limit{}, cone_scale{}, cone_floor{};
        Column spread_scale{}, spread_slope{};
        Column lit_bias{}, lit_scale{};
    };

    void set_column(std::size_t i, const LightBound& bound);

    // Estimates of all groups; returns their sum.
    float estimate(const LightSampleContext& context, Column& weights) const;

    std::uint32_t count_ = 0;
    Columns columns_;
    AliasTable by_strength_;
};

}  // namespace pharos
