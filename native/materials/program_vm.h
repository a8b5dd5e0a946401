// The machine that runs node programs over lanes of hits (internal to materials/).
//
// Registers are arrays: component r of lane i lies at registers[r * lanes + i]. Operations come
// from compile_material(), so every index is valid, registers are written before they are read,
// each is written once, and outputs never overlap operands. Each operation is one function over all
// lanes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "materials/material.h"
#include "materials/node_program.h"

namespace pharos::detail {

// Most hits evaluated at once: bounds the register file to what the second-level cache holds.
inline constexpr std::size_t kMaxLanes = 256;

// An operand over the lanes; a constant has stride 0.
struct Operand {
    const float* data = nullptr;  // null: the socket's own default
    std::size_t lane_stride = 0;
    std::size_t component_stride = 1;

    [[nodiscard]] bool is_default() const { return data == nullptr; }

    [[nodiscard]] bool is_constant() const { return lane_stride == 0; }

    [[nodiscard]] float scalar(std::size_t lane) const { return data[lane * lane_stride]; }

    [[nodiscard]] Vec3 vector(std::size_t lane) const {
        const float* first = data + lane * lane_stride;
        return Vec3(first[0], first[component_stride], first[2 * component_stride]);
    }
};

struct Evaluation {
    const Material& material;
    const ShadingContext& context;
    ShadingScratch& scratch;
    std::span<const SurfaceInteraction> hits;
    std::span<const PathInfo> paths;       // empty: camera rays
    std::span<const std::uint32_t> index;  // of each lane's hit; empty: lane i is hit i
    std::size_t lanes = 0;
    float* registers = nullptr;
    bool estimate = false;  // images give their mean: what is known without a render

    [[nodiscard]] std::size_t hit_index(std::size_t lane) const {
        return index.empty() ? lane : index[lane];
    }

    [[nodiscard]] const SurfaceInteraction& hit(std::size_t lane) const {
        return hits[hit_index(lane)];
    }

    // Null for the world and for broken indices: object space is world space then.
    [[nodiscard]] const Instance* instance(const SurfaceInteraction& hit) const {
        return hit.instance < context.instances.size() ? &context.instances[hit.instance] : nullptr;
    }

    [[nodiscard]] const Mesh* mesh(const SurfaceInteraction& hit) const {
        const Instance* found = instance(hit);
        return found != nullptr && found->mesh < context.meshes.size()
                   ? &context.meshes[found->mesh]
                   : nullptr;
    }

    [[nodiscard]] Operand operand(const NodeOp& op, std::uint32_t number) const {
        const std::int32_t code = material.program.operands[op.first_operand + number];
        if (code >= 0) {
            return {registers + static_cast<std::size_t>(code) * lanes, 1, lanes};
        }
        if (code == kDefaultOperand) {
            return {};
        }
        return {&material.program.constants[static_cast<std::size_t>(~code)], 0, 1};
    }

    // All lanes of output component `number`.
    [[nodiscard]] float* output(const NodeOp& op, std::size_t number = 0) const {
        return registers + (static_cast<std::size_t>(op.output) + number) * lanes;
    }

    void store(const NodeOp& op, std::size_t lane, const Vec3& value) const {
        float* first = output(op) + lane;
        first[0] = value.x;
        first[lanes] = value.y;
        first[2 * lanes] = value.z;
    }
};

// The parameters in the order the exporter writes them: type, turbidity, elevation, rotation;
// altitude, air, dust, ozone; sun disc, sun size, sun intensity; at 12 the sun's direction.
[[nodiscard]] SkyParameters read_sky(std::span<const float> table);

// Runs value operations in order.
void run_values(const Evaluation& e, std::span<const NodeOp> ops);

// One operation each; grouped as their files are.
void run_copy(const Evaluation& e, const NodeOp& op);
void run_uv(const Evaluation& e, const NodeOp& op);
void run_geometry(const Evaluation& e, const NodeOp& op);
void run_coordinate(const Evaluation& e, const NodeOp& op);
void run_fresnel(const Evaluation& e, const NodeOp& op);
void run_layer_weight(const Evaluation& e, const NodeOp& op);
void run_normal_map(const Evaluation& e, const NodeOp& op);
void run_object_info(const Evaluation& e, const NodeOp& op);
void run_camera_data(const Evaluation& e, const NodeOp& op);
void run_light_path(const Evaluation& e, const NodeOp& op);
void run_vector_transform(const Evaluation& e, const NodeOp& op);

void run_scalar_to_vector(const Evaluation& e, const NodeOp& op);
void run_luminance(const Evaluation& e, const NodeOp& op);
void run_vector_average(const Evaluation& e, const NodeOp& op);
void run_math(const Evaluation& e, const NodeOp& op);
void run_vector_math(const Evaluation& e, const NodeOp& op);
void run_mix_float(const Evaluation& e, const NodeOp& op);
void run_mapping(const Evaluation& e, const NodeOp& op);
void run_combine(const Evaluation& e, const NodeOp& op);
void run_map_range(const Evaluation& e, const NodeOp& op);
void run_vector_map_range(const Evaluation& e, const NodeOp& op);
void run_clamp(const Evaluation& e, const NodeOp& op);
void run_vector_rotate(const Evaluation& e, const NodeOp& op);

void run_mix_color(const Evaluation& e, const NodeOp& op);
void run_ramp(const Evaluation& e, const NodeOp& op);
void run_invert(const Evaluation& e, const NodeOp& op);
void run_gamma(const Evaluation& e, const NodeOp& op);
void run_bright_contrast(const Evaluation& e, const NodeOp& op);
void run_hue_saturation(const Evaluation& e, const NodeOp& op);
void run_curves(const Evaluation& e, const NodeOp& op);
void run_separate_color(const Evaluation& e, const NodeOp& op);
void run_combine_color(const Evaluation& e, const NodeOp& op);
void run_blackbody(const Evaluation& e, const NodeOp& op);

void run_image(const Evaluation& e, const NodeOp& op);
void run_environment_image(const Evaluation& e, const NodeOp& op);
void run_checker(const Evaluation& e, const NodeOp& op);
void run_gradient(const Evaluation& e, const NodeOp& op);
void run_noise(const Evaluation& e, const NodeOp& op);
void run_musgrave(const Evaluation& e, const NodeOp& op);
void run_white_noise(const Evaluation& e, const NodeOp& op);
void run_voronoi(const Evaluation& e, const NodeOp& op);
void run_wave(const Evaluation& e, const NodeOp& op);
void run_magic(const Evaluation& e, const NodeOp& op);
void run_brick(const Evaluation& e, const NodeOp& op);
void run_bump(const Evaluation& e, const NodeOp& op);
void run_attribute(const Evaluation& e, const NodeOp& op);
void run_sky(const Evaluation& e, const NodeOp& op);
void run_tangent(const Evaluation& e, const NodeOp& op);
void run_instance_attribute(const Evaluation& e, const NodeOp& op);

// Appends the scattering closures of every hit (index of out) and adds its emission.
void run_closures(const Evaluation& e, std::span<const NodeOp> ops, ClosureBatch& out);

// Emitted radiance, or transmittance, of each lane; values[lane] is set.
void run_emission(const Evaluation& e, std::span<const NodeOp> ops, std::span<Rgb> values);
void run_transparency(const Evaluation& e, std::span<const NodeOp> ops, std::span<Rgb> values);

// Fills scratch.shifted with every lane's hit moved by `step` footprints of a pixel.
void shift_hits(const Evaluation& e, const Vec2& step);

// Geometry shared by operations.
// A surface's position as the user sees it; a direction of the world stays one.
[[nodiscard]] Vec3 world_point(const Evaluation& e, const SurfaceInteraction& hit);
[[nodiscard]] Vec3 object_normal(const Evaluation& e, const SurfaceInteraction& hit);
[[nodiscard]] Vec3 generated_coordinate(const Evaluation& e, const SurfaceInteraction& hit);
[[nodiscard]] Vec3 default_tangent(const Evaluation& e, const SurfaceInteraction& hit);

// uv of a hit by map name; finds the map again only when the mesh changes.
class UvLookup {
  public:
    // name: null for the first map.
    UvLookup(const Evaluation& e, const std::string* name) : e_(e), name_(name) {}

    [[nodiscard]] Vec2 at(const SurfaceInteraction& hit);

    // The three corners; false when the mesh has no such map or the index is broken.
    [[nodiscard]] bool corners(const SurfaceInteraction& hit, Vec2 (&uv)[3]);

  private:
    const Evaluation& e_;
    const std::string* name_;
    const Mesh* mesh_ = nullptr;
    const UvMap* map_ = nullptr;
};

}  // namespace pharos::detail
