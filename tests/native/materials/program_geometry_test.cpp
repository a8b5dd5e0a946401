// Values that follow from the hit, on one turned and scaled instance.
#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include "program_support.h"

namespace pharos {
namespace {

using test::compile;
using test::emission_of;
using test::ProgramBuilder;

// Two triangles of a 4 x 2 rectangle in its object's xy plane around (1, 0, 0), with two uv maps,
// moved away, turned and stretched.
struct Stage {
    std::vector<Mesh> meshes{1};
    std::vector<Instance> instances{1};
    ShadingContext context;

    Stage() {
        Mesh& mesh = meshes[0];
        mesh.positions = {{-1, -1, 0}, {3, -1, 0}, {3, 1, 0}, {-1, 1, 0}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        mesh.uv_maps = {{"First", {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}},
                        {"Turned", {{0, 0}, {0, 1}, {-1, 1}, {0, 0}, {-1, 1}, {-1, 0}}}};
        Instance& instance = instances[0];
        instance.to_world = glm::translate(Mat4(1.0f), Vec3(5, 6, 7)) *
                            glm::rotate(Mat4(1.0f), 0.7f, glm::normalize(Vec3(1, 2, 3))) *
                            glm::scale(Mat4(1.0f), Vec3(2, 3, 4));
        instance.to_object = glm::inverse(instance.to_world);
        context.meshes = meshes;
        context.instances = instances;
    }

    [[nodiscard]] SurfaceInteraction hit(std::uint32_t triangle,
                                         float u,
                                         float v,
                                         bool front) const {
        const Mesh& mesh = meshes[0];
        const UVec3 corner = mesh.triangles[triangle];
        const Vec3 local = mesh.positions[corner.x] * (1.0f - u - v) +
                           mesh.positions[corner.y] * u + mesh.positions[corner.z] * v;
        SurfaceInteraction hit;
        hit.p = transform_point(instances[0].to_world, local);
        const float side = front ? 1.0f : -1.0f;
        hit.ng = hit.ns =
            glm::normalize(transform_normal(instances[0].to_object, Vec3(0, 0, 1))) * side;
        hit.wo = glm::normalize(hit.ng + 0.3f * Frame::from_z(hit.ng).x);
        hit.u = u;
        hit.v = v;
        hit.triangle = triangle;
        hit.front_face = front;
        hit.t = 2.5f;
        return hit;
    }

    [[nodiscard]] Rgb show(const SurfaceInteraction& hit,
                           NodeOpCode code,
                           std::uint16_t mode,
                           const std::vector<std::vector<float>>& operands = {},
                           std::uint32_t outputs = 3) const {
        ProgramBuilder b;
        b.program.names = {"First", "Turned", "Unknown"};
        std::vector<std::int32_t> codes;
        for (const auto& operand : operands) {
            codes.push_back(operand.empty() ? kDefaultOperand : b.constant(operand));
        }
        const std::int32_t out = b.add(code, mode, codes, outputs);
        if (outputs == 3) {
            b.show(out);
        } else {
            b.show_scalar(out);
        }
        return emission_of(compile(b.program), {&hit, 1}, context)[0];
    }

    // A tangent-space normal map whose tangent follows the uv map "Turned".
    [[nodiscard]] Rgb show_turned_map(const SurfaceInteraction& hit,
                                      const std::vector<float>& color) const {
        ProgramBuilder b;
        b.program.names = {"First", "Turned"};
        const std::int32_t uv = b.add(NodeOpCode::Uv, 1, {}, 3);
        b.show(b.add(NodeOpCode::NormalMap, 0, {b.constant({1}), b.constant(color), uv}, 3));
        const Material material = compile(b.program);
        EXPECT_EQ(material.surface.values.size(), 1u);  // the coordinates themselves are not needed
        return emission_of(material, {&hit, 1}, context)[0];
    }

    template <class Mode>
    [[nodiscard]] Rgb show(const SurfaceInteraction& hit, NodeOpCode code, Mode mode) const {
        return show(hit, code, static_cast<std::uint16_t>(mode));
    }
};

void expect_near(const Vec3& got, const Vec3& want, float tolerance = 1e-5f) {
    EXPECT_NEAR(got.x, want.x, tolerance);
    EXPECT_NEAR(got.y, want.y, tolerance);
    EXPECT_NEAR(got.z, want.z, tolerance);
}

TEST(ProgramGeometry, HitValues) {
    const Stage stage;
    for (const bool front : {true, false}) {
        const SurfaceInteraction hit = stage.hit(1, 0.25f, 0.5f, front);
        const auto geometry = [&](GeometryOutput output) {
            return stage.show(hit, NodeOpCode::Geometry, output);
        };
        EXPECT_EQ(geometry(GeometryOutput::Position), hit.p);
        EXPECT_EQ(geometry(GeometryOutput::Normal), hit.ns);
        EXPECT_EQ(geometry(GeometryOutput::TrueNormal), hit.ng);
        EXPECT_EQ(geometry(GeometryOutput::Incoming), hit.wo);
        expect_near(geometry(GeometryOutput::Parametric), Vec3(0.25f, 0.25f, 0));
        const Rgb back = stage.show(hit,
                                    NodeOpCode::Geometry,
                                    static_cast<std::uint16_t>(GeometryOutput::Backfacing),
                                    {},
                                    1);
        EXPECT_EQ(back.x, front ? 0.0f : 1.0f);
        const Vec3 tangent = geometry(GeometryOutput::Tangent);
        EXPECT_NEAR(glm::length(tangent), 1.0f, 1e-5f);
        EXPECT_NEAR(glm::dot(tangent, hit.ns), 0.0f, 1e-5f);
    }
}

TEST(ProgramGeometry, UvMapsByName) {
    const Stage stage;
    const SurfaceInteraction hit = stage.hit(0, 0.25f, 0.5f, true);
    // Corner weights 0.25, 0.25, 0.5.
    expect_near(stage.show(hit, NodeOpCode::Uv, kDefaultName), Vec3(0.75f, 0.5f, 0));
    expect_near(stage.show(hit, NodeOpCode::Uv, std::uint16_t{0}), Vec3(0.75f, 0.5f, 0));
    expect_near(stage.show(hit, NodeOpCode::Uv, std::uint16_t{1}), Vec3(-0.5f, 0.75f, 0));
    expect_near(stage.show(hit, NodeOpCode::Uv, std::uint16_t{2}), Vec3(0.0f));
}

TEST(ProgramGeometry, Coordinates) {
    Stage stage;
    stage.context.world_to_camera = glm::translate(Mat4(1.0f), Vec3(0, 0, -10));
    const SurfaceInteraction hit = stage.hit(0, 0.25f, 0.5f, true);
    const Vec3 local = transform_point(stage.instances[0].to_object, hit.p);
    const auto coordinate = [&](CoordinateOutput output) {
        return stage.show(hit, NodeOpCode::Coordinate, output);
    };
    expect_near(coordinate(CoordinateOutput::Object), local);
    // The box is flat in z: its middle.
    expect_near(coordinate(CoordinateOutput::Generated),
                Vec3((local.x + 1.0f) / 4.0f, (local.y + 1.0f) / 2.0f, 0.5f));
    expect_near(coordinate(CoordinateOutput::Uv), Vec3(0.75f, 0.5f, 0));
    expect_near(coordinate(CoordinateOutput::Normal), Vec3(0, 0, 1));
    expect_near(coordinate(CoordinateOutput::Camera), Vec3(hit.p.x, hit.p.y, 10.0f - hit.p.z));
    const Vec3 mirrored = coordinate(CoordinateOutput::Reflection);
    EXPECT_NEAR(glm::dot(mirrored, hit.ns), glm::dot(hit.wo, hit.ns), 1e-5f);
    expect_near(glm::cross(mirrored + hit.wo, hit.ns), Vec3(0.0f));
    // Bounds handed in are used as they are.
    const Bounds3 bounds{Vec3(-11, -11, -11), Vec3(9, 9, 9)};
    stage.context.mesh_bounds = {&bounds, 1};
    expect_near(coordinate(CoordinateOutput::Generated), (local + Vec3(11.0f)) / 20.0f);
}

TEST(ProgramGeometry, CameraDataAndWindow) {
    Stage stage;
    stage.context.world_to_camera = glm::translate(Mat4(1.0f), Vec3(0, 0, -10));
    // A frame of 90 degrees: x / -z from -1 to 1 becomes 0 to 1.
    stage.context.camera_to_window =
        Mat4(Vec4(0.5f, 0, 0, 0), Vec4(0, 0.5f, 0, 0), Vec4(-0.5f, -0.5f, 0, -1), Vec4(0, 0, 0, 0));
    SurfaceInteraction hit = stage.hit(0, 0.25f, 0.5f, true);
    hit.p = Vec3(3, -2, 4);  // 6 before the camera
    const auto data = [&](CameraDataOutput output, std::uint32_t outputs) {
        return stage.show(
            hit, NodeOpCode::CameraData, static_cast<std::uint16_t>(output), {}, outputs);
    };
    expect_near(data(CameraDataOutput::ViewVector, 3), Vec3(3, -2, 6) / 7.0f);
    EXPECT_FLOAT_EQ(data(CameraDataOutput::ViewZDepth, 1).x, 6.0f);
    EXPECT_FLOAT_EQ(data(CameraDataOutput::ViewDistance, 1).x, 7.0f);
    expect_near(stage.show(hit, NodeOpCode::Coordinate, CoordinateOutput::Window),
                Vec3(0.75f, 0.5f - 1.0f / 6.0f, 0));
}

TEST(ProgramGeometry, NormalMaps) {
    const Stage stage;
    const Vec3 along = glm::normalize(transform_vector(stage.instances[0].to_world, Vec3(1, 0, 0)));
    for (const bool front : {true, false}) {
        for (const std::uint32_t triangle : {0u, 1u}) {
            const SurfaceInteraction hit = stage.hit(triangle, 0.3f, 0.3f, front);
            const float side = front ? 1.0f : -1.0f;
            const auto map = [&](int mode, float strength, const std::vector<float>& color) {
                return stage.show(hit,
                                  NodeOpCode::NormalMap,
                                  static_cast<std::uint16_t>(mode),
                                  {{strength}, color});
            };
            expect_near(map(0, 1.0f, {0.5f, 0.5f, 1}), hit.ns);
            expect_near(map(0, 0.0f, {1, 0.5f, 0.5f}), hit.ns);
            // Wholly along u: the object's x axis, which the second map calls v.
            const Vec3 x_normal =
                glm::normalize(transform_normal(stage.instances[0].to_object, Vec3(1, 0, 0)));
            expect_near(map(0, 1.0f, {1, 0.5f, 0.5f}), x_normal * side, 1e-4f);
            expect_near(stage.show_turned_map(hit, {0.5f, 1, 0.5f}), x_normal * side, 1e-4f);
            // A half turned normal leans to x and stays on the viewer's side.
            const Vec3 leaning = map(0, 1.0f, {0.75f, 0.5f, 0.9f});
            EXPECT_GT(glm::dot(leaning, along) * side, 0.2f);
            EXPECT_GT(glm::dot(leaning, hit.ns), 0.5f);
            expect_near(map(1, 1.0f, {0.5f, 0.5f, 1}), hit.ns);
            expect_near(map(2, 1.0f, {0.5f, 0.5f, 1}), Vec3(0, 0, side));
            EXPECT_NEAR(glm::length(map(2, 0.5f, {0.5f, 0.5f, 1})), 1.0f, 1e-5f);
        }
    }
}

TEST(ProgramGeometry, FresnelAndLayerWeight) {
    const Stage stage;
    SurfaceInteraction hit = stage.hit(0, 0.3f, 0.3f, true);
    hit.wo = hit.ns;
    const auto fresnel = [&](float ior) {
        return stage.show(hit, NodeOpCode::Fresnel, 0, {{ior}, {}}, 1).x;
    };
    EXPECT_NEAR(fresnel(1.5f), 0.04f, 1e-6f);
    EXPECT_NEAR(fresnel(2.0f), 1.0f / 9.0f, 1e-6f);
    EXPECT_NEAR(fresnel(1.0f), 0.0f, 1e-6f);
    // Brewster's angle: only the half that is polarised along the surface comes back.
    const float angle = std::atan(1.5f);
    hit.wo = hit.ns * std::cos(angle) + Frame::from_z(hit.ns).x * std::sin(angle);
    const float inside = std::asin(std::sin(angle) / 1.5f);
    const float s = std::pow(std::sin(angle - inside) / std::sin(angle + inside), 2.0f);
    EXPECT_NEAR(fresnel(1.5f), 0.5f * s, 1e-5f);
    hit.front_face = false;  // from within, beyond the critical angle
    EXPECT_EQ(fresnel(1.5f), 1.0f);
    hit.front_face = true;
    const auto facing = [&](float blend) {
        ProgramBuilder b;
        const std::int32_t out =
            b.add(NodeOpCode::LayerWeight, 0, {b.constant({blend}), kDefaultOperand}, 2);
        b.show_scalar(out + 1);
        return emission_of(compile(b.program), {&hit, 1}, stage.context)[0].x;
    };
    EXPECT_NEAR(facing(0.5f), 1.0f - std::cos(angle), 1e-5f);
    EXPECT_NEAR(facing(0.25f), 1.0f - std::pow(std::cos(angle), 0.5f), 1e-5f);
    EXPECT_NEAR(facing(0.75f), 1.0f - std::pow(std::cos(angle), 2.0f), 1e-5f);
    const float layer = stage.show(hit, NodeOpCode::LayerWeight, 0, {{1.0f / 3.0f}, {}}, 2).x;
    EXPECT_NEAR(layer, 0.5f * s, 1e-5f);  // eta = 1 / (1 - blend) = 1.5
}

TEST(ProgramGeometry, LightPathTellsOfTheRay) {
    Stage stage;
    const std::vector<SurfaceInteraction> hits(2, stage.hit(0, 0.3f, 0.3f, true));
    const std::vector<PathInfo> paths = {
        {.kind = 1}, {.kind = (1 << 3) | (1 << 5), .depth = 4, .diffuse_depth = 1}};
    stage.context.paths = paths;
    const auto run = [&](LightPathOutput output) {
        ProgramBuilder b;
        b.show_scalar(b.add(NodeOpCode::LightPath, static_cast<std::uint16_t>(output), {}, 1));
        const auto values = emission_of(compile(b.program), hits, stage.context);
        return Vec2(values[0].x, values[1].x);
    };
    EXPECT_EQ(run(LightPathOutput::IsCameraRay), Vec2(1, 0));
    EXPECT_EQ(run(LightPathOutput::IsGlossyRay), Vec2(0, 1));
    EXPECT_EQ(run(LightPathOutput::IsReflectionRay), Vec2(0, 1));
    EXPECT_EQ(run(LightPathOutput::IsDiffuseRay), Vec2(0, 0));
    EXPECT_EQ(run(LightPathOutput::RayDepth), Vec2(0, 4));
    EXPECT_EQ(run(LightPathOutput::DiffuseDepth), Vec2(0, 1));
    EXPECT_EQ(run(LightPathOutput::RayLength), Vec2(2.5f));
}

TEST(ProgramGeometry, VectorTransformBetweenSpaces) {
    Stage stage;
    stage.context.world_to_camera =
        glm::rotate(Mat4(1.0f), 0.5f, Vec3(0, 1, 0)) * glm::translate(Mat4(1.0f), Vec3(1, 2, 3));
    const SurfaceInteraction hit = stage.hit(0, 0.3f, 0.3f, true);
    const Mat4& to_world = stage.instances[0].to_world;
    const auto run = [&](int from, int to, int type, const Vec3& v) {
        return stage.show(hit,
                          NodeOpCode::VectorTransform,
                          static_cast<std::uint16_t>(from + 3 * to + 9 * type),
                          {{v.x, v.y, v.z}});
    };
    const Vec3 v(0.3f, -0.4f, 0.9f);
    for (int type = 0; type < 3; ++type) {
        expect_near(run(0, 0, type, v), type == 2 ? glm::normalize(v) : v);
        for (int from = 0; from < 3; ++from) {
            for (int to = 0; to < 3; ++to) {
                const Vec3 back = run(to, from, type, run(from, to, type, v));
                expect_near(back, type == 2 ? glm::normalize(v) : v, 1e-4f);
            }
        }
    }
    expect_near(run(1, 0, 1, v), transform_point(to_world, v));
    expect_near(run(1, 0, 0, v), transform_vector(to_world, v));
    expect_near(run(1, 0, 2, Vec3(0, 0, 1)), hit.ns);
    const Vec3 camera = transform_point(stage.context.world_to_camera, v);
    expect_near(run(0, 2, 1, v), Vec3(camera.x, camera.y, -camera.z));
    expect_near(stage.show(hit, NodeOpCode::ObjectInfo, ObjectInfoOutput::Location), Vec3(5, 6, 7));
}

// A scene whose coordinates begin elsewhere shows the same values.
TEST(ProgramGeometry, OriginIsNotSeen) {
    const Vec3 origin(4, -8, 16);
    Stage plain;
    plain.context.world_to_camera =
        glm::rotate(Mat4(1.0f), 0.5f, Vec3(0, 1, 0)) * glm::translate(Mat4(1.0f), Vec3(1, 2, 3));
    Stage moved;
    moved.context.origin = origin;
    moved.instances[0].to_world = glm::translate(Mat4(1.0f), -origin) * plain.instances[0].to_world;
    moved.instances[0].to_object = glm::inverse(moved.instances[0].to_world);
    moved.context.world_to_camera =
        plain.context.world_to_camera * glm::translate(Mat4(1.0f), origin);
    const SurfaceInteraction hit = plain.hit(1, 0.2f, 0.3f, true);
    const SurfaceInteraction same = moved.hit(1, 0.2f, 0.3f, true);
    const auto both = [&](NodeOpCode code, int mode, const std::vector<float>& vector = {}) {
        const auto wanted = static_cast<std::uint16_t>(mode);
        const auto operands = vector.empty() ? std::vector<std::vector<float>>{}
                                             : std::vector<std::vector<float>>{vector};
        SCOPED_TRACE(mode);
        expect_near(moved.show(same, code, wanted, operands),
                    plain.show(hit, code, wanted, operands),
                    2e-5f);
    };
    both(NodeOpCode::Geometry, static_cast<int>(GeometryOutput::Position));
    both(NodeOpCode::ObjectInfo, static_cast<int>(ObjectInfoOutput::Location));
    for (const CoordinateOutput output : {CoordinateOutput::Generated,
                                          CoordinateOutput::Object,
                                          CoordinateOutput::Camera,
                                          CoordinateOutput::Window}) {
        both(NodeOpCode::Coordinate, static_cast<int>(output));
    }
    for (int mode = 0; mode < 27; ++mode) {
        both(NodeOpCode::VectorTransform, mode, {0.3f, -0.4f, 0.9f});
    }
}

}  // namespace
}  // namespace pharos
