// Materials ready to shade: node programs with what can be known of them before a render, and their
// evaluation over batches of hits.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/math.h"
#include "core/scene_report.h"
#include "core/work_counter.h"
#include "geometry/accelerator.h"
#include "geometry/mesh.h"
#include "geometry/surface_interaction.h"
#include "image/texture.h"
#include "materials/bsdf.h"
#include "materials/node_program.h"
#include "materials/sky_model.h"

namespace pharos {

// The part of a program that one question needs: value operations, then closure operations.
struct ProgramSlice {
    std::vector<NodeOp> values;
    std::vector<NodeOp> closures;
};

// A checked program: every operand, register, table and image index is in range.
struct Material {
    std::string name;
    NodeProgram program;        // constants folded, registers renumbered, dead operations gone
    ProgramSlice surface;       // all closures
    ProgramSlice emission;      // those that emit
    ProgramSlice transparency;  // those that let light straight through
    ProgramSlice aovs;          // what it writes to passes, in place of closures
    std::vector<std::optional<SkyModel>> skies;  // of Sky operations, by table
    std::vector<std::uint8_t> straight_alpha;    // by image use: its alpha is read too
    std::uint32_t max_closures = 0;              // that one hit can have
    bool constant = false;     // no value operation: closures follow from constants alone
    bool emits = false;        // holds an Emission (or a Principled whose emission may be > 0)
    bool scatters = false;     // holds any other closure
    bool transparent = false;  // holds a Transparent closure: shadow rays must ask it
    bool transmits = false;    // light arrives from behind the shading normal
    bool textured = false;     // reads an image
    bool asks_path = false;    // of what kind the ray is, or how deep
    bool emission_sampling = true;
    bool emission_constant = false;  // emission_estimate is what every point emits any way
    Rgb emission_estimate{0.0f};     // mean emitted radiance, for light choice
};

// Checks `program` (a broken index is reported and the material becomes grey diffuse) and does once
// what needs no hit: constant values, dead operations, flags. `textures` (index = ImageUse::image)
// serve the estimate of textured emission alone.
[[nodiscard]] Material compile_material(std::string name,
                                        const NodeProgram& program,
                                        SceneReport& report,
                                        std::span<const Texture> textures = {});

// Mean emission of a program over made-up hits, and whether it is the same at all of them: what a
// lamp's node tree multiplies its strength with.
struct MeanEmission {
    Rgb mean{0.0f};
    bool constant = true;
};

[[nodiscard]] MeanEmission mean_emission(const NodeProgram& program);

// What the Light Path node tells of the ray that made a hit.
struct PathInfo {
    std::uint16_t kind = 1;  // bit LightPathOutput::Is...: the default is a camera ray
    std::uint8_t depth = 0;
    std::uint8_t diffuse_depth = 0;
    std::uint8_t glossy_depth = 0;
    std::uint8_t transparent_depth = 0;
    std::uint8_t transmission_depth = 0;
    float length_before = 0.0f;  // of the ray up to the transparent surface it last went through
};

// What programs read besides the hits. All spans outlive the call.
struct ShadingContext {
    std::span<const Mesh> meshes;
    std::span<const Instance> instances;
    std::span<const Texture> textures;  // index = SceneDescription::images
    std::uint32_t blender_version = 304;
    Vec3 origin{0.0f};                     // of the hits' positions, in the world
    Mat4 world_to_camera{1.0f};            // of those positions; looks along -z
    Mat4 camera_to_window{1.0f};           // projective: the frame is [0, 1] x [0, 1]
    std::span<const PathInfo> paths;       // of the hits or directions; empty: camera rays
    std::span<const Bounds3> mesh_bounds;  // object space, by mesh; empty: found when first needed
    std::span<const InstanceAttribute> instance_attributes;  // values by instance
    Vec2 pixel{0.0f};  // its size: at distance 1 of a perspective camera, else as it is
    bool perspective = true;
};

// Working memory of one thread, reused from call to call so that shading does not allocate.
struct ShadingScratch {
    std::vector<float> registers;
    std::vector<float> coordinates;           // of image look-ups
    std::vector<float> texels;                // of box projections
    std::vector<SurfaceInteraction> hits;     // stand-ins of world directions
    std::vector<SurfaceInteraction> shifted;  // a little beside the hits: bump mapping
    std::vector<Bounds3> mesh_bounds;         // by mesh, where the context has none
    std::vector<const Vec3*> bounded_meshes;  // positions that mesh_bounds belong to
    WorkCounter textures;                     // image look-ups since somebody asked
};

// Closures of a batch: path i has closures [first[i], first[i] + count[i]) and emitted radiance.
struct ClosureBatch {
    std::vector<Closure> closures;
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> count;
    std::vector<Rgb> emission;
    std::uint64_t dropped_closures = 0;

    void reset(std::size_t hits);  // clears closures, sizes the per-hit arrays
};

// Evaluates `material` at hits[index[i]] for every i, filling out's entries of those indices.
// Emission is zero when only scattering is asked for and the other way round costs less.
void evaluate_surfaces(const Material& material,
                       const ShadingContext& context,
                       std::span<const SurfaceInteraction> hits,
                       std::span<const std::uint32_t> index,
                       ShadingScratch& scratch,
                       ClosureBatch& out);

// Emission alone (next-event estimation towards emissive triangles).
void evaluate_emission(const Material& material,
                       const ShadingContext& context,
                       std::span<const SurfaceInteraction> hits,
                       ShadingScratch& scratch,
                       std::span<Rgb> emission);

// Transmittance of transparent closures (shadow rays).
void evaluate_transparency(const Material& material,
                           const ShadingContext& context,
                           std::span<const SurfaceInteraction> hits,
                           ShadingScratch& scratch,
                           std::span<Rgb> transmittance);

// What a material writes to AOVs: its operation material.aovs.closures[k] gives hit i
// values[k * hits.size() + i]; of a number all components are the same.
void evaluate_aovs(const Material& material,
                   const ShadingContext& context,
                   std::span<const SurfaceInteraction> hits,
                   ShadingScratch& scratch,
                   std::span<Vec3> values);

// The world as a far sphere seen from inside: hits whose position is the direction.
[[nodiscard]] SurfaceInteraction world_hit(const Vec3& direction);

// World radiance along directions (from the camera outwards).
void evaluate_world(const Material& world,
                    const ShadingContext& context,
                    std::span<const Vec3> directions,
                    ShadingScratch& scratch,
                    std::span<Rgb> radiance);

}  // namespace pharos
