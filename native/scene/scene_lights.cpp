#include "scene/scene_lights.h"

#include <algorithm>
#include <vector>

#include "core/color.h"

namespace pharos {

namespace {

constexpr std::size_t kCancelPollInterval = 1u << 16;

// The triangles of one instance that next-event estimation aims at.
void collect_emitters(const Scene& scene,
                      std::uint32_t instance,
                      const CancelFlag& cancel,
                      std::vector<EmissiveTriangle>& emitters) {
    const Instance& object = scene.instances[instance];
    const Mesh& mesh = scene.description.meshes[object.mesh];
    const auto is_sampled = [&](std::uint32_t index) {
        const Material& material = scene.materials[index];
        return material.emits && material.emission_sampling;
    };
    if (std::ranges::none_of(object.materials, is_sampled)) {
        return;
    }
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        const std::size_t slot = mesh.material_indices.empty() ? 0 : mesh.material_indices[i];
        const std::uint32_t material =
            object.materials[std::min(slot, object.materials.size() - 1)];
        if (!is_sampled(material)) {
            continue;
        }
        const UVec3& t = mesh.triangles[i];
        const Mat3 linear(object.to_world);
        const Vec3 e1 = linear * (mesh.positions[t.y] - mesh.positions[t.x]);
        const Vec3 e2 = linear * (mesh.positions[t.z] - mesh.positions[t.x]);
        const float doubled_area = glm::length(glm::cross(e1, e2));
        if (doubled_area > 0.0f && doubled_area < kInfinity) {
            emitters.push_back({instance, i, scene.materials[material].emission_estimate});
        }
    }
}

}  // namespace

void prepare_lights(Scene& scene, const CancelFlag& cancel) {
    std::vector<EmissiveTriangle> emitters;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        collect_emitters(scene, i, cancel, emitters);
    }
    scene.needs.emissive_triangles = !emitters.empty();
    std::vector<float> scales;
    for (LightDescription& lamp : scene.description.lights) {
        const bool has_program = lamp.program < scene.lamp_materials.size();
        lamp.program = has_program ? lamp.program : kNone;
        scales.push_back(
            has_program ? average(glm::abs(scene.lamp_materials[lamp.program].emission_estimate))
                        : 1.0f);
    }
    LightSamplerInput input;
    input.lamps = scene.description.lights;
    input.lamp_scales = scales;
    input.blender_version = scene.description.blender_version;
    input.triangles = emitters;
    input.meshes = scene.description.meshes;
    input.instances = scene.instances;
    input.environment = scene.environment.get();
    input.cancel = &cancel;
    scene.lights = std::make_unique<LightSampler>(input);
    scene.needs.lamps_hittable = scene.lights->has_hittable_lamps();
    scene.needs.nee = !scene.lights->empty();
}

}  // namespace pharos
