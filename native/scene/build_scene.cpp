#include <algorithm>
#include <utility>

#include "camera/camera.h"
#include "core/color.h"
#include "core/fp_state.h"
#include "core/parallel.h"
#include "film/passes.h"
#include "image/image_io.h"
#include "scene/displace.h"
#include "scene/mend.h"
#include "scene/scene.h"
#include "scene/world.h"

namespace pharos {

namespace {

constexpr std::size_t kCancelPollInterval = 1u << 16;

// Grey diffuse, for faces without a material.
NodeProgram default_program() {
    NodeProgram program;
    program.constants = {1.0f, 1.0f, 1.0f, 0.8f, 0.8f, 0.8f, 0.0f};
    program.operands = {~0, ~3, ~6, kDefaultOperand};
    NodeOp op;
    op.code = NodeOpCode::Diffuse;
    op.operand_count = 4;
    program.ops.assign(1, op);
    return program;
}

class SceneBuild {
  public:
    SceneBuild(SceneDescription description, const CancelFlag& cancel, SceneReport& report)
        : scene_(std::make_unique<Scene>()), cancel_(cancel), report_(report) {
        scene_->description = std::move(description);
    }

    [[nodiscard]] std::unique_ptr<const Scene> run() {
        mend();
        poll();
        load_textures();
        poll();
        compile_materials();
        make_shading_context();
        if (displace_meshes(*scene_, cancel_)) {
            make_shading_context();
            scene_->surfaces =
                make_instance_surfaces(scene_->description.meshes, scene_->instances);
        }
        poll();
        scene_->accelerator =
            std::make_unique<Accelerator>(scene_->description.meshes, scene_->instances, cancel_);
        scene_->bounds = scene_->accelerator->bounds();
        if (scene_->bounds.empty()) {
            scene_->bounds.extend(Vec3(-1.0f));
            scene_->bounds.extend(Vec3(1.0f));
        }
        poll();
        prepare_world(*scene_, pool_, cancel_);
        poll();
        make_lights();
        poll();
        find_needs();
        return std::move(scene_);
    }

  private:
    void poll() const {
        if (cancel_.cancelled()) {
            throw Cancelled();
        }
    }

    void mend();
    void load_textures();
    void compile_materials();
    void make_shading_context();
    void make_lights();
    void find_needs();
    void collect_emitters(std::uint32_t instance, std::vector<EmissiveTriangle>& emitters) const;

    std::unique_ptr<Scene> scene_;
    const CancelFlag& cancel_;
    SceneReport& report_;
    ThreadPool pool_;
};

void SceneBuild::mend() {
    SceneDescription& d = scene_->description;
    for (Mesh& mesh : d.meshes) {
        mend_mesh(mesh, cancel_, report_);
    }
    const auto default_material = static_cast<std::uint32_t>(d.materials.size());
    const bool wants_index = (d.passes.wanted & pass_bit(FilmPass::ObjectIndex)) != 0;
    for (std::size_t i = 0; i < d.instances.size(); ++i) {
        auto mended = mend_instance(d, d.instances[i], default_material, report_);
        if (mended && !d.meshes[mended->mesh].triangles.empty()) {
            scene_->instances.push_back(std::move(*mended));
            if (wants_index) {
                const auto& indices = d.passes.object_indices;
                scene_->pass_index.push_back(i < indices.size() ? indices[i] : 0);
            }
            // Values of attributes move up with their instances.
            const std::size_t place = scene_->instances.size() - 1;
            for (InstanceAttribute& attribute : d.instance_attributes) {
                attribute.values.resize(d.instances.size(), Vec4(0.0f));
                attribute.values[place] = attribute.values[i];
            }
        }
    }
    scene_->surfaces = make_instance_surfaces(d.meshes, scene_->instances);
    mend_lamps(d.lights, report_);
    if (d.has_camera && !is_usable(d.camera)) {
        report_.add(Severity::Error, "Camera", "The camera's matrix or window is no number.");
        d.has_camera = false;
    }
}

// Only images that some program reads take time and memory.
void SceneBuild::load_textures() {
    SceneDescription& d = scene_->description;
    std::vector<bool> used(d.images.size());
    const auto mark = [&](const NodeProgram& program) {
        const auto mark_one = [&](std::uint32_t image) {
            if (image < used.size()) {
                used[image] = true;
            }
        };
        for (const ImageUse& use : program.images) {
            mark_one(use.image);
            for (const ImageTile& tile : use.tiles) {
                mark_one(tile.image);
            }
        }
    };
    for (const MaterialDescription& material : d.materials) {
        mark(material.program);
        mark(material.displacement);
    }
    mark(d.world.program);
    for (const NodeProgram& program : d.light_programs) {
        mark(program);
    }
    scene_->textures.resize(d.images.size());
    std::vector<SceneReport> reports(d.images.size());
    pool_.parallel_for(d.images.size(), [&](std::size_t i, unsigned /*worker*/) {
        poll();
        if (used[i]) {
            scene_->textures[i] = load_texture(d.images[i], reports[i], &cancel_);
        }
        d.images[i].pixels = {};
        d.images[i].bytes = {};
    });
    for (const SceneReport& report : reports) {
        for (const ReportEntry& entry : report.entries()) {
            report_.add(entry);
        }
    }
}

void SceneBuild::compile_materials() {
    SceneDescription& d = scene_->description;
    scene_->materials.reserve(d.materials.size() + 1);
    for (MaterialDescription& material : d.materials) {
        scene_->materials.push_back(compile_material(
            material.name, std::move(material.program), report_, scene_->textures));
        scene_->materials.back().emission_sampling = material.emission_sampling;
        scene_->displacements.emplace_back();
        if (!material.displacement.ops.empty()) {
            scene_->displacements.back() = compile_material(
                material.name, std::move(material.displacement), report_, scene_->textures);
        }
    }
    scene_->displacements.emplace_back();
    scene_->materials.push_back(compile_material("Default", default_program(), report_));
    scene_->world =
        compile_material("World", std::move(d.world.program), report_, scene_->textures);
    for (NodeProgram& program : d.light_programs) {
        scene_->lamp_materials.push_back(
            compile_material("Light", std::move(program), report_, scene_->textures));
    }
}

void SceneBuild::make_shading_context() {
    const SceneDescription& d = scene_->description;
    scene_->mesh_bounds.clear();
    for (const Mesh& mesh : d.meshes) {
        poll();
        Bounds3 bounds;
        for (const Vec3& p : mesh.positions) {
            bounds.extend(p);
        }
        scene_->mesh_bounds.push_back(bounds);
    }
    ShadingContext& context = scene_->shading;
    context.meshes = d.meshes;
    context.instances = scene_->instances;
    context.textures = scene_->textures;
    context.mesh_bounds = scene_->mesh_bounds;
    context.instance_attributes = d.instance_attributes;
    context.blender_version = d.blender_version;
    if (!d.has_camera) {
        return;
    }
    context.world_to_camera = Camera(d.camera, d.film.width, d.film.height).world_to_camera();
    context.perspective = d.camera.type == CameraType::Perspective;
    context.pixel =
        (d.camera.window_upper - d.camera.window_lower) /
        glm::max(Vec2(static_cast<float>(d.film.width), static_cast<float>(d.film.height)),
                 Vec2(1.0f));
    // The window (distance 1 of a perspective camera) onto [0, 1] x [0, 1].
    const Vec2 lower = d.camera.window_lower;
    const Vec2 scale = 1.0f / (d.camera.window_upper - lower);
    Mat4 m(1.0f);
    m[0][0] = scale.x;
    m[1][1] = scale.y;
    const int shift = d.camera.type == CameraType::Perspective ? 2 : 3;
    const float sign = d.camera.type == CameraType::Perspective ? 1.0f : -1.0f;
    m[shift][0] = sign * lower.x * scale.x;
    m[shift][1] = sign * lower.y * scale.y;
    if (d.camera.type == CameraType::Perspective) {
        m[2][3] = -1.0f;  // w = depth
        m[3][3] = 0.0f;
    }
    context.camera_to_window = m;
}

// The triangles of one instance that next-event estimation aims at.
void SceneBuild::collect_emitters(std::uint32_t instance,
                                  std::vector<EmissiveTriangle>& emitters) const {
    const Instance& object = scene_->instances[instance];
    const Mesh& mesh = scene_->description.meshes[object.mesh];
    const auto is_sampled = [&](std::uint32_t index) {
        const Material& material = scene_->materials[index];
        return material.emits && material.emission_sampling;
    };
    if (std::ranges::none_of(object.materials, is_sampled)) {
        return;
    }
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            poll();
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
            emitters.push_back({instance, i, scene_->materials[material].emission_estimate});
        }
    }
}

void SceneBuild::make_lights() {
    std::vector<EmissiveTriangle> emitters;
    for (std::uint32_t i = 0; i < scene_->instances.size(); ++i) {
        collect_emitters(i, emitters);
    }
    scene_->needs.emissive_triangles = !emitters.empty();
    std::vector<float> scales;
    for (LightDescription& lamp : scene_->description.lights) {
        const bool has_program = lamp.program < scene_->lamp_materials.size();
        lamp.program = has_program ? lamp.program : kNone;
        scales.push_back(
            has_program ? average(glm::abs(scene_->lamp_materials[lamp.program].emission_estimate))
                        : 1.0f);
    }
    LightSamplerInput input;
    input.lamps = scene_->description.lights;
    input.lamp_scales = scales;
    input.blender_version = scene_->description.blender_version;
    input.triangles = emitters;
    input.meshes = scene_->description.meshes;
    input.instances = scene_->instances;
    input.environment = scene_->environment.get();
    scene_->lights = std::make_unique<LightSampler>(input);
}

void SceneBuild::find_needs() {
    std::vector<bool> used(scene_->materials.size());
    for (const Instance& instance : scene_->instances) {
        for (const std::uint32_t material : instance.materials) {
            used[material] = true;
        }
    }
    SceneNeeds& needs = scene_->needs;
    needs.lamps_hittable = scene_->lights->has_hittable_lamps();
    needs.nee = !scene_->lights->empty();
    needs.textures = needs.environment && scene_->world.textured;
    needs.light_path = needs.environment && scene_->world.asks_path;
    needs.lamp_programs = !scene_->lamp_materials.empty();
    for (const Material& material : scene_->lamp_materials) {
        needs.textures = needs.textures || material.textured;
        needs.light_path = needs.light_path || material.asks_path;
    }
    needs.all_constant = true;
    for (std::size_t i = 0; i < used.size(); ++i) {
        const Material& material = scene_->materials[i];
        if (used[i]) {
            needs.emission = needs.emission || material.emits;
            needs.transparency = needs.transparency || material.transparent;
            needs.textures = needs.textures || material.textured;
            needs.light_path = needs.light_path || material.asks_path;
            needs.all_constant = needs.all_constant && material.constant;
        }
    }
}

}  // namespace

std::unique_ptr<const Scene> build_scene(SceneDescription description,
                                         const CancelFlag& cancel,
                                         SceneReport& report) {
    const FloatStateGuard float_state;
    if (cancel.cancelled()) {
        throw Cancelled();
    }
    return SceneBuild(std::move(description), cancel, report).run();
}

}  // namespace pharos
