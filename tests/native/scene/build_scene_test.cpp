#include <chrono>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

#include "scene/scene.h"
#include "support/description_builders.h"
#include "support/timing.h"

namespace pharos::testing {
namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();

struct Built {
    SceneReport report;
    std::unique_ptr<const Scene> scene;

    [[nodiscard]] std::size_t reported(const std::string& object) const {
        return static_cast<std::size_t>(
            std::ranges::count_if(report.entries(), [&](const ReportEntry& entry) {
                return entry.object == object && !entry.message.empty();
            }));
    }

    [[nodiscard]] Hit trace(const Ray& ray) const {
        Hit hit;
        const std::uint32_t visibility = kVisibleAll;
        scene->accelerator->intersect(
            std::span(&ray, 1), std::span(&visibility, 1), std::span(&hit, 1));
        return hit;
    }
};

Built build(SceneDescription description) {
    Built built;
    built.scene = build_scene(std::move(description), CancelFlag(), built.report);
    return built;
}

Mesh floor_quad() {
    return quad_mesh("floor", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0));
}

const Ray kDown{Vec3(0.3f, 0.2f, 5.0f), Vec3(0, 0, -1)};

TEST(BuildScene, EmptySceneWorks) {
    const Built built = build({});
    EXPECT_TRUE(built.report.entries().empty());
    EXPECT_EQ(built.trace(kDown).instance, kNone);
    EXPECT_FALSE(built.scene->needs.nee);
    EXPECT_FALSE(built.scene->needs.environment);
    EXPECT_TRUE(built.scene->lights->empty());
    EXPECT_FALSE(built.scene->description.has_camera);
    EXPECT_FALSE(built.scene->bounds.empty());
    EXPECT_EQ(built.scene->materials.size(), 1u);
    EXPECT_GT(built.scene->bytes(), 0u);
}

TEST(BuildScene, NeedsOfAPlainScene) {
    SceneBuilder b;
    b.object(floor_quad(), b.material("white", diffuse_program(Rgb(0.8f))));
    b.lamp(point_lamp(Vec3(0, 0, 2), Rgb(10)));
    const Built built = build(b.build());
    EXPECT_TRUE(built.report.entries().empty());
    const SceneNeeds& needs = built.scene->needs;
    EXPECT_TRUE(needs.nee);
    EXPECT_TRUE(needs.all_constant);
    EXPECT_FALSE(needs.emission || needs.emissive_triangles || needs.environment ||
                 needs.transparency || needs.textures || needs.lamps_hittable);
    EXPECT_EQ(built.trace(kDown).t, 5.0f);
}

TEST(BuildScene, NeedsOfARichScene) {
    SceneBuilder b;
    ImageUse use;
    use.image = b.image({});
    b.description().images[0].pixels.assign(4 * 2, 0.5f);
    b.description().images[0].width = 2;
    b.description().images[0].height = 1;
    b.object(floor_quad(), b.material("photo", image_diffuse_program(use)));
    b.object(floor_quad(), b.material("clear", transparent_program(Rgb(0.5f))));
    b.object(floor_quad(), b.material("lamp", emission_program(Rgb(1), 2.0f)));
    b.lamp(area_lamp(look_at(Vec3(0, 0, 3), Vec3(0)), Rgb(10), 1, 1));
    b.world(background_program(Rgb(1), 0.5f));
    const Built built = build(b.build());
    EXPECT_TRUE(built.report.entries().empty());
    const SceneNeeds& needs = built.scene->needs;
    EXPECT_TRUE(needs.nee && needs.emission && needs.emissive_triangles && needs.environment &&
                needs.constant_environment && needs.transparency && needs.textures &&
                needs.lamps_hittable);
    EXPECT_FALSE(needs.all_constant);
    EXPECT_EQ(built.scene->constant_world, Rgb(0.5f));
    EXPECT_TRUE(built.scene->description.images[0].pixels.empty());
}

// Flags speak of what is rendered, not of what is in the file.
TEST(BuildScene, UnusedMaterialsNeedNothing) {
    SceneBuilder b;
    b.object(floor_quad(), b.material("white", diffuse_program(Rgb(0.8f))));
    b.material("lamp", emission_program(Rgb(1), 2.0f));
    b.material("clear", transparent_program(Rgb(0.5f)));
    const Built built = build(b.build());
    EXPECT_FALSE(built.scene->needs.emission || built.scene->needs.transparency ||
                 built.scene->needs.nee);
}

TEST(BuildScene, NonFiniteVerticesLoseTheirTriangles) {
    for (const float bad : {kNan, kInfinity, -kInfinity, 1e30f}) {
        SceneBuilder b;
        Mesh mesh = sphere_mesh("sphere", Vec3(0), 1.0f, 8, 8);
        mesh.uv_maps.push_back({"UVMap", std::vector<Vec2>(3 * mesh.triangles.size())});
        mesh.material_indices.resize(mesh.triangles.size());
        std::iota(mesh.material_indices.begin(), mesh.material_indices.end(), std::uint16_t{0});
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            mesh.uv_maps[0].uv[3 * i + 2] = Vec2(static_cast<float>(i), 0);
        }
        mesh.positions[0].y = bad;
        const std::vector<UVec3> triangles = mesh.triangles;
        b.object(std::move(mesh), kNone);
        const Built built = build(b.build());
        EXPECT_EQ(built.reported("sphere"), 1u);
        const Mesh& mended = built.scene->description.meshes[0];
        ASSERT_EQ(mended.triangles.size(), triangles.size() - 8);
        ASSERT_EQ(mended.uv_maps[0].uv.size(), 3 * mended.triangles.size());
        for (std::size_t i = 0; i < mended.triangles.size(); ++i) {
            // What belongs to a triangle has moved with it.
            const std::uint16_t old = mended.material_indices[i];
            EXPECT_EQ(mended.triangles[i], triangles[old]);
            EXPECT_EQ(mended.uv_maps[0].uv[3 * i + 2].x, static_cast<float>(old));
            EXPECT_TRUE(mended.triangles[i].x != 0 && mended.triangles[i].y != 0 &&
                        mended.triangles[i].z != 0);
        }
        EXPECT_LT(max_component(built.scene->bounds.upper), 1.1f);
    }
}

TEST(BuildScene, BrokenIndicesAndMisfits) {
    SceneBuilder b;
    Mesh mesh = floor_quad();
    mesh.triangles.emplace_back(0, 1, 4000);
    mesh.triangles.emplace_back(kNone, 1, 2);
    mesh.uv_maps.clear();
    b.object(mesh, kNone);
    mesh = floor_quad();
    mesh.name = "misfit";
    mesh.normal_domain = NormalDomain::Corner;
    mesh.normals.assign(5, Vec3(0, 0, 1));
    mesh.material_indices.assign(1, 3);
    mesh.uv_maps[0].uv.pop_back();
    b.object(mesh, kNone, glm::translate(Mat4(1.0f), Vec3(0, 0, -1)));
    const Built built = build(b.build());
    EXPECT_EQ(built.reported("floor"), 1u);
    EXPECT_EQ(built.reported("misfit"), 3u);
    EXPECT_EQ(built.scene->description.meshes[0].triangles.size(), 2u);
    const Hit hit = built.trace(kDown);
    EXPECT_EQ(hit.t, 5.0f);
    EXPECT_EQ(built.scene->interaction(kDown, hit).material, 0u);
}

TEST(BuildScene, InstancesThatCannotBeShownAreSkipped) {
    SceneBuilder b;
    const std::uint32_t mesh = b.mesh(floor_quad());
    const auto add = [&](const char* name, std::uint32_t index, const Mat4& matrix) {
        b.instance(index, {kNone}, matrix);
        b.description().instances.back().name = name;
    };
    Mat4 broken(1.0f);
    broken[1][2] = kNan;
    add("flat", mesh, glm::scale(Mat4(1.0f), Vec3(1, 1, 0)));
    add("nothing", mesh, Mat4(0.0f));
    add("nan", mesh, broken);
    add("far", mesh, glm::scale(Mat4(1.0f), Vec3(kInfinity)));
    add("no mesh", 77, Mat4(1.0f));
    add("tiny", mesh, glm::scale(Mat4(1.0f), Vec3(1e-9f)));
    add("good", mesh, Mat4(1.0f));
    const Built built = build(b.build());
    for (const char* name : {"flat", "nothing", "nan", "far", "no mesh"}) {
        EXPECT_EQ(built.reported(name), 1u) << name;
    }
    EXPECT_EQ(built.report.entries().size(), 5u);
    EXPECT_EQ(built.scene->instances.size(), 2u);
    EXPECT_EQ(built.trace(kDown).instance, 1u);
}

TEST(BuildScene, MaterialsThatDoNotExistBecomeGrey) {
    SceneBuilder b;
    const std::uint32_t white = b.material("white", diffuse_program(Rgb(1)));
    Mesh mesh = floor_quad();
    mesh.material_indices = {0, 1};
    b.instance(b.mesh(mesh), {kNone, 12});
    b.instance(b.mesh(floor_quad()), {white}, glm::translate(Mat4(1.0f), Vec3(0, 0, 1)));
    b.description().instances[1].material_set = 99;
    b.description().instances[1].name = "lost";
    b.instance(b.mesh(floor_quad()), {}, glm::translate(Mat4(1.0f), Vec3(0, 0, -1)));
    const Built built = build(b.build());
    EXPECT_EQ(built.reported("floor"), 1u);  // kNone is no error, 12 is
    EXPECT_EQ(built.reported("lost"), 1u);
    ASSERT_EQ(built.scene->materials.size(), 2u);
    for (const Instance& instance : built.scene->instances) {
        for (const std::uint32_t material : instance.materials) {
            EXPECT_EQ(material, 1u);
        }
    }
    EXPECT_TRUE(built.scene->materials[1].scatters);
}

TEST(BuildScene, DegenerateAndEmptyMeshesAreHarmless) {
    SceneBuilder b;
    const std::uint32_t lamp = b.material("lamp", emission_program(Rgb(1), 1.0f));
    Mesh mesh = floor_quad();
    mesh.triangles.emplace_back(0, 0, 0);
    mesh.triangles.emplace_back(0, 1, 1);
    mesh.uv_maps.clear();
    b.object(mesh, lamp);
    b.object(Mesh{}, lamp);
    Mesh points;
    points.positions.assign(3, Vec3(0));
    b.object(points, lamp);
    const Built built = build(b.build());
    EXPECT_TRUE(built.report.entries().empty());
    EXPECT_EQ(built.trace(kDown).t, 5.0f);
    EXPECT_EQ(built.scene->instances.size(), 1u);
    const LightSampleContext above{Vec3(0, 0, 1), Vec3(0, 0, -1), false};
    for (std::uint32_t i = 0; i < 4; ++i) {
        const float pdf = built.scene->lights->pdf_triangle(above, 0, i, 1.0f, 1.0f);
        EXPECT_EQ(pdf > 0.0f, i < 2) << i;
    }
}

TEST(BuildScene, LampsWithoutNumbersAreSkipped) {
    SceneBuilder b;
    LightDescription lamp = point_lamp(Vec3(0, 0, 1), Rgb(1));
    b.lamp(lamp);
    lamp.name = "bad";
    lamp.strength.y = kNan;
    b.lamp(lamp);
    lamp = area_lamp(Mat4(1.0f), Rgb(1), 1, kInfinity);
    lamp.name = "bad";
    b.lamp(lamp);
    lamp = sun_lamp(Mat4(1.0f), Rgb(1), 0.1f);
    lamp.to_world[0][0] = kNan;
    lamp.name = "bad";
    b.lamp(lamp);
    const Built built = build(b.build());
    EXPECT_EQ(built.reported("bad"), 3u);
    EXPECT_EQ(built.scene->description.lights.size(), 1u);
    EXPECT_TRUE(built.scene->needs.nee);
}

TEST(BuildScene, CameraWithoutNumbersIsNoCamera) {
    SceneBuilder b;
    b.camera(Vec3(0, -3, 1), Vec3(0), 0.7f, 32, 32);
    b.description().camera.to_world[3][1] = kNan;
    const Built built = build(b.build());
    EXPECT_FALSE(built.scene->description.has_camera);
    EXPECT_EQ(built.report.entries().size(), 1u);
}

TEST(BuildScene, ExposureThatIsNoNumberIsOne) {
    for (const float exposure : {kNan, kInfinity}) {
        SceneBuilder b;
        b.camera(Vec3(0, -3, 1), Vec3(0), 0.7f, 32, 32);
        b.description().film.exposure = exposure;
        const Built built = build(b.build());
        EXPECT_EQ(built.scene->description.film.exposure, 1.0f);
        EXPECT_EQ(built.reported("Film"), 1u);
    }
}

TEST(BuildScene, MissingImagesAreMagentaAndReported) {
    SceneBuilder b;
    ImageUse use;
    ImageDescription missing;
    missing.name = "gone";
    missing.path = "/nonexistent/gone.png";
    use.image = b.image(missing);
    b.object(floor_quad(), b.material("photo", image_diffuse_program(use)));
    missing.name = "unused";
    b.image(missing);
    const Built built = build(b.build());
    EXPECT_EQ(built.reported("gone"), 1u);
    EXPECT_EQ(built.reported("unused"), 0u);
    EXPECT_TRUE(built.scene->textures.at(0).missing());
}

TEST(BuildScene, BrokenProgramsAreReported) {
    SceneBuilder b;
    NodeProgram program = diffuse_program(Rgb(0.5f));
    program.operands[1] = 1000;
    b.object(floor_quad(), b.material("broken", program));
    const Built built = build(b.build());
    EXPECT_GE(built.reported("broken"), 1u);
}

// An image world: brightest towards +x, found there by the map.
TEST(BuildScene, WorldMapFollowsTheImage) {
    SceneBuilder b;
    ImageDescription image;
    image.name = "sky";
    image.width = 16;
    image.height = 8;
    image.color_space = ImageColorSpace::Linear;
    image.pixels.assign(4 * 16 * 8, 0.0f);
    const Vec2 bright = direction_to_equirectangular(glm::normalize(Vec3(1, 0.2f, 0.3f)));
    const auto x = static_cast<std::size_t>(bright.x * 16);
    const auto y = static_cast<std::size_t>(bright.y * 8);
    for (std::size_t channel = 0; channel < 4; ++channel) {
        image.pixels[4 * (y * 16 + x) + channel] = 5.0f;
    }
    b.world(environment_image_program(b.image(image), 1.0f));
    const Built built = build(b.build());
    EXPECT_TRUE(built.report.entries().empty());
    const Scene& scene = *built.scene;
    ASSERT_TRUE(scene.environment != nullptr);
    EXPECT_FALSE(scene.needs.constant_environment);
    EXPECT_TRUE(scene.needs.environment && scene.needs.nee && scene.needs.textures);
    EXPECT_GT(scene.environment->pdf(glm::normalize(Vec3(1, 0.2f, 0.3f))), 1.0f);
    EXPECT_LT(scene.environment->pdf(Vec3(-1, 0, 0)), 1e-3f);
}

TEST(BuildScene, BlackAndHiddenWorldsAreSkipped) {
    SceneBuilder b;
    b.world(background_program(Rgb(0), 1.0f));
    EXPECT_FALSE(build(b.build()).scene->needs.environment);
    SceneBuilder hidden;
    hidden.world(background_program(Rgb(1), 1.0f));
    hidden.description().world.visibility = 0;
    EXPECT_FALSE(build(hidden.build()).scene->needs.environment);
    for (const bool use_mis : {false, true}) {
        SceneBuilder unsampled;
        unsampled.world(background_program(Rgb(1), 1.0f));
        unsampled.description().world.use_mis = use_mis;
        unsampled.description().world.visibility = use_mis ? kVisibleCamera | kVisibleGlossy : 31;
        const Built built = build(unsampled.build());
        EXPECT_TRUE(built.scene->needs.environment);
        EXPECT_TRUE(built.scene->environment == nullptr);
        EXPECT_FALSE(built.scene->needs.nee);
    }
}

TEST(BuildScene, EmittersAreSampledUnlessTurnedOff) {
    for (const bool sampled : {false, true}) {
        SceneBuilder b;
        b.object(floor_quad(), b.material("lamp", emission_program(Rgb(1), 3.0f), sampled));
        const Built built = build(b.build());
        EXPECT_TRUE(built.scene->needs.emission);
        EXPECT_EQ(built.scene->needs.emissive_triangles, sampled);
        EXPECT_EQ(built.scene->needs.nee, sampled);
    }
}

TEST(BuildScene, WindowMatrixFramesTheCamerasView) {
    for (const CameraType type : {CameraType::Perspective, CameraType::Orthographic}) {
        SceneBuilder b;
        b.camera(Vec3(3, -4, 2), Vec3(0), 0.8f, 64, 48);
        b.description().camera.type = type;
        b.description().camera.window_lower = Vec2(-0.5f, -0.3f);
        b.description().camera.window_upper = Vec2(0.7f, 0.4f);
        const Mat4 to_world = b.description().camera.to_world;
        const Built built = build(b.build());
        const ShadingContext& context = built.scene->shading;
        const Vec3 on_film(-0.5f + 0.25f * 1.2f, -0.3f + 0.75f * 0.7f, -1.0f);
        const Vec3 point =
            type == CameraType::Perspective ? on_film * 6.0f : Vec3(on_film.x, on_film.y, -6.0f);
        const Vec4 world(transform_point(to_world, point), 1.0f);
        const Vec4 window = context.camera_to_window * (context.world_to_camera * world);
        EXPECT_NEAR(window.x / window.w, 0.25f, 1e-5f);
        EXPECT_NEAR(window.y / window.w, 0.75f, 1e-5f);
    }
}

// From the cancel to the end of the build; 0 when the build ended before it was cancelled.
double cancelled_build_seconds(const SceneDescription& description, int delay) {
    CancelFlag cancel;
    SceneReport report;
    Stopwatch since_cancel;
    {
        const std::jthread canceller([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(delay));
            since_cancel = Stopwatch();
            cancel.cancel();
        });
        try {
            static_cast<void>(build_scene(description, cancel, report));
            return 0.0;
        } catch (const Cancelled&) {
        }
    }
    return since_cancel.seconds();
}

TEST(BuildScene, CancelIsObeyed) {
    CancelFlag cancel;
    cancel.cancel();
    SceneReport report;
    EXPECT_THROW(static_cast<void>(build_scene({}, cancel, report)), Cancelled);

    SceneBuilder b;
    b.object(sphere_mesh("big", Vec3(0), 1.0f, 800, 1250), kNone);
    b.world(environment_image_program(kNone, 1.0f));
    b.description().world.map_resolution = 4096;
    const SceneDescription description = b.build();
    constexpr double kBar = 0.3 * kSlowdown;
    for (const int milliseconds : {1, 20, 60, 150}) {
        const auto attempt = [&] { return cancelled_build_seconds(description, milliseconds); };
        EXPECT_LT(least_of(kBar, attempt), kBar) << milliseconds << " ms";
    }
}

NodeProgram moving_program(NodeOpCode code, std::uint16_t mode, const Vec3& by) {
    ProgramBuilder b;
    b.closure(code, mode, {code == NodeOpCode::AovValue ? b.scalar(by.x) : b.color(by)});
    return b.build();
}

float height_under(const Built& built, float x) {
    const Hit hit = built.trace({Vec3(x, 0.2f, 50.0f), Vec3(0, 0, -1)});
    return hit.instance == kNone ? kNan : 50.0f - hit.t;
}

TEST(BuildScene, DisplacementMovesVertices) {
    SceneBuilder b;
    const auto plain = b.material("plain", diffuse_program(Rgb(0.5f)));
    const auto moving = b.material("moving", diffuse_program(Rgb(0.5f)));
    const std::uint32_t mesh = b.mesh(floor_quad());
    Mat4 twice(2.0f);
    twice[3] = Vec4(10.0f, 0.0f, 0.0f, 1.0f);
    Mat4 far(1.0f);
    far[3] = Vec4(20.0f, 0.0f, 0.0f, 1.0f);
    b.instance(mesh, {moving}, Mat4(1.0f));
    b.instance(mesh, {plain}, far);
    b.object(quad_mesh("large", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)), moving, twice);
    SceneDescription d = b.build();
    d.materials[1].displacement = moving_program(NodeOpCode::AovValue, 0, Vec3(0.5f));
    Built built = build(d);
    EXPECT_NEAR(height_under(built, 0.3f), 0.5f, 1e-5f);
    EXPECT_NEAR(height_under(built, 20.3f), 0.0f, 1e-5f);  // the same mesh of another material
    EXPECT_NEAR(height_under(built, 10.3f), 1.0f, 1e-5f);  // in the object's space
    EXPECT_TRUE(built.report.entries().empty());

    d.materials[1].displacement = moving_program(NodeOpCode::AovColor, 1, Vec3(0, 0, 0.25f));
    built = build(d);
    EXPECT_NEAR(height_under(built, 0.3f), 0.25f, 1e-5f);
    EXPECT_NEAR(height_under(built, 10.3f), 0.25f, 1e-5f);  // in the world's

    d.materials[1].displacement = moving_program(NodeOpCode::AovValue, 0, Vec3(kNan));
    built = build(std::move(d));
    EXPECT_NEAR(height_under(built, 0.3f), 0.0f, 1e-5f);
}

// All of it far away: near zero within. Some of it: nothing moves.
TEST(BuildScene, FarScenesBeginNearZero) {
    const auto far_scene = [](float x, std::size_t near) {
        SceneBuilder b;
        for (std::size_t i = 0; i < 20; ++i) {
            Mat4 place(1.0f);
            place[3] = Vec4(i < near ? 0.0f : x + static_cast<float>(i), 0.0f, 0.0f, 1.0f);
            b.object(floor_quad(), kNone, place);
        }
        SceneDescription d = b.build();
        LightDescription lamp;
        lamp.to_world[3] = Vec4(x, 0.0f, 3.0f, 1.0f);
        d.lights.push_back(lamp);
        d.has_camera = true;
        d.camera.to_world[3] = Vec4(x, 0.0f, 3.0f, 1.0f);
        return build(std::move(d));
    };
    for (const float x : {-20000.0f, 300.0f, 4096.0f, 1e7f}) {
        const Built built = far_scene(x, 2);
        const float origin = built.scene->shading.origin.x;
        EXPECT_NEAR(origin, x, 64.0f) << x;
        EXPECT_EQ(std::fmod(origin, 64.0f), 0.0f) << x;
        EXPECT_EQ(built.scene->shading.origin.y, 0.0f);
        const float here = built.scene->instances[10].to_world[3].x;
        EXPECT_EQ(here + origin, x + 10.0f) << x;
        EXPECT_EQ(built.scene->instances[10].to_object[3].x, -here) << x;
        EXPECT_EQ(built.scene->description.lights[0].to_world[3].x, x - origin) << x;
        EXPECT_EQ(built.scene->camera().to_world[3].x, x - origin) << x;
        EXPECT_EQ(built.trace({Vec3(here + 0.3f, 0.2f, 5.0f), Vec3(0, 0, -1)}).instance, 10u) << x;
    }
    EXPECT_EQ(far_scene(200.0f, 0).scene->shading.origin, Vec3(0.0f));
    EXPECT_EQ(far_scene(20000.0f, 4).scene->shading.origin, Vec3(0.0f));
}

}  // namespace
}  // namespace pharos::testing
