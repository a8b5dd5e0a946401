// The whole input of a render as plain data: what the add-on fills, a dump file holds, and
// build_scene() turns into a Scene. No pointers, no library types; indices refer to the vectors
// here.
//
// Units: metres, watts, radians, scene-linear Rec.709. Matrices are object to world, affine.
// Any value may be wrong (it is user input): build_scene() reports and works around it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "camera/camera_description.h"
#include "core/math.h"
#include "core/visibility.h"
#include "film/film_description.h"
#include "film/passes.h"
#include "geometry/mesh.h"
#include "image/image_description.h"
#include "lights/light_description.h"
#include "materials/node_program.h"

namespace pharos {

struct InstanceDescription {
    std::string name;
    std::uint32_t mesh = 0;
    std::uint32_t material_set = 0;  // into material_sets
    Mat4 to_world{1.0f};
    std::uint32_t visibility = kVisibleAll;

    bool operator==(const InstanceDescription&) const = default;
};

inline constexpr std::uint16_t kDisplaceInWorld = 1;  // else in the object's space

struct MaterialDescription {
    std::string name;
    NodeProgram program;
    bool emission_sampling = true;  // next-event estimation towards emissive triangles
    // Moves vertices: AovValue along the normal, AovColor by a vector; mode is 0 or
    // kDisplaceInWorld. Empty: none moves.
    NodeProgram displacement;

    bool operator==(const MaterialDescription&) const = default;
};

struct WorldDescription {
    NodeProgram program;               // emission along the ray's direction; empty: black
    std::uint32_t map_resolution = 0;  // width of the importance map; 0: from the images, else 1024
    bool use_mis = true;
    std::uint32_t visibility = kVisibleAll;

    bool operator==(const WorldDescription&) const = default;
};

enum class GuidingMode : std::uint32_t {
    Off,
    Neural,
    Slides,          // the thesis' model: one lobe
    SlidesPosition,  // of the position alone, for comparison
    SlidesMixture,   // its loss on as many lobes as Neural has, for comparison
    // What parts of Neural are worth: transmitting lobes left to the material, no product with the
    // reflecting lobe.
    NeuralReflection,
    NeuralRadiance,
};

struct RenderSettings {
    std::uint32_t samples = 128;
    std::uint32_t seed = 0;
    float time_limit = 0.0f;  // seconds; 0: off
    bool use_nee = true;
    GuidingMode guiding = GuidingMode::Off;
    std::uint32_t max_bounces = 12;  // Cycles' meaning: 0 is direct light only
    std::uint32_t diffuse_bounces = 12;
    std::uint32_t glossy_bounces = 12;
    std::uint32_t transmission_bounces = 12;
    std::uint32_t transparent_bounces = 8;
    bool caustics_reflective = true;
    bool caustics_refractive = true;

    bool operator==(const RenderSettings&) const = default;
};

// What the passes on request need beside the scene (film/passes.h).
struct PassesDescription {
    std::uint32_t wanted = 0;  // pass_bit() of each
    float mist_start = 5.0f;
    float mist_depth = 25.0f;
    float mist_falloff = 2.0f;                    // exponent
    std::vector<std::uint32_t> object_indices;    // of each instance; 0 beyond the end
    std::vector<std::uint32_t> material_indices;  // of each material; likewise
    std::vector<AovDescription> aovs;

    bool operator==(const PassesDescription&) const = default;
};

struct SceneDescription {
    std::uint32_t blender_version = 304;  // major * 100 + minor: formulas of the look follow it
    std::vector<Mesh> meshes;
    std::vector<MaterialDescription> materials;
    std::vector<std::vector<std::uint32_t>>
        material_sets;  // material of each slot; kNone: grey default
    std::vector<InstanceDescription> instances;
    std::vector<ImageDescription> images;
    std::vector<LightDescription> lights;
    std::vector<NodeProgram> light_programs;  // of lamps that do not shine alike everywhere
    WorldDescription world;
    bool has_camera = false;
    CameraDescription camera;
    FilmDescription film;
    RenderSettings settings;
    PassesDescription passes;
    std::vector<InstanceAttribute> instance_attributes;  // values by instance; zero beyond the end
};

}  // namespace pharos
