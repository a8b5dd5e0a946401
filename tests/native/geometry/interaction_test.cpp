#include <glm/gtc/matrix_inverse.hpp>
#include <gtest/gtest.h>

#include "geometry/instance_surface.h"
#include "random_scene.h"
#include "support/description_builders.h"

namespace pharos::testing {
namespace {

// One triangle (0,0,0) (1,0,0) (0,1,0), whose outside is +z.
Mesh triangle(NormalDomain domain, std::vector<Vec3> normals) {
    Mesh mesh;
    mesh.positions.assign(3, Vec3(0.0f));
    mesh.positions[1].x = 1.0f;
    mesh.positions[2].y = 1.0f;
    mesh.triangles.emplace_back(0, 1, 2);
    mesh.normal_domain = domain;
    mesh.normals = std::move(normals);
    return mesh;
}

TestGeometry one_instance(Mesh mesh, const Mat4& to_world) {
    TestGeometry scene;
    scene.meshes.push_back(std::move(mesh));
    scene.instances.push_back(make_instance(0, to_world));
    scene.build();
    return scene;
}

SurfaceInteraction look(const TestGeometry& scene, const Vec3& from, const Vec3& to) {
    const Ray ray{from, glm::normalize(to - from)};
    const Hit hit = scene.trace(ray);
    EXPECT_EQ(hit.instance, 0u);
    return hit.instance == kNone ? SurfaceInteraction() : scene.interaction(ray, hit);
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance) {
    EXPECT_LT(glm::length(a - b), tolerance)
        << a.x << ' ' << a.y << ' ' << a.z << " against " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Interaction, FrontAndBackOfAFlatFace) {
    const TestGeometry scene = one_instance(triangle(NormalDomain::Face, {}), Mat4(1.0f));
    const Vec3 p(0.25f, 0.5f, 0.0f);
    const SurfaceInteraction front = look(scene, Vec3(0.5f, 0.5f, 2.0f), p);
    EXPECT_TRUE(front.front_face);
    expect_near(front.ng, Vec3(0, 0, 1), 1e-6f);
    expect_near(front.ns, front.ng, 1e-6f);
    expect_near(front.p, p, 1e-6f);
    EXPECT_NEAR(front.u, 0.25f, 1e-6f);
    EXPECT_NEAR(front.v, 0.5f, 1e-6f);
    EXPECT_GT(glm::dot(front.wo, front.ng), 0.0f);
    const SurfaceInteraction back = look(scene, Vec3(0.5f, 0.5f, -2.0f), p);
    EXPECT_FALSE(back.front_face);
    expect_near(back.ng, Vec3(0, 0, -1), 1e-6f);
    expect_near(back.ns, back.ng, 1e-6f);
}

TEST(Interaction, SmoothNormalsByDomain) {
    const std::vector<Vec3> normals = {glm::normalize(Vec3(1, 0, 1)),
                                       glm::normalize(Vec3(0, 1, 1)),
                                       glm::normalize(Vec3(0, 0, 1))};
    const float u = 0.3f;
    const float v = 0.6f;
    const Vec3 expected =
        glm::normalize(normals[0] * (1 - u - v) + normals[1] * u + normals[2] * v);
    for (const NormalDomain domain : {NormalDomain::Vertex, NormalDomain::Corner}) {
        const TestGeometry scene = one_instance(triangle(domain, normals), Mat4(1.0f));
        const SurfaceInteraction front = look(scene, Vec3(0.1f, 0.2f, 3.0f), Vec3(u, v, 0));
        expect_near(front.ns, expected, 1e-5f);
        const SurfaceInteraction back = look(scene, Vec3(0.1f, 0.2f, -3.0f), Vec3(u, v, 0));
        expect_near(back.ns, -expected, 1e-5f);
    }
}

// Corner normals belong to the triangle's place in the list, not to its vertices.
TEST(Interaction, CornerNormalsOfASecondTriangle) {
    Mesh mesh = triangle(NormalDomain::Corner, std::vector<Vec3>(3, Vec3(0, 0, 1)));
    mesh.positions.emplace_back(1, 1, 0);
    mesh.triangles.emplace_back(1, 3, 2);
    const Vec3 tilted = glm::normalize(Vec3(1, 1, 1));
    mesh.normals.insert(mesh.normals.end(), 3, tilted);
    const TestGeometry scene = one_instance(mesh, Mat4(1.0f));
    expect_near(look(scene, Vec3(0.9f, 0.9f, 1), Vec3(0.9f, 0.9f, 0)).ns, tilted, 1e-6f);
    expect_near(look(scene, Vec3(0.1f, 0.1f, 1), Vec3(0.1f, 0.1f, 0)).ns, Vec3(0, 0, 1), 1e-6f);
}

TEST(Interaction, BrokenNormalsFallBackToTheGeometricOne) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Vec3& normal : {Vec3(0.0f), Vec3(nan), Vec3(kInfinity, 0, 0), Vec3(1e-30f)}) {
        const TestGeometry scene =
            one_instance(triangle(NormalDomain::Vertex, std::vector<Vec3>(3, normal)), Mat4(1.0f));
        for (const float z : {-1.0f, 1.0f}) {
            const SurfaceInteraction si = look(scene, Vec3(0.2f, 0.2f, z), Vec3(0.2f, 0.2f, 0));
            expect_near(si.ns, Vec3(0, 0, z), 1e-6f);
        }
    }
}

// The outside stays outside under any transform; normals against the inverse transpose in double.
TEST(Interaction, NormalsOfTransformedAndMirroredInstances) {
    Random random(21);
    std::size_t mirrored = 0;
    for (int i = 0; i < 200; ++i) {
        const Vec3 smooth = glm::normalize(Vec3(0.3f, -0.2f, 1.0f));
        const Mat4 m = random.affine(3.0f);
        const TestGeometry scene =
            one_instance(triangle(NormalDomain::Vertex, std::vector<Vec3>(3, smooth)), m);
        mirrored += scene.instances[0].mirrored;
        const Mat3 normals = Mat3(glm::inverseTranspose(glm::dmat3(glm::dmat4(m))));
        const Vec3 p = transform_point(m, Vec3(0.3f, 0.3f, 0));
        for (const float side : {1.0f, -1.0f}) {
            const Vec3 from = transform_point(m, Vec3(0.4f, 0.2f, side));
            const SurfaceInteraction si = look(scene, from, p);
            EXPECT_EQ(si.front_face, side > 0.0f);
            expect_near(si.ng, side * glm::normalize(normals * Vec3(0, 0, 1)), 1e-4f);
            expect_near(si.ns, side * glm::normalize(normals * smooth), 1e-4f);
        }
    }
    EXPECT_GT(mirrored, 50u);
    EXPECT_LT(mirrored, 150u);
}

TEST(Interaction, MaterialComesFromTheSlot) {
    TestGeometry scene;
    Mesh mesh = quad_mesh("q", Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0));
    mesh.material_indices = {1, 9};
    scene.meshes.push_back(mesh);
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    scene.instances[0].materials = {4, 5, 6};
    scene.build();
    EXPECT_EQ(look(scene, Vec3(0.9f, 0.1f, 1), Vec3(0.9f, 0.1f, 0)).material, 5u);
    // Beyond the last slot the last one is used.
    EXPECT_EQ(look(scene, Vec3(0.1f, 0.9f, 1), Vec3(0.1f, 0.9f, 0)).material, 6u);
}

// Needles and points have no usable normal: whatever comes out must be finite.
TEST(Interaction, DegenerateTrianglesGiveFiniteValues) {
    Random random(22);
    for (int i = 0; i < 500; ++i) {
        Mesh mesh = triangle(NormalDomain::Face, {});
        const float scale = std::pow(10.0f, random.uniform(-20.0f, 14.0f));
        mesh.positions[0] = random.in_box(1.0f) * scale;
        mesh.positions[1] = random.in_box(1.0f) * scale;
        mesh.positions[2] =
            lerp(mesh.positions[0], mesh.positions[1], 0.4f) + random.in_box(1e-7f) * scale;
        TestGeometry scene;
        scene.meshes.push_back(mesh);
        scene.instances.push_back(make_instance(0, random.affine(scale)));
        scene.surfaces = make_instance_surfaces(scene.meshes, scene.instances);
        Hit hit;
        hit.t = scale;
        hit.u = 0.2f;
        hit.v = 0.3f;
        hit.instance = 0;
        hit.triangle = 0;
        const SurfaceInteraction si = scene.interaction(Ray{Vec3(0), random.direction()}, hit);
        ASSERT_TRUE(is_finite(si.p) && is_finite(si.ng) && is_finite(si.ns));
        ASSERT_TRUE(std::isfinite(si.p_error) && si.p_error >= 0.0f);
        ASSERT_NEAR(glm::length(si.ng), 1.0f, 1e-5f);
        ASSERT_LT(si.p_error, 1e-3f * scale);
    }
}

}  // namespace
}  // namespace pharos::testing
