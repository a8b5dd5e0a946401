#include <algorithm>
#include <utility>

#include "core/fp_state.h"
#include "core/memory.h"
#include "core/parallel.h"
#include "film/passes.h"
#include "image/image_io.h"
#include "scene/displace.h"
#include "scene/mend.h"
#include "scene/origin.h"
#include "scene/scene.h"
#include "scene/scene_build.h"
#include "scene/scene_lights.h"
#include "scene/scene_pieces.h"
#include "scene/view.h"
#include "scene/world.h"

namespace pharos {

namespace {

constexpr std::size_t kCancelPollInterval = 1u << 14;

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
    SceneBuild(SceneDescription description,
               const CancelFlag& cancel,
               SceneReport& report,
               ScenePieces* pieces)
        : scene_(std::make_unique<Scene>()), cancel_(cancel), report_(report), pieces_(pieces) {
        scene_->description = std::move(description);
    }

    [[nodiscard]] std::unique_ptr<Scene> run() {
        auto key = pieces_ != nullptr ? world_key(scene_->description) : std::nullopt;
        mend_meshes();
        mend();
        poll();
        load_textures();
        poll();
        compile_materials();
        make_shading_context();
        if (displace_meshes(*scene_, cancel_)) {
            make_shading_context();
            scene_->surfaces = make_instance_surfaces(
                scene_->description.meshes, scene_->instances, pieces_ != nullptr);
        }
        poll();
        scene_->accelerator =
            std::make_unique<Accelerator>(scene_->description.meshes,
                                          scene_->instances,
                                          cancel_,
                                          pieces_ != nullptr ? &pieces_->trees() : nullptr,
                                          available_memory());
        scene_->bounds = scene_->accelerator->bounds();
        if (scene_->bounds.empty()) {
            scene_->bounds.extend(Vec3(-1.0f));
            scene_->bounds.extend(Vec3(1.0f));
        }
        poll();
        prepare_world(*scene_,
                      pool_,
                      cancel_,
                      pieces_ != nullptr ? pieces_->give_environment(std::move(key)) : nullptr);
        poll();
        prepare_lights(*scene_, cancel_);
        poll();
        find_needs();
        return std::move(scene_);
    }

  private:
    void poll() const { throw_if_cancelled(cancel_); }

    void mend_meshes();
    void mend();
    [[nodiscard]] std::vector<bool> images_to_load();
    void load_textures();
    void compile_materials();
    void make_shading_context();
    void find_needs();

    std::unique_ptr<Scene> scene_;
    const CancelFlag& cancel_;
    SceneReport& report_;
    ScenePieces* pieces_;
    ThreadPool pool_;
};

void SceneBuild::mend_meshes() {
    std::vector<Mesh>& meshes = scene_->description.meshes;
    scene_->mesh_bounds.resize(meshes.size());
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        poll();
        if (pieces_ != nullptr && pieces_->give_mesh(*scene_, i, report_)) {
            continue;
        }
        SceneReport own;
        mend_mesh(meshes[i], cancel_, own);
        report_.add(own);
        if (pieces_ != nullptr) {
            pieces_->remember_mesh(meshes[i], own);
        }
        for (const Vec3& p : meshes[i].positions) {
            scene_->mesh_bounds[i].extend(p);
        }
    }
}

void SceneBuild::mend() {
    SceneDescription& d = scene_->description;
    const auto default_material = static_cast<std::uint32_t>(d.materials.size());
    for (InstanceAttribute& attribute : d.instance_attributes) {
        attribute.values.resize(d.instances.size(), Vec4(0.0f));
    }
    const bool wants_index = (d.passes.wanted & pass_bit(FilmPass::ObjectIndex)) != 0;
    const bool wants_place = (d.passes.wanted & pass_bit(FilmPass::Effort)) != 0;
    for (std::size_t i = 0; i < d.instances.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            poll();
        }
        auto mended = mend_instance(d, d.instances[i], default_material, report_);
        if (mended && !d.meshes[mended->mesh].triangles.empty()) {
            scene_->instances.push_back(std::move(*mended));
            if (wants_index) {
                const auto& indices = d.passes.object_indices;
                scene_->pass_index.push_back(i < indices.size() ? indices[i] : 0);
            }
            if (wants_place) {
                scene_->described.push_back(static_cast<std::uint32_t>(i));
            }
            // Values of attributes move up with their instances.
            const std::size_t place = scene_->instances.size() - 1;
            for (InstanceAttribute& attribute : d.instance_attributes) {
                attribute.values[place] = attribute.values[i];
            }
        }
    }
    poll();
    mend_lamps(d.lights, report_);
    mend_camera(d, report_);
    mend_film(d.film, report_);
    if (const Vec3 origin = find_origin(*scene_); origin != Vec3(0.0f)) {
        move_to_origin(*scene_, origin);
    }
    scene_->surfaces = make_instance_surfaces(d.meshes, scene_->instances, pieces_ != nullptr);
}

// Only images that some program reads take time and memory.
std::vector<bool> SceneBuild::images_to_load() {
    SceneDescription& d = scene_->description;
    std::vector<bool> wanted(d.images.size());
    const auto mark = [&](const NodeProgram& program) {
        const auto mark_one = [&](std::uint32_t image) {
            if (image < wanted.size()) {
                wanted[image] = true;
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
    for (std::size_t i = 0; i < d.images.size(); ++i) {
        const bool known = pieces_ != nullptr && pieces_->give_image(*scene_, i, report_);
        wanted[i] = wanted[i] && !known;
    }
    return wanted;
}

void SceneBuild::load_textures() {
    SceneDescription& d = scene_->description;
    scene_->textures.resize(d.images.size());
    const std::vector<bool> wanted = images_to_load();
    std::vector<SceneReport> reports(d.images.size());
    pool_.parallel_for(d.images.size(), [&](std::size_t i, unsigned /*worker*/) {
        poll();
        ImageDescription& image = d.images[i];
        if (wanted[i]) {
            scene_->textures[i] = load_texture(image, reports[i], &cancel_);
        }
        // What may be asked for by a later scene keeps its content until it is loaded.
        if (pieces_ == nullptr || image.version == 0 || !scene_->textures[i].missing()) {
            image.pixels = {};
            image.bytes = {};
        }
    });
    for (std::size_t i = 0; i < reports.size(); ++i) {
        report_.add(reports[i]);
        if (pieces_ != nullptr && wanted[i]) {
            pieces_->remember_image(d.images[i], reports[i]);
        }
    }
}

void SceneBuild::compile_materials() {
    const SceneDescription& d = scene_->description;
    scene_->materials.reserve(d.materials.size() + 1);
    for (const MaterialDescription& material : d.materials) {
        poll();
        scene_->materials.push_back(
            compile_material(material.name, material.program, report_, scene_->textures));
        scene_->materials.back().emission_sampling = material.emission_sampling;
        scene_->displacements.emplace_back();
        if (!material.displacement.ops.empty()) {
            scene_->displacements.back() =
                compile_material(material.name, material.displacement, report_, scene_->textures);
        }
    }
    scene_->displacements.emplace_back();
    scene_->materials.push_back(compile_material("Default", default_program(), report_));
    scene_->world = compile_material("World", d.world.program, report_, scene_->textures);
    for (const NodeProgram& program : d.light_programs) {
        scene_->lamp_materials.push_back(
            compile_material("Light", program, report_, scene_->textures));
    }
}

void SceneBuild::make_shading_context() {
    const SceneDescription& d = scene_->description;
    ShadingContext& context = scene_->shading;
    context.meshes = d.meshes;
    context.instances = scene_->instances;
    context.textures = scene_->textures;
    context.mesh_bounds = scene_->mesh_bounds;
    context.instance_attributes = d.instance_attributes;
    context.blender_version = d.blender_version;
    prepare_view(*scene_);
}

void SceneBuild::find_needs() {
    std::vector<bool> used(scene_->materials.size());
    for (const Instance& instance : scene_->instances) {
        for (const std::uint32_t material : instance.materials) {
            used[material] = true;
        }
    }
    SceneNeeds& needs = scene_->needs;
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

std::unique_ptr<Scene> build_scene(SceneDescription description,
                                   const CancelFlag& cancel,
                                   SceneReport& report,
                                   ScenePieces* pieces) {
    const FloatStateGuard float_state;
    if (cancel.cancelled()) {
        throw Cancelled();
    }
    return SceneBuild(std::move(description), cancel, report, pieces).run();
}

std::unique_ptr<const Scene> build_scene(SceneDescription description,
                                         const CancelFlag& cancel,
                                         SceneReport& report) {
    return build_scene(std::move(description), cancel, report, nullptr);
}

}  // namespace pharos
