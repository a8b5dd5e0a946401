// A scene ready to trace: immutable, shared by all threads.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/cancel.h"
#include "core/scene_report.h"
#include "geometry/accelerator.h"
#include "geometry/instance_surface.h"
#include "image/texture.h"
#include "lights/environment_light.h"
#include "lights/light_sampler.h"
#include "materials/material.h"
#include "scene/scene_description.h"

namespace pharos {

// What a scene does not need is decided once, here.
struct SceneNeeds {
    bool lamps_hittable = false;
    bool emission = false;            // some surface emits
    bool emissive_triangles = false;  // and is sampled by next-event estimation
    bool environment = false;         // the world is not black
    bool constant_environment = false;
    bool transparency = false;  // some material lets shadow rays through
    bool textures = false;
    bool lamp_programs = false;  // some lamp does not shine alike everywhere
    bool light_path = false;     // some program asks how a path came
    bool all_constant = false;   // no material runs a node program
    bool nee = false;            // there is something to sample
};

// Positions are the world's minus shading.origin (origin.h); those of the description's camera and
// instances are the world's.
struct Scene {
    SceneDescription description;     // mended; programs, pixels and bytes of images are moved out
    std::vector<Instance> instances;  // those that can be shown, in the description's order
    std::vector<InstanceSurface> surfaces;  // of each instance
    std::vector<Bounds3> mesh_bounds;       // object space
    std::vector<std::uint32_t> pass_index;  // of each instance; empty: not asked for
    std::vector<std::uint32_t> described;   // place in the description of each; likewise
    std::vector<Material> materials;        // one per description.materials, then the grey default
    std::vector<Material> displacements;    // of each material; without operations: none
    std::vector<Texture> textures;
    Material world;
    std::vector<Material> lamp_materials;  // one per description.light_programs
    Rgb constant_world{0.0f};
    std::unique_ptr<EnvironmentLight> environment;
    std::unique_ptr<LightSampler> lights;
    std::unique_ptr<Accelerator> accelerator;
    Bounds3 bounds;  // of everything there is to hit; the unit cube for nothing
    SceneNeeds needs;
    ShadingContext shading;  // spans into this scene

    // The description's camera in the scene's own coordinates.
    [[nodiscard]] CameraDescription camera() const;

    // Hit to interaction: position with its error bound, normals on wo's side, material.
    [[nodiscard]] SurfaceInteraction interaction(const Ray& ray, const Hit& hit) const {
        return surface_interaction(surfaces[hit.instance], ray, hit);
    }

    [[nodiscard]] std::uint64_t bytes() const;  // held in memory, about
};

// Validates, reports and mends the description and builds everything a render needs. Polls `cancel`
// and throws Cancelled.
[[nodiscard]] std::unique_ptr<const Scene> build_scene(SceneDescription description,
                                                       const CancelFlag& cancel,
                                                       SceneReport& report);

}  // namespace pharos
