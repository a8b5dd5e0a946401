#include "core/math.h"

#include <gtest/gtest.h>

#include "core/color.h"

namespace pharos {
namespace {

TEST(Frame, IsOrthonormalAndRightHandedEverywhere) {
    for (float z : {-1.0f, -0.99999994f, -0.5f, -0.0f, 0.0f, 1e-20f, 0.5f, 1.0f}) {
        for (float phi = 0.0f; phi < 6.3f; phi += 0.37f) {
            const float r = safe_sqrt(1.0f - z * z);
            const Frame frame = Frame::from_z(Vec3(r * std::cos(phi), r * std::sin(phi), z));
            EXPECT_NEAR(glm::dot(frame.x, frame.y), 0.0f, 2e-6f);
            EXPECT_NEAR(glm::dot(frame.x, frame.z), 0.0f, 2e-6f);
            EXPECT_NEAR(glm::length(frame.x), 1.0f, 2e-6f);
            EXPECT_NEAR(glm::length(glm::cross(frame.x, frame.y) - frame.z), 0.0f, 4e-6f);
            const Vec3 v(0.3f, -0.2f, 0.9f);
            EXPECT_NEAR(glm::distance(frame.to_world(frame.to_local(v)), v), 0.0f, 4e-6f);
        }
    }
}

TEST(NormalizeOr, FallsBackWhereThereIsNoDirection) {
    const Vec3 up(0, 0, 1);
    EXPECT_EQ(normalize_or(Vec3(0.0f), up), up);
    EXPECT_EQ(normalize_or(Vec3(NAN, 1, 0), up), up);
    EXPECT_EQ(normalize_or(Vec3(kInfinity, 1, 0), up), up);
    EXPECT_NEAR(glm::length(normalize_or(Vec3(1e-10f, 2e-10f, 0), up)), 1.0f, 1e-6f);
}

TEST(TransformNormal, StaysPerpendicularUnderShearAndMirror) {
    Mat4 m(1.0f);
    m[0] = Vec4(2, 0, 0, 0);
    m[1] = Vec4(0.7f, -1, 0, 0);
    m[2] = Vec4(0, 0.3f, 0.5f, 0);
    const Vec3 n = transform_normal(glm::inverse(m), Vec3(0, 0, 1));
    for (const Vec3& tangent : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(3, -2, 0)}) {
        EXPECT_NEAR(glm::dot(n, transform_vector(m, tangent)), 0.0f, 1e-6f);
    }
}

TEST(Color, TransferCurveRoundTrips) {
    for (int i = 0; i <= 255; ++i) {
        const float v = static_cast<float>(i) / 255.0f;
        EXPECT_NEAR(linear_to_srgb(srgb_to_linear(v)), v, 2e-6f);
    }
    EXPECT_NEAR(srgb_to_linear(0.5f), 0.21404114f, 1e-6f);
    EXPECT_FLOAT_EQ(luminance(Rgb(1.0f)), 1.0f);
}

}  // namespace
}  // namespace pharos
