// Camera rays: window corners, shift, orthographic views, focus plane, aperture, clip planes.

#include "camera/camera.h"

#include <array>

#include <gtest/gtest.h>

#include "support/random.h"
#include "support/stress.h"

namespace pharos {

namespace {

using test::Random;

Mat4 pose() {
    // Looks along +x from (1, 2, 3); up is +z.
    Mat4 m(1.0f);
    m[0] = Vec4(0, -1, 0, 0);
    m[1] = Vec4(0, 0, 1, 0);
    m[2] = Vec4(-1, 0, 0, 0);
    m[3] = Vec4(1, 2, 3, 1);
    return m;
}

CameraDescription describe(CameraType type) {
    CameraDescription d;
    d.type = type;
    d.to_world = pose();
    d.window_lower = Vec2(-0.5f, -0.25f);
    d.window_upper = Vec2(0.7f, 0.35f);  // shifted
    d.near_clip = 0.1f;
    d.far_clip = 50.0f;
    return d;
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-5f) {
    EXPECT_LT(glm::length(a - b), tolerance)
        << a.x << " " << a.y << " " << a.z << " against " << b.x << " " << b.y << " " << b.z;
}

TEST(Camera, PerspectiveCorners) {
    const Camera camera(describe(CameraType::Perspective), 200, 100);
    const auto expected = [](float x, float y) {
        return glm::normalize(Vec3(1, 0, 0) + x * Vec3(0, -1, 0) + y * Vec3(0, 0, 1));
    };
    expect_near(camera.generate_ray(Vec2(0, 0), Vec2(0.5f)).direction, expected(-0.5f, -0.25f));
    expect_near(camera.generate_ray(Vec2(200, 0), Vec2(0.5f)).direction, expected(0.7f, -0.25f));
    expect_near(camera.generate_ray(Vec2(0, 100), Vec2(0.5f)).direction, expected(-0.5f, 0.35f));
    expect_near(camera.generate_ray(Vec2(100, 50), Vec2(0.5f)).direction, expected(0.1f, 0.05f));
    expect_near(camera.generate_ray(Vec2(3, 4), Vec2(0.5f)).origin, Vec3(1, 2, 3));
}

TEST(Camera, OrthographicCorners) {
    const Camera camera(describe(CameraType::Orthographic), 200, 100);
    const Ray lower = camera.generate_ray(Vec2(0, 0), Vec2(0.5f));
    const Ray upper = camera.generate_ray(Vec2(200, 100), Vec2(0.5f));
    expect_near(lower.direction, Vec3(1, 0, 0));
    expect_near(lower.origin, Vec3(1, 2.5f, 2.75f));
    expect_near(upper.origin, Vec3(1, 1.3f, 3.35f));
    EXPECT_FLOAT_EQ(lower.t_min, 0.1f);
    EXPECT_FLOAT_EQ(lower.t_max, 50.0f);
}

TEST(Camera, ClipPlanesArePlanes) {
    for (const CameraType type : {CameraType::Perspective, CameraType::Orthographic}) {
        CameraDescription d = describe(type);
        d.lens_radius = 0.2f;
        d.focus_distance = 3.0f;
        const Camera camera(d, 64, 64);
        Random random(1);
        for (int i = 0; i < 100; ++i) {
            const Ray ray = camera.generate_ray(random.uniform2() * 64.0f, random.uniform2());
            EXPECT_NEAR(camera.depth(ray.origin + ray.direction * ray.t_min), 0.1f, 1e-5f);
            EXPECT_NEAR(camera.depth(ray.origin + ray.direction * ray.t_max), 50.0f, 1e-3f);
            EXPECT_NEAR(glm::length(ray.direction), 1.0f, 1e-6f);
        }
    }
}

TEST(Camera, OrthographicViewMayBeginBehind) {
    CameraDescription d = describe(CameraType::Orthographic);
    d.near_clip = -5.0f;
    const Camera camera(d, 64, 64);
    const Ray ray = camera.generate_ray(Vec2(32, 32), Vec2(0.5f));
    EXPECT_EQ(ray.t_min, 0.0f);
    EXPECT_NEAR(camera.depth(ray.origin), -5.0f, 1e-5f);
    EXPECT_NEAR(camera.depth(ray.origin + ray.direction * ray.t_max), 50.0f, 1e-4f);
}

TEST(Camera, LensPointsMeetOnTheFocusPlane) {
    for (const CameraType type : {CameraType::Perspective, CameraType::Orthographic}) {
        for (const std::uint32_t blades : {0u, 5u}) {
            CameraDescription d = describe(type);
            const Camera pinhole(d, 64, 64);
            d.lens_radius = 0.3f;
            d.focus_distance = 4.0f;
            d.aperture_blades = blades;
            const Camera camera(d, 64, 64);
            Random random(2);
            for (int i = 0; i < 50; ++i) {
                const Vec2 pixel = random.uniform2() * 64.0f;
                const Ray center = pinhole.generate_ray(pixel, Vec2(0.5f));
                const Vec3 focus =
                    center.origin +
                    center.direction * (4.0f / glm::dot(center.direction, Vec3(1, 0, 0)));
                for (int k = 0; k < 10; ++k) {
                    const Ray ray = camera.generate_ray(pixel, random.uniform2());
                    const Vec3 to_focus = focus - ray.origin;
                    EXPECT_LT(glm::length(glm::cross(to_focus, ray.direction)), 1e-5f);
                }
            }
        }
    }
}

// Moments of the aperture: disc r^2 / 4 on each axis; a square of circumradius r has r^2 / 6.
TEST(Camera, ApertureShapes) {
    const auto moments = [](std::uint32_t blades, float ratio, float rotation) {
        CameraDescription d = describe(CameraType::Perspective);
        d.lens_radius = 2.0f;
        d.aperture_blades = blades;
        d.aperture_ratio = ratio;
        d.aperture_rotation = rotation;
        const Camera camera(d, 64, 64);
        Random random(3);
        double xx = 0.0;
        double yy = 0.0;
        float reach = 0.0f;
        constexpr int kSamples = 200000;
        for (int i = 0; i < kSamples; ++i) {
            const Vec3 offset =
                camera.generate_ray(Vec2(20, 20), random.uniform2()).origin - Vec3(1, 2, 3);
            xx += static_cast<double>(offset.y * offset.y);
            yy += static_cast<double>(offset.z * offset.z);
            reach = std::max(reach, glm::length(offset));
        }
        return Vec3(static_cast<float>(xx / kSamples), static_cast<float>(yy / kSamples), reach);
    };
    Vec3 m = moments(0, 1.0f, 0.0f);
    EXPECT_NEAR(m.x, 1.0f, 0.01f);
    EXPECT_NEAR(m.y, 1.0f, 0.01f);
    EXPECT_NEAR(m.z, 2.0f, 0.01f);
    m = moments(4, 1.0f, 0.3f);
    EXPECT_NEAR(m.x, 4.0f / 6.0f, 0.01f);
    EXPECT_NEAR(m.y, 4.0f / 6.0f, 0.01f);
    EXPECT_NEAR(m.z, 2.0f, 0.02f);
    m = moments(0, 2.0f, 0.0f);
    EXPECT_NEAR(m.x, 0.25f, 0.005f);
    EXPECT_NEAR(m.y, 1.0f, 0.01f);
}

TEST(Camera, WorldToCamera) {
    const Camera camera(describe(CameraType::Perspective), 64, 64);
    const Mat4 m = camera.world_to_camera();
    expect_near(transform_point(m, Vec3(1, 2, 3)), Vec3(0.0f));
    expect_near(transform_point(m, Vec3(6, 2, 3)), Vec3(0, 0, -5));
    expect_near(transform_point(m, Vec3(1, 1, 5)), Vec3(1, 2, 0));
    EXPECT_FLOAT_EQ(camera.depth(Vec3(6, 0, 0)), 5.0f);
}

TEST(Camera, BadDescriptionsGiveFiniteRays) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<CameraDescription> bad(9, describe(CameraType::Perspective));
    bad[0].to_world = Mat4(0.0f);
    bad[1].to_world[3].x = nan;
    bad[2].to_world[0] = Vec4(nan);
    bad[3].window_lower = Vec2(nan);
    bad[4].window_upper = bad[4].window_lower;
    bad[5].near_clip = nan;
    bad[5].far_clip = nan;
    bad[6].lens_radius = 0.1f;
    bad[6].focus_distance = 0.0f;
    bad[7].lens_radius = nan;
    bad[7].aperture_ratio = 0.0f;
    bad[8].near_clip = 10.0f;
    bad[8].far_clip = 1.0f;
    for (CameraDescription d : bad) {
        for (const CameraType type : {CameraType::Perspective, CameraType::Orthographic}) {
            d.type = type;
            for (const std::uint32_t size : {0u, 1u, 64u}) {
                const Ray ray = Camera(d, size, size).generate_ray(Vec2(0.5f), Vec2(0.2f, 0.9f));
                EXPECT_TRUE(is_finite(ray.origin) && is_finite(ray.direction));
                EXPECT_NEAR(glm::length(ray.direction), 1.0f, 1e-4f);
                EXPECT_TRUE(ray.t_min >= 0.0f && ray.t_max > ray.t_min);
            }
        }
    }
}

// Extremes that scene building lets pass: rays are numbers, and their clip range is one.
TEST(Camera, AnyParametersGiveRays) {
    constexpr std::array<float, 10> kExtremes{
        0.0f, 1e-20f, 1e-7f, 1e-3f, 0.5f, 1.0f, 100.0f, 1e6f, 1e15f, 1e20f};
    const std::uint64_t tries = testing::case_count(100000, 10000000);
    std::uint64_t bad = 0;
    Random random(8);
    for (std::uint64_t i = 0; i < tries; i += 10) {
        const auto wild = [&] {
            return random.index(2) == 0 ? random.uniform(0.0f, 3.0f) : kExtremes[random.index(10)];
        };
        CameraDescription d = describe(static_cast<CameraType>(random.index(2)));
        d.lens_radius = wild();
        d.focus_distance = wild();
        d.aperture_ratio = wild();
        d.aperture_blades = random.index(12);
        d.aperture_rotation = wild();
        d.near_clip = wild();
        d.far_clip = wild();
        d.window_upper = d.window_lower + Vec2(wild(), wild());
        const Camera camera(d, 1 + random.index(4000), 1 + random.index(4000));
        for (int k = 0; k < 10; ++k) {
            const Ray ray = camera.generate_ray(random.uniform2() * 4000.0f, random.uniform2());
            const bool good = is_finite(ray.origin) &&
                              std::abs(length_squared(ray.direction) - 1.0f) < 1e-4f &&
                              ray.t_min >= 0.0f && ray.t_max >= 0.0f;
            bad += good ? 0 : 1;
            EXPECT_TRUE(good) << "case " << i + static_cast<std::uint64_t>(k);
        }
        ASSERT_LT(bad, 5u);
    }
    testing::say_stress("camera: rays that are none", tries, static_cast<double>(bad), 0.0);
}

}  // namespace

}  // namespace pharos
