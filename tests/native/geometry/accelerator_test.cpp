#include "geometry/accelerator.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include "geometry/mesh_trees.h"
#include "random_scene.h"
#include "support/description_builders.h"
#include "support/timing.h"

namespace pharos::testing {
namespace {

struct ExactHit {
    double t = std::numeric_limits<double>::infinity();
    double edge = 1.0;  // smallest barycentric: small ones may go either way in float
    std::uint32_t instance = kNone;
    std::uint32_t triangle = kNone;
};

// Moeller and Trumbore's test in double on world-space triangles, all of them.
ExactHit brute_force(const TestGeometry& scene, const Ray& ray) {
    ExactHit best;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
        const glm::dmat4 m(scene.instances[i].to_world);
        const auto corner = [&](std::uint32_t index) {
            return glm::dvec3(m * glm::dvec4(glm::dvec3(mesh.positions[index]), 1.0));
        };
        for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
            const UVec3& t = mesh.triangles[k];
            const glm::dvec3 p0 = corner(t.x);
            const glm::dvec3 e1 = corner(t.y) - p0;
            const glm::dvec3 e2 = corner(t.z) - p0;
            const glm::dvec3 d(ray.direction);
            const glm::dvec3 s = glm::dvec3(ray.origin) - p0;
            const glm::dvec3 h = glm::cross(d, e2);
            const glm::dvec3 q = glm::cross(s, e1);
            const double a = glm::dot(e1, h);
            const double u = glm::dot(s, h) / a;
            const double v = glm::dot(d, q) / a;
            const double distance = glm::dot(e2, q) / a;
            if (u >= 0 && v >= 0 && u + v <= 1 && distance > 0 && distance < best.t) {
                best = {distance, std::min(std::min(u, v), 1 - u - v), i, k};
            }
        }
    }
    return best;
}

TEST(Accelerator, HitsAreThoseOfBruteForce) {
    Random random(1);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 60, 1.0f, 0.5f));
    scene.meshes.push_back(random_triangles(random, 60, 1.0f, 0.5f));
    scene.instances.push_back(make_instance(0, random.affine(2.0f)));
    for (int i = 0; i < 4; ++i) {
        scene.instances.push_back(make_instance(1, random.affine(3.0f)));
    }
    scene.build();
    std::size_t compared = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vec3 origin = random.in_box(6.0f);
        const Ray ray{origin, glm::normalize(random.in_box(2.0f) - origin)};
        const ExactHit exact = brute_force(scene, ray);
        const Hit hit = scene.trace(ray);
        if (exact.instance == kNone || exact.edge < 1e-5) {
            continue;
        }
        ++compared;
        ASSERT_EQ(hit.instance, exact.instance) << "ray " << i;
        ASSERT_EQ(hit.triangle, exact.triangle) << "ray " << i;
        ASSERT_NEAR(static_cast<double>(hit.t), exact.t, 2e-5);
        std::uint8_t occluded = 0;
        const Ray shorter{ray.origin, ray.direction, 0.0f, hit.t * 0.999f};
        scene.accelerator->occluded(std::span(&ray, 1), std::span(&occluded, 1));
        ASSERT_EQ(occluded, 1);
        scene.accelerator->occluded(std::span(&shorter, 1), std::span(&occluded, 1));
        ASSERT_EQ(occluded, 0);
    }
    EXPECT_GT(compared, 1500u);
}

// Camera rays as streams: the same hits, broken rays among them and chunks cut anywhere.
TEST(Accelerator, CoherentRaysHitTheSame) {
    Random random(12);
    TestGeometry scene;
    scene.meshes.push_back(sphere_mesh("sphere", Vec3(0), 1.0f, 40, 60));
    scene.meshes.push_back(box_mesh("room", Vec3(-4), Vec3(4), true));
    for (int i = 0; i < 8; ++i) {
        scene.instances.push_back(make_instance(0, random.affine(2.0f)));
    }
    scene.instances.push_back(make_instance(1, Mat4(1.0f)));
    scene.instances[3].visibility = kVisibleShadow;
    scene.build();
    std::vector<Ray> rays;
    for (int y = 0; y < 100; ++y) {
        for (int x = 0; x < 100; ++x) {
            const Vec3 to(
                0.01f * static_cast<float>(x - 50), 1, 0.01f * static_cast<float>(y - 50));
            rays.push_back({Vec3(0, -3.9f, 0), glm::normalize(to)});
            if (x % 17 == 0) {
                rays.back().direction.z = std::numeric_limits<float>::quiet_NaN();
            }
        }
    }
    const std::vector<std::uint32_t> camera(rays.size(), kVisibleCamera);
    const std::vector<Hit> single = scene.trace(rays, kVisibleCamera);
    for (const std::size_t count :
         {rays.size(), std::size_t{1}, std::size_t{63}, std::size_t{130}}) {
        std::vector<Hit> hits(count);
        scene.accelerator->intersect(
            std::span(rays).first(count), camera, hits, RayOrder::Coherent);
        for (std::size_t i = 0; i < count; ++i) {
            ASSERT_EQ(hits[i].instance, single[i].instance) << i;
            ASSERT_EQ(hits[i].triangle, single[i].triangle) << i;
            if (single[i].instance != kNone) {
                ASSERT_NEAR(hits[i].t, single[i].t, 1e-5f) << i;
                ASSERT_NEAR(hits[i].u, single[i].u, 1e-4f) << i;
            }
        }
    }
}

// Shadow rays in batches of any size say what the nearest hit says: on closed surfaces, many of
// them through edges and corners, broken rays among them.
TEST(Accelerator, ShadowRaysAgreeWithNearestHits) {
    Random random(21);
    TestGeometry scene;
    scene.meshes.push_back(sphere_mesh("sphere", Vec3(0), 1.0f, 20, 30));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    scene.instances.push_back(make_instance(0, random.affine(2.0f)));
    scene.build();
    const std::vector<Vec3>& corners = scene.meshes[0].positions;
    std::vector<Ray> rays;
    for (int i = 0; i < 20000; ++i) {
        const Vec3& corner = corners[random.index(corners.size())];
        const Vec3& other = corners[random.index(corners.size())];
        const Vec3 origin = random.in_box(4.0f);
        const Vec3 to = i % 3 == 0   ? corner
                        : i % 3 == 1 ? glm::mix(corner, other, random.uniform())
                                     : random.in_box(2.0f);
        rays.push_back({origin, glm::normalize(to - origin)});
        rays.back().t_max = random.uniform(0.0f, 6.0f);
        if (i % 97 == 0) {
            rays.back().origin.y = std::numeric_limits<float>::infinity();
        }
    }
    const std::vector<Hit> nearest = scene.trace(rays, kVisibleShadow);
    std::size_t stopped = 0;
    for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{16}, rays.size()}) {
        for (std::size_t begin = 0; begin < rays.size(); begin += size) {
            const auto part = std::span(rays).subspan(begin, std::min(size, rays.size() - begin));
            std::vector<std::uint8_t> occluded(part.size(), 2);
            scene.accelerator->occluded(part, occluded);
            for (std::size_t i = 0; i < part.size(); ++i) {
                const bool hit = nearest[begin + i].instance != kNone;
                ASSERT_EQ(occluded[i], hit ? 1 : 0) << "ray " << begin + i << " of " << size;
                stopped += hit ? 1 : 0;
            }
        }
    }
    EXPECT_GT(stopped, rays.size());
}

// Rays from inside of a closed box to the edges of its triangles, diagonals among them.
TEST(Accelerator, NoShadowRayPassesThroughACommonEdge) {
    TestGeometry scene;
    scene.meshes.push_back(box_mesh("room", Vec3(-2, 0, 0), Vec3(2, 4, 2.5), true));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    scene.build();
    Random random(5);
    const std::vector<Vec3>& corners = scene.meshes[0].positions;
    std::vector<Ray> rays;
    for (int i = 0; i < 200000; ++i) {
        const UVec3& t = scene.meshes[0].triangles[random.index(12)];
        const Vec3 to = glm::mix(corners[t.x], corners[i % 2 == 0 ? t.y : t.z], random.uniform());
        const Vec3 origin(
            random.uniform(-1.9f, 1.9f), random.uniform(0.1f, 3.9f), random.uniform(0.1f, 2.4f));
        rays.push_back({origin, glm::normalize(to - origin)});
    }
    std::vector<std::uint8_t> occluded(rays.size());
    scene.accelerator->occluded(rays, occluded);
    EXPECT_EQ(std::ranges::count(occluded, 1), std::ssize(occluded));
}

TEST(Accelerator, BarycentricsGiveTheHitPoint) {
    Random random(2);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 200, 1.0f, 0.5f));
    scene.instances.push_back(make_instance(0, random.affine(1.0f)));
    scene.instances.push_back(make_instance(0, random.affine(1.0f)));
    scene.build();
    for (int i = 0; i < 2000; ++i) {
        const Ray ray{random.in_box(5.0f), random.direction()};
        const Hit hit = scene.trace(ray);
        if (hit.instance == kNone) {
            EXPECT_EQ(hit.t, kInfinity);
            continue;
        }
        const Vec3 p = scene.interaction(ray, hit).p;
        ASSERT_LT(glm::length(p - (ray.origin + ray.direction * hit.t)), 1e-4f);
    }
}

TEST(Accelerator, RespectsTheInterval) {
    TestGeometry scene;
    scene.meshes.push_back(quad_mesh("q", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    scene.build();
    const Vec3 origin(0.1f, 0.2f, 3.0f);
    const Vec3 down(0, 0, -1);
    EXPECT_FLOAT_EQ(scene.trace(Ray{origin, down}).t, 3.0f);
    EXPECT_EQ(scene.trace(Ray{origin, down, 3.1f}).instance, kNone);
    EXPECT_EQ(scene.trace(Ray{origin, down, 0.0f, 2.9f}).instance, kNone);
    EXPECT_EQ(scene.trace(Ray{origin, down, 0.0f, 3.1f}).instance, 0u);
    EXPECT_EQ(scene.trace(Ray{origin, down, 4.0f, 1.0f}).instance, kNone);
    EXPECT_EQ(scene.trace(Ray{origin, -down}).instance, kNone);
}

// Nor do those from so far away that Embree's own assertions would end the program.
TEST(Accelerator, NonFiniteRaysMiss) {
    TestGeometry scene;
    scene.meshes.push_back(box_mesh("box", Vec3(-1), Vec3(1)));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    scene.build();
    const Ray good{Vec3(0.1f, 0.2f, 0.3f), glm::normalize(Vec3(1, 2, 3))};
    ASSERT_EQ(scene.trace(good).instance, 0u);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float bad : {nan, kInfinity, -kInfinity, 2e18f, -2e18f}) {
        for (int member = 0; member < 8; ++member) {
            Ray ray = good;
            float* values[] = {&ray.origin.x,
                               &ray.origin.y,
                               &ray.origin.z,
                               &ray.direction.x,
                               &ray.direction.y,
                               &ray.direction.z,
                               &ray.t_min,
                               &ray.t_max};
            if (values[member] == &ray.t_max && bad > 0.0f) {
                continue;  // no far end
            }
            if (values[member] == &ray.t_min && bad < 0.0f) {
                continue;
            }
            *values[member] = bad;
            EXPECT_EQ(scene.trace(ray).instance, kNone) << "member " << member << " " << bad;
            Hit hit;
            const std::uint32_t all = ~0u;
            scene.accelerator->intersect(
                std::span(&ray, 1), std::span(&all, 1), std::span(&hit, 1), RayOrder::Coherent);
            EXPECT_EQ(hit.instance, kNone) << "member " << member << " " << bad;
            std::uint8_t occluded = 7;
            scene.accelerator->occluded(std::span(&ray, 1), std::span(&occluded, 1));
            EXPECT_EQ(occluded, 0) << "member " << member << " " << bad;
        }
    }
    Ray standing = good;
    standing.direction = Vec3(0.0f);
    const Hit hit = scene.trace(standing);
    EXPECT_TRUE(hit.instance == kNone || hit.instance == 0u);
}

TEST(Accelerator, BrokenTrianglesAreHarmless) {
    TestGeometry scene;
    Mesh mesh = box_mesh("box", Vec3(-1), Vec3(1));
    const auto corner = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.emplace_back(0.5f);
    mesh.positions.emplace_back(std::numeric_limits<float>::quiet_NaN());
    mesh.positions.emplace_back(kInfinity);
    mesh.positions.emplace_back(3e38f);
    mesh.triangles.emplace_back(corner, corner, corner);  // a point
    mesh.triangles.emplace_back(0, 1, 1);                 // a line
    mesh.triangles.emplace_back(0, 1, corner + 1);
    mesh.triangles.emplace_back(0, 1, corner + 2);
    mesh.triangles.emplace_back(0, 1, corner + 3);
    mesh.triangles.emplace_back(0, 1, 1000000);
    scene.meshes.push_back(std::move(mesh));
    for (int i = 0; i < 2; ++i) {
        scene.instances.push_back(make_instance(0, Mat4(1.0f)));
        scene.build();
        Random random(4);
        for (int k = 0; k < 1000; ++k) {
            const Ray ray{random.in_box(0.4f), random.direction()};
            const Hit hit = scene.trace(ray);
            ASSERT_LT(hit.triangle, 12u);
            ASSERT_TRUE(std::isfinite(hit.t));
        }
    }
}

TEST(Accelerator, NothingToHit) {
    TestGeometry none;
    none.build();
    EXPECT_EQ(none.trace(Ray{Vec3(0), Vec3(0, 0, 1)}).instance, kNone);
    EXPECT_TRUE(none.accelerator->bounds().empty());

    TestGeometry hollow;
    hollow.meshes.resize(2);
    hollow.meshes[1].positions.emplace_back(1.0f);
    for (const std::uint32_t mesh : {0u, 0u, 1u}) {
        hollow.instances.push_back(make_instance(mesh, Mat4(1.0f)));
    }
    hollow.build();
    EXPECT_EQ(hollow.trace(Ray{Vec3(0), Vec3(0, 0, 1)}).instance, kNone);
}

TEST(Accelerator, VisibilityHidesInstances) {
    for (const bool shared : {false, true}) {
        TestGeometry scene;
        for (std::uint32_t i = 0; i < 3; ++i) {
            const Mat4 down = glm::translate(Mat4(1.0f), Vec3(0, 0, -1.0f - static_cast<float>(i)));
            if (!shared || i == 0) {
                scene.meshes.push_back(
                    quad_mesh("q", Vec3(-1, -1, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)));
            }
            scene.instances.push_back(make_instance(shared ? 0 : i, down));
        }
        scene.instances[0].visibility = kVisibleGlossy | kVisibleDiffuse;
        scene.instances[1].visibility = kVisibleGlossy | kVisibleShadow;
        scene.instances[2].visibility = kVisibleAll & ~kVisibleShadow;
        scene.build();
        const Ray ray{Vec3(0.3f, 0.2f, 0.0f), Vec3(0, 0, -1)};
        EXPECT_EQ(scene.trace(ray, kVisibleCamera).instance, 2u);
        EXPECT_EQ(scene.trace(ray, kVisibleGlossy).instance, 0u);
        EXPECT_EQ(scene.trace(ray, kVisibleTransmission).instance, 2u);
        EXPECT_EQ(scene.trace(ray, kVisibleShadow).instance, 1u);
        EXPECT_EQ(scene.trace(ray, 0).instance, kNone);
        const std::vector<Ray> rays = {
            ray, {ray.origin, ray.direction, 0.0f, 1.5f}, {ray.origin, ray.direction, 2.5f, 9.0f}};
        std::vector<std::uint8_t> occluded(3);
        scene.accelerator->occluded(rays, occluded);
        EXPECT_EQ(occluded, (std::vector<std::uint8_t>{1, 0, 0}));
    }
}

TEST(Accelerator, BoundsAndBytes) {
    TestGeometry scene;
    scene.meshes.push_back(box_mesh("box", Vec3(-1, -2, -3), Vec3(1, 2, 3)));
    scene.instances.push_back(make_instance(0, glm::translate(Mat4(1.0f), Vec3(10, 0, 0))));
    scene.build();
    const Bounds3 b = scene.accelerator->bounds();
    EXPECT_LT(glm::length(b.lower - Vec3(9, -2, -3)), 1e-4f);
    EXPECT_LT(glm::length(b.upper - Vec3(11, 2, 3)), 1e-4f);
    const std::uint64_t small = scene.accelerator->bytes();
    EXPECT_GT(small, 0u);
    Random random(1);
    scene.meshes[0] = random_triangles(random, 20000, 1.0f, 0.1f);
    scene.build();
    EXPECT_GT(scene.accelerator->bytes(), 20000u * 48);
    EXPECT_LT(scene.accelerator->bytes(), 20000u * 1000);
}

TEST(Accelerator, ManyBuildsGiveTheMemoryBack) {
    Random random(6);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 2000, 1.0f, 0.2f));
    scene.meshes.push_back(random_triangles(random, 2000, 1.0f, 0.2f));
    for (const std::uint32_t mesh : {0u, 1u, 1u}) {
        scene.instances.push_back(make_instance(mesh, random.affine(1.0f)));
    }
    std::optional<std::uint64_t> bytes;
    const Ray ray{Vec3(0, 0, 5), Vec3(0, 0, -1)};
    std::optional<float> t;
    for (int i = 0; i < 100; ++i) {
        scene.build();
        ASSERT_LT(scene.accelerator->bytes(), 2 * bytes.value_or(scene.accelerator->bytes()));
        bytes = scene.accelerator->bytes();
        ASSERT_EQ(scene.trace(ray).t, t.value_or(scene.trace(ray).t));
        t = scene.trace(ray).t;
    }
}

// Embree's own count of its memory is the cap, wherever in a build it is reached.
TEST(Accelerator, TakesNoMoreThanItMay) {
    Random random(9);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 200000, 10.0f, 0.1f));
    for (std::size_t uses = 1; uses <= 2; ++uses) {
        scene.instances.push_back(make_instance(0, random.affine(1.0f)));
        const auto build = [&](std::uint64_t most) {
            const Accelerator built(scene.meshes, scene.instances, CancelFlag(), nullptr, most);
            return built.bytes();
        };
        const std::uint64_t bytes = build(std::uint64_t{1} << 40);
        const Stopwatch watch;
        for (const std::uint64_t most : {std::uint64_t{0}, std::uint64_t{1} << 20, bytes / 2}) {
            EXPECT_THROW(static_cast<void>(build(most)), std::bad_alloc) << most << " of " << bytes;
        }
        EXPECT_LT(watch.seconds(), 5.0 * kSlowdown);
        EXPECT_EQ(build(8 * bytes), bytes);
    }
}

// What is kept from before counts no more: only what a build adds.
TEST(Accelerator, KeptTreesAreWithinTheCap) {
    Random random(10);
    TestGeometry scene;
    for (std::uint64_t i = 0; i < 2; ++i) {
        scene.meshes.push_back(random_triangles(random, 50000, 10.0f, 0.1f));
        scene.meshes.back().version = i + 1;
    }
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    MeshTrees kept;
    const auto build = [&](std::uint64_t most) {
        const Accelerator built(scene.meshes, scene.instances, CancelFlag(), &kept, most);
        return built.bytes();
    };
    const std::uint64_t bytes = build(std::uint64_t{1} << 40);
    EXPECT_LE(build(bytes / 8), bytes);
    scene.instances.push_back(make_instance(1, Mat4(1.0f)));
    EXPECT_THROW(static_cast<void>(build(bytes / 8)), std::bad_alloc);
}

TEST(Accelerator, RefusesAnInstanceOfNoMesh) {
    TestGeometry scene;
    scene.instances.push_back(make_instance(3, Mat4(1.0f)));
    EXPECT_THROW(Accelerator(scene.meshes, scene.instances, CancelFlag()), std::invalid_argument);
}

TEST(Accelerator, LeavesTheFloatingPointStateAlone) {
    TestGeometry scene;
    scene.meshes.push_back(sphere_mesh("sphere", Vec3(0), 1.0f));
    scene.instances.push_back(make_instance(0, Mat4(1.0f)));
    for (const unsigned extra : {0u, 0x8040u}) {  // flush to zero and denormals are zero
        const unsigned before = (_mm_getcsr() & ~0x8040u) | extra;
        _mm_setcsr(before);
        scene.build();
        static_cast<void>(scene.trace(Ray{Vec3(0), Vec3(0, 0, 1)}));
        EXPECT_EQ(_mm_getcsr() & ~0x3fu, before & ~0x3fu);
        _mm_setcsr(before & ~0x8040u);
    }
}

// From the cancel to the end of the build; 0 when the build ended before it was cancelled.
double cancelled_build_seconds(const TestGeometry& scene, int delay, int& cancelled) {
    CancelFlag cancel;
    Stopwatch since_cancel;
    {
        const std::jthread canceller([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(delay));
            since_cancel = Stopwatch();
            cancel.cancel();
        });
        try {
            const Accelerator accelerator(scene.meshes, scene.instances, cancel);
            return 0.0;
        } catch (const Cancelled&) {
            ++cancelled;
        }
    }
    return since_cancel.seconds();
}

TEST(Accelerator, CancelEndsTheBuildSoon) {
    Random random(8);
    TestGeometry scene;
    scene.meshes.push_back(random_triangles(random, 2000000, 10.0f, 0.05f));
    scene.instances.push_back(make_instance(0, random.affine(1.0f)));
    constexpr double kBar = 0.25 * kSlowdown;
    int cancelled = 0;
    for (const int delay : {0, 30, 100, 200, 350, 500}) {
        const double seconds =
            least_of(kBar, [&] { return cancelled_build_seconds(scene, delay, cancelled); });
        RecordProperty("delay" + std::to_string(delay), std::to_string(seconds));
        EXPECT_LT(seconds, kBar) << "cancelled after " << delay << " ms";
    }
    EXPECT_GT(cancelled, 0);
}

TEST(Accelerator, SelfTest) {
    EXPECT_TRUE(accelerator_self_test());
}

}  // namespace
}  // namespace pharos::testing
