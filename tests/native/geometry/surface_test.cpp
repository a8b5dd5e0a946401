#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "geometry/instance_surface.h"
#include "geometry/ray_offset.h"
#include "random_scene.h"
#include "support/description_builders.h"
#include "support/stress.h"

namespace pharos::testing {
namespace {

struct Generation {
    std::vector<Ray> rays;  // respawned from the hits, a quarter of them straight back
    std::vector<Hit> from;
    std::size_t misses = 0;
    std::size_t self_hits = 0;  // of the triangle the traced ray came from
};

// Traces `rays` (respawned from `from` unless it is empty) and respawns a ray from every hit.
Generation advance(const TestGeometry& scene,
                   Random& random,
                   const std::vector<Ray>& rays,
                   const std::vector<Hit>& from) {
    Generation next;
    const std::vector<Hit> hits = scene.trace(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].instance == kNone) {
            ++next.misses;
            continue;
        }
        next.self_hits += !from.empty() && hits[i].instance == from[i].instance &&
                          hits[i].triangle == from[i].triangle;
        const SurfaceInteraction si = scene.interaction(rays[i], hits[i]);
        const Vec3 wi = i % 4 == 0 ? si.wo : random.direction();
        next.rays.push_back({offset_ray_origin(si.p, si.ng, si.p_error, wi), wi});
        next.from.push_back(hits[i]);
    }
    return next;
}

class Scale : public ::testing::TestWithParam<float> {};

INSTANTIATE_TEST_SUITE_P(Coordinates,
                         Scale,
                         ::testing::Values(1e-8f, 1e-4f, 1.0f, 1e3f, 1e6f, 1e8f));

// Random triangles near the origin and ten times their extent away, in world space and as
// instances: no respawned ray may meet the triangle it starts from (1.8 million rays in all).
TEST_P(Scale, RespawnedRaysNeverHitTheirOwnTriangle) {
    const float scale = GetParam();
    Random random(7);
    std::size_t all = 0;
    std::size_t all_self_hits = 0;
    for (const int users : {1, 2}) {
        for (const float shift : {0.0f, 10.0f}) {
            TestGeometry scene;
            scene.meshes.push_back(random_triangles(random, 2000, scale, 0.2f * scale));
            const Mat4 away = glm::translate(Mat4(1.0f), Vec3(1, -1, 1) * (shift * scale));
            for (int user = 0; user < users; ++user) {
                scene.instances.push_back(make_instance(0, away * random.affine(scale)));
            }
            scene.build();
            const Vec3 center = scene.accelerator->bounds().center();
            Generation g;
            g.rays.resize(40000);
            for (Ray& ray : g.rays) {
                ray.origin = center + random.in_box(6.0f * scale);
                ray.direction = glm::normalize(center + random.in_box(scale) - ray.origin);
            }
            std::size_t traced = 0;
            std::size_t self_hits = 0;
            for (int generation = 0; generation < 4; ++generation) {
                g = advance(scene, random, g.rays, g.from);
                traced += g.rays.size();
                self_hits += g.self_hits;
            }
            EXPECT_GT(traced, 40000u);
            EXPECT_EQ(self_hits, 0u) << "users " << users << " shift " << shift;
            all += traced;
            all_self_hits += self_hits;
        }
    }
    const std::string at = std::to_string(std::lround(std::log10(scale)));
    say_stress(("respawned rays at coordinates 10^" + at + ": hits of their own triangle").c_str(),
               all,
               static_cast<double>(all_self_hits),
               0.0);
}

// Small faces in a plane through the origin: all their coordinates along the normal are 0, and so
// is what floats know of their error. They were black.
TEST(Watertight, FacesInCoordinatePlanesAreLeft) {
    Random random(11);
    for (int axis = 0; axis < 3; ++axis) {
        for (float size = 1e-6f; size < 1e7f; size *= 10.0f) {
            Vec3 n(0.0f);
            Vec3 along(0.0f);
            n[axis] = 1.0f;
            along[(axis + 1) % 3] = size;
            const Vec3 across = glm::cross(n, along);
            TestGeometry scene;
            Mesh square;
            square.name = "square";
            square.positions = {-along - across, along - across, along + across, across - along};
            square.triangles = {UVec3(0, 1, 2), UVec3(0, 2, 3)};
            scene.meshes.push_back(square);
            scene.instances.push_back(make_instance(0, Mat4(1.0f)));
            scene.build();
            std::vector<Ray> rays;
            for (int i = 0; i < 1000; ++i) {
                const Vec3 origin = random.in_box(0.5f * size) + n * size;
                rays.push_back({origin, glm::normalize(random.in_box(0.5f * size) - n * size)});
            }
            const Generation left = advance(scene, random, rays, {});
            ASSERT_GT(left.rays.size(), 100u);
            EXPECT_EQ(advance(scene, random, left.rays, left.from).self_hits, 0u)
                << "axis " << axis << ", size " << size;
        }
    }
}

// Of less than a tenth of a millimetre the distance along the ray has few digits.
class PointScale : public Scale {};

INSTANTIATE_TEST_SUITE_P(Coordinates, PointScale, ::testing::Values(1e-4f, 1.0f, 1e3f, 1e6f, 1e8f));

// The computed point against the same point in double, and a bound that is not absurd.
TEST_P(PointScale, PointLiesWithinItsErrorBound) {
    const float scale = GetParam();
    Random random(11);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 500, scale, 0.3f * scale));
    scene.instances.push_back(make_instance(0, random.affine(5.0f * scale)));
    scene.build();
    const Instance& instance = scene.instances.front();
    const Vec3 center = scene.accelerator->bounds().center();
    for (int i = 0; i < 5000; ++i) {
        Ray ray;
        ray.origin = center + random.in_box(6.0f * scale);
        ray.direction = glm::normalize(center + random.in_box(scale) - ray.origin);
        const Hit hit = scene.trace(ray);
        if (hit.instance == kNone) {
            continue;
        }
        const SurfaceInteraction si = scene.interaction(ray, hit);
        const UVec3& t = scene.meshes[0].triangles[hit.triangle];
        const auto corner = [&](std::uint32_t index) {
            return glm::dvec3(scene.meshes[0].positions[index]);
        };
        const double u = static_cast<double>(hit.u);
        const double v = static_cast<double>(hit.v);
        const glm::dvec3 p = (1.0 - u - v) * corner(t.x) + u * corner(t.y) + v * corner(t.z);
        const glm::dvec3 exact = glm::dvec3(glm::dmat4(instance.to_world) * glm::dvec4(p, 1.0));
        const double off_plane = std::abs(glm::dot(glm::dvec3(si.p) - exact, glm::dvec3(si.ng)));
        ASSERT_LE(off_plane, static_cast<double>(si.p_error));
        ASSERT_LT(si.p_error, 1e-4f * scale);
        // The ray's own point agrees as far as its t does.
        ASSERT_LT(glm::length(ray.origin + ray.direction * hit.t - si.p), 1e-4f * scale);
    }
}

TestGeometry closed_meshes(Random& random) {
    TestGeometry scene;
    scene.meshes.push_back(sphere_mesh("sphere", Vec3(0), 1.0f, 12, 18));
    scene.meshes.push_back(box_mesh("box", Vec3(-1), Vec3(1), true));
    for (int i = 0; i < 6; ++i) {
        const Mat4 apart = glm::translate(Mat4(1.0f), Vec3(20.0f * static_cast<float>(i), 0, 0));
        const std::uint32_t mesh = i == 0 ? 1u : 0u;  // the box once, the sphere shared
        scene.instances.push_back(make_instance(mesh, apart * random.affine(0.0f)));
    }
    scene.build();
    return scene;
}

// From inside closed meshes straight at their vertices and at points on their edges.
TEST(Watertight, RaysAtVerticesAndEdgesDoNotLeak) {
    Random random(3);
    const TestGeometry scene = closed_meshes(random);
    std::vector<Ray> rays;
    std::vector<std::uint32_t> aimed_at;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (int repeat = 0; repeat < 150; ++repeat) {
            const Vec3 from =
                transform_point(instance.to_world, random.in_box(repeat == 0 ? 0.0f : 0.3f));
            for (const UVec3& t : mesh.triangles) {
                const float at = random.uniform();
                for (const float s : {0.0f, 1.0f, 0.5f, at}) {
                    const Vec3 p = lerp(mesh.positions[t.x], mesh.positions[t.y], s);
                    const Vec3 to = transform_point(instance.to_world, p);
                    rays.push_back({from, glm::normalize(to - from)});
                    aimed_at.push_back(i);
                }
            }
        }
    }
    const std::vector<Hit> hits = scene.trace(rays);
    std::size_t leaks = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        leaks += hits[i].instance != aimed_at[i];
    }
    EXPECT_GT(rays.size(), 1000000u);
    EXPECT_EQ(leaks, 0u);
    say_stress("rays from inside at edges and vertices: leaks",
               rays.size(),
               static_cast<double>(leaks),
               0.0);
}

// Paths that bounce about inside closed meshes never get out, though many start at edges.
TEST(Watertight, PathsStayInside) {
    Random random(5);
    const TestGeometry scene = closed_meshes(random);
    std::size_t leaks = 0;
    std::size_t segments = 0;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (int path = 0; path < 3000; ++path) {
            const UVec3& t = mesh.triangles[random.index(mesh.triangles.size())];
            const Vec3 edge = lerp(mesh.positions[t.x], mesh.positions[t.y], random.uniform());
            Ray ray;
            ray.origin = transform_point(instance.to_world, random.in_box(0.3f));
            ray.direction = glm::normalize(transform_point(instance.to_world, edge) - ray.origin);
            for (int bounce = 0; bounce < 10; ++bounce) {
                const Hit hit = scene.trace(ray);
                ++segments;
                if (hit.instance != i) {
                    ++leaks;
                    break;
                }
                const SurfaceInteraction si = scene.interaction(ray, hit);
                Vec3 wi = random.direction();
                wi = glm::dot(wi, si.ng) < 0.0f ? -wi : wi;
                ray = {offset_ray_origin(si.p, si.ng, si.p_error, wi), wi};
            }
        }
    }
    EXPECT_GT(segments, 100000u);
    EXPECT_EQ(leaks, 0u);
    say_stress(
        "parts of paths inside closed meshes: leaks", segments, static_cast<double>(leaks), 0.0);
}

}  // namespace
}  // namespace pharos::testing
