// Scene descriptions for tests, put together by hand: meshes, node programs, lamps, a whole scene.
//
//   SceneBuilder b;
//   const auto white = b.material("white", diffuse_program(Rgb(0.8f)));
//   b.object(quad_mesh("floor", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)), white);
//   b.lamp(point_lamp(Vec3(0, 0, 2), Rgb(100)));
//   b.world(background_program(Rgb(1), 0.5f));
//   b.camera(Vec3(0, -4, 2), Vec3(0), 0.7f, 64, 48);
//   SceneDescription description = b.build();
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "scene/scene_description.h"

namespace pharos::testing {

// --- meshes -------------------------------------------------------------------------------------

inline void append_quad(Mesh& mesh, const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& p : {corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v}) {
        mesh.positions.push_back(p);
    }
    mesh.triangles.emplace_back(base, base + 1, base + 2);
    mesh.triangles.emplace_back(base, base + 2, base + 3);
    if (mesh.uv_maps.empty()) {
        mesh.uv_maps.push_back({"UVMap", {}});
    }
    for (const Vec2& uv :
         {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 0), Vec2(1, 1), Vec2(0, 1)}) {
        mesh.uv_maps.front().uv.push_back(uv);
    }
}

// Its normal is cross(edge_u, edge_v); uv runs 0 ... 1 along the edges.
[[nodiscard]] inline Mesh quad_mesh(std::string name,
                                    const Vec3& corner,
                                    const Vec3& edge_u,
                                    const Vec3& edge_v) {
    Mesh mesh;
    mesh.name = std::move(name);
    append_quad(mesh, corner, edge_u, edge_v);
    return mesh;
}

// A closed box whose six sides have vertices of their own; normals point outwards, or inwards.
[[nodiscard]] inline Mesh box_mesh(std::string name,
                                   const Vec3& lower,
                                   const Vec3& upper,
                                   bool inwards = false) {
    Mesh mesh;
    mesh.name = std::move(name);
    const Vec3 e = upper - lower;
    const Vec3 x(e.x, 0, 0);
    const Vec3 y(0, e.y, 0);
    const Vec3 z(0, 0, e.z);
    const auto side = [&](const Vec3& corner, const Vec3& u, const Vec3& v) {
        inwards ? append_quad(mesh, corner, v, u) : append_quad(mesh, corner, u, v);
    };
    side(lower, y, x);
    side(lower + z, x, y);
    side(lower, x, z);
    side(lower + y, z, x);
    side(lower, z, y);
    side(lower + x, y, z);
    return mesh;
}

// A closed sphere of shared vertices (rings from pole to pole, segments around).
[[nodiscard]] inline Mesh sphere_mesh(std::string name,
                                      const Vec3& center,
                                      float radius,
                                      std::uint32_t rings = 16,
                                      std::uint32_t segments = 32,
                                      bool smooth = true) {
    Mesh mesh;
    mesh.name = std::move(name);
    std::vector<Vec3> normals;
    normals.emplace_back(0, 0, 1);
    for (std::uint32_t ring = 1; ring < rings; ++ring) {
        const float theta = kPi * static_cast<float>(ring) / static_cast<float>(rings);
        for (std::uint32_t s = 0; s < segments; ++s) {
            const float phi = 2.0f * kPi * static_cast<float>(s) / static_cast<float>(segments);
            normals.emplace_back(
                std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        }
    }
    normals.emplace_back(0, 0, -1);
    for (const Vec3& n : normals) {
        mesh.positions.push_back(center + radius * n);
    }
    const auto last = static_cast<std::uint32_t>(normals.size()) - 1;
    for (std::uint32_t s = 0; s < segments; ++s) {
        const std::uint32_t next = (s + 1) % segments;
        mesh.triangles.emplace_back(0, 1 + s, 1 + next);
        for (std::uint32_t ring = 0; ring + 2 < rings; ++ring) {
            const std::uint32_t upper = 1 + ring * segments;
            const std::uint32_t lower = upper + segments;
            mesh.triangles.emplace_back(upper + s, lower + s, lower + next);
            mesh.triangles.emplace_back(upper + s, lower + next, upper + next);
        }
        const std::uint32_t bottom = last - segments;
        mesh.triangles.emplace_back(bottom + s, last, bottom + next);
    }
    if (smooth) {
        mesh.normal_domain = NormalDomain::Vertex;
        mesh.normals = std::move(normals);
    }
    return mesh;
}

// --- node programs ------------------------------------------------------------------------------

// Puts a program together operation by operation. Operands come from scalar(), color() or the
// registers an earlier value operation returned.
class ProgramBuilder {
  public:
    [[nodiscard]] std::int32_t scalar(float x) {
        program_.constants.push_back(x);
        return ~static_cast<std::int32_t>(program_.constants.size() - 1);
    }

    [[nodiscard]] std::int32_t color(const Vec3& c) {
        const std::int32_t operand = scalar(c.x);
        program_.constants.push_back(c.y);
        program_.constants.push_back(c.z);
        return operand;
    }

    // A value operation writing `registers` floats; returns the first.
    std::int32_t value(NodeOpCode code,
                       std::uint16_t mode,
                       std::uint32_t registers,
                       std::initializer_list<std::int32_t> operands) {
        const auto output = static_cast<std::int32_t>(program_.register_count);
        program_.register_count += registers;
        append(code, mode, output, operands);
        return output;
    }

    void closure(NodeOpCode code,
                 std::uint16_t mode,
                 std::initializer_list<std::int32_t> operands) {
        append(code, mode, -1, operands);
    }

    // Index of a new image use, the mode of Image and EnvironmentImage operations.
    [[nodiscard]] std::uint16_t image(const ImageUse& use) {
        program_.images.push_back(use);
        return static_cast<std::uint16_t>(program_.images.size() - 1);
    }

    [[nodiscard]] NodeProgram build() { return std::move(program_); }

  private:
    void append(NodeOpCode code,
                std::uint16_t mode,
                std::int32_t output,
                std::initializer_list<std::int32_t> operands) {
        const auto first = static_cast<std::uint32_t>(program_.operands.size());
        program_.operands.insert(program_.operands.end(), operands);
        program_.ops.push_back(
            {code, mode, output, first, static_cast<std::uint32_t>(operands.size())});
    }

    NodeProgram program_;
};

[[nodiscard]] inline NodeProgram diffuse_program(const Rgb& color, float roughness = 0.0f) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Diffuse,
              0,
              {b.color(Vec3(1)), b.color(color), b.scalar(roughness), kDefaultOperand});
    return b.build();
}

[[nodiscard]] inline NodeProgram glossy_program(const Rgb& color,
                                                float roughness,
                                                Distribution distribution = Distribution::Ggx) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Glossy,
              static_cast<std::uint16_t>(distribution),
              {b.color(Vec3(1)), b.color(color), b.scalar(roughness), kDefaultOperand});
    return b.build();
}

[[nodiscard]] inline NodeProgram glass_program(const Rgb& color,
                                               float roughness,
                                               float ior,
                                               Distribution distribution = Distribution::Ggx) {
    ProgramBuilder b;
    b.closure(
        NodeOpCode::Glass,
        static_cast<std::uint16_t>(distribution),
        {b.color(Vec3(1)), b.color(color), b.scalar(roughness), b.scalar(ior), kDefaultOperand});
    return b.build();
}

[[nodiscard]] inline NodeProgram transparent_program(const Rgb& color) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Transparent, 0, {b.color(Vec3(1)), b.color(color)});
    return b.build();
}

[[nodiscard]] inline NodeProgram emission_program(const Rgb& color, float strength) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Emission, 0, {b.color(Vec3(1)), b.color(color), b.scalar(strength)});
    return b.build();
}

// A surface that reflects and emits.
[[nodiscard]] inline NodeProgram diffuse_emission_program(const Rgb& albedo, const Rgb& emitted) {
    ProgramBuilder b;
    const std::int32_t one = b.color(Vec3(1));
    b.closure(NodeOpCode::Diffuse, 0, {one, b.color(albedo), b.scalar(0.0f), kDefaultOperand});
    b.closure(NodeOpCode::Emission, 0, {one, b.color(emitted), b.scalar(1.0f)});
    return b.build();
}

// A sheet that lets a third of what it scatters through, mirrors a third, and emits.
[[nodiscard]] inline NodeProgram sheet_emission_program(const Rgb& albedo, const Rgb& emitted) {
    ProgramBuilder b;
    const std::int32_t one = b.color(Vec3(1));
    const std::int32_t third = b.color(albedo / 3.0f);
    b.closure(NodeOpCode::Translucent, 0, {one, third, kDefaultOperand});
    b.closure(NodeOpCode::Diffuse, 0, {one, third, b.scalar(0.0f), kDefaultOperand});
    b.closure(NodeOpCode::Glossy,
              static_cast<std::uint16_t>(Distribution::Ggx),
              {one, third, b.scalar(0.0f), kDefaultOperand});
    b.closure(NodeOpCode::Emission, 0, {one, b.color(emitted), b.scalar(1.0f)});
    return b.build();
}

[[nodiscard]] inline NodeProgram background_program(const Rgb& color, float strength) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Background, 0, {b.color(Vec3(1)), b.color(color), b.scalar(strength)});
    return b.build();
}

// A world shown by an equirectangular image along the ray's direction.
[[nodiscard]] inline NodeProgram environment_image_program(std::uint32_t image, float strength) {
    ProgramBuilder b;
    ImageUse use;
    use.image = image;
    use.projection = ImageProjection::Equirectangular;
    const std::int32_t rgb =
        b.value(NodeOpCode::EnvironmentImage, b.image(use), 4, {kDefaultOperand});
    b.closure(NodeOpCode::Background, 0, {b.color(Vec3(1)), rgb, b.scalar(strength)});
    return b.build();
}

// Diffuse with the colour of an image through the mesh's first UV map.
[[nodiscard]] inline NodeProgram image_diffuse_program(const ImageUse& use) {
    ProgramBuilder b;
    const std::int32_t uv = b.value(NodeOpCode::Uv, 0xffff, 3, {});
    const std::int32_t rgb = b.value(NodeOpCode::Image, b.image(use), 4, {uv});
    b.closure(NodeOpCode::Diffuse, 0, {b.color(Vec3(1)), rgb, b.scalar(0.0f), kDefaultOperand});
    return b.build();
}

// The inputs of a Principled node that tests vary; all others at the node's defaults.
struct PrincipledInputs {
    Rgb base_color{0.8f};
    float metallic = 0.0f;
    float roughness = 0.5f;
    float specular = 0.5f;
    float transmission = 0.0f;
    float ior = 1.45f;
    float clearcoat = 0.0f;
    float sheen = 0.0f;
    Rgb emission{1.0f};
    float emission_strength = 0.0f;
};

[[nodiscard]] inline NodeProgram principled_v1_program(
    const PrincipledInputs& in, Distribution distribution = Distribution::Ggx) {
    ProgramBuilder b;
    const std::int32_t zero = b.scalar(0.0f);
    const std::int32_t one = b.color(Vec3(1));
    b.closure(NodeOpCode::PrincipledV1,
              static_cast<std::uint16_t>(distribution),
              {one,
               b.color(in.base_color),
               zero,
               b.color(in.base_color),
               b.scalar(in.metallic),
               b.scalar(in.specular),
               zero,
               b.scalar(in.roughness),
               zero,
               zero,
               b.scalar(in.sheen),
               b.scalar(0.5f),
               b.scalar(in.clearcoat),
               b.scalar(0.03f),
               b.scalar(in.ior),
               b.scalar(in.transmission),
               zero,
               kDefaultOperand,
               kDefaultOperand,
               kDefaultOperand});
    if (in.emission_strength > 0.0f) {
        b.closure(
            NodeOpCode::Emission, 0, {one, b.color(in.emission), b.scalar(in.emission_strength)});
    }
    return b.build();
}

[[nodiscard]] inline NodeProgram principled_v2_program(
    const PrincipledInputs& in, Distribution distribution = Distribution::MultiGgx) {
    ProgramBuilder b;
    const std::int32_t zero = b.scalar(0.0f);
    const std::int32_t one = b.color(Vec3(1));
    b.closure(NodeOpCode::PrincipledV2,
              static_cast<std::uint16_t>(distribution),
              {one,
               b.color(in.base_color),
               b.scalar(in.metallic),
               b.scalar(in.roughness),
               b.scalar(in.ior),
               zero,
               zero,
               b.scalar(in.specular),
               one,
               zero,
               zero,
               b.scalar(in.transmission),
               b.scalar(in.clearcoat),
               b.scalar(0.03f),
               b.scalar(1.5f),
               one,
               b.scalar(in.sheen),
               b.scalar(0.5f),
               one,
               b.color(in.emission),
               b.scalar(in.emission_strength),
               zero,
               b.scalar(1.33f),
               b.scalar(1.0f),
               kDefaultOperand,
               kDefaultOperand,
               kDefaultOperand});
    return b.build();
}

// --- lamps --------------------------------------------------------------------------------------

// Object to world with local -Z towards `target` (cameras and lamps).
[[nodiscard]] inline Mat4 look_at(const Vec3& eye, const Vec3& target) {
    const Vec3 forward = glm::normalize(target - eye);
    const Vec3 up = std::abs(forward.z) > 0.999f ? Vec3(0, 1, 0) : Vec3(0, 0, 1);
    return glm::inverse(glm::lookAt(eye, target, up));
}

[[nodiscard]] inline LightDescription point_lamp(const Vec3& p,
                                                 const Rgb& strength,
                                                 float radius = 0.0f) {
    LightDescription lamp;
    lamp.name = "point";
    lamp.type = LightType::Point;
    lamp.to_world = glm::translate(Mat4(1.0f), p);
    lamp.strength = strength;
    lamp.radius = radius;
    return lamp;
}

[[nodiscard]] inline LightDescription spot_lamp(
    const Mat4& to_world, const Rgb& strength, float angle, float blend, float radius = 0.0f) {
    LightDescription lamp;
    lamp.name = "spot";
    lamp.type = LightType::Spot;
    lamp.to_world = to_world;
    lamp.strength = strength;
    lamp.spot_angle = angle;
    lamp.spot_blend = blend;
    lamp.radius = radius;
    return lamp;
}

[[nodiscard]] inline LightDescription area_lamp(const Mat4& to_world,
                                                const Rgb& strength,
                                                float size_u,
                                                float size_v,
                                                AreaShape shape = AreaShape::Rectangle) {
    LightDescription lamp;
    lamp.name = "area";
    lamp.type = LightType::Area;
    lamp.to_world = to_world;
    lamp.strength = strength;
    lamp.size_u = size_u;
    lamp.size_v = size_v;
    lamp.shape = shape;
    return lamp;
}

[[nodiscard]] inline LightDescription sun_lamp(const Mat4& to_world,
                                               const Rgb& strength,
                                               float angle) {
    LightDescription lamp;
    lamp.name = "sun";
    lamp.type = LightType::Sun;
    lamp.to_world = to_world;
    lamp.strength = strength;
    lamp.angle = angle;
    return lamp;
}

// --- scenes -------------------------------------------------------------------------------------

class SceneBuilder {
  public:
    std::uint32_t material(std::string name, NodeProgram program, bool emission_sampling = true) {
        d_.materials.push_back({std::move(name), std::move(program), emission_sampling, {}});
        return static_cast<std::uint32_t>(d_.materials.size() - 1);
    }

    std::uint32_t mesh(Mesh mesh) {
        d_.meshes.push_back(std::move(mesh));
        return static_cast<std::uint32_t>(d_.meshes.size() - 1);
    }

    std::uint32_t image(ImageDescription image) {
        d_.images.push_back(std::move(image));
        return static_cast<std::uint32_t>(d_.images.size() - 1);
    }

    // An instance of a mesh with the materials of its slots; returns the instance's index.
    std::uint32_t instance(std::uint32_t mesh,
                           std::vector<std::uint32_t> materials,
                           const Mat4& to_world = Mat4(1.0f),
                           std::uint32_t visibility = kVisibleAll) {
        d_.material_sets.push_back(std::move(materials));
        InstanceDescription description;
        description.name = mesh < d_.meshes.size() ? d_.meshes[mesh].name : "broken";
        description.mesh = mesh;
        description.material_set = static_cast<std::uint32_t>(d_.material_sets.size() - 1);
        description.to_world = to_world;
        description.visibility = visibility;
        d_.instances.push_back(std::move(description));
        return static_cast<std::uint32_t>(d_.instances.size() - 1);
    }

    // A mesh of its own with one material.
    std::uint32_t object(Mesh geometry, std::uint32_t material, const Mat4& to_world = Mat4(1.0f)) {
        const std::uint32_t index = mesh(std::move(geometry));
        return instance(index, {material}, to_world);
    }

    void lamp(LightDescription lamp) { d_.lights.push_back(std::move(lamp)); }

    void world(NodeProgram program) { d_.world.program = std::move(program); }

    // Perspective camera; `fov` is the full horizontal angle.
    void camera(
        const Vec3& eye, const Vec3& target, float fov, std::uint32_t width, std::uint32_t height) {
        d_.has_camera = true;
        d_.camera.to_world = look_at(eye, target);
        const float x = std::tan(0.5f * fov);
        const float y = x * static_cast<float>(height) / static_cast<float>(width);
        d_.camera.window_lower = Vec2(-x, -y);
        d_.camera.window_upper = Vec2(x, y);
        d_.camera.near_clip = 0.01f;
        d_.film.width = d_.film.crop_width = width;
        d_.film.height = d_.film.crop_height = height;
    }

    [[nodiscard]] RenderSettings& settings() { return d_.settings; }

    [[nodiscard]] SceneDescription& description() { return d_; }

    [[nodiscard]] SceneDescription build() { return std::move(d_); }

  private:
    SceneDescription d_;
};

}  // namespace pharos::testing
