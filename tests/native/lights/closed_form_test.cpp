// Reflected radiance of a white plane under each lamp against its closed form, for the formulas of
// both generations of Blender, by light sampling and by chance hits.

#include "lights_support.h"

namespace pharos {

namespace {

using test::lamp_above;
using test::make_sampler;
using test::plane_point;

constexpr double kPiD = std::numbers::pi;
constexpr double kPower = 100.0;
constexpr double kHeight = 2.0;
constexpr double kTolerance = 0.002;

// Both estimators of the plane's radiance against `expected`.
void expect_radiance(const LightDescription& lamp,
                     std::uint32_t version,
                     double expected,
                     bool hits = true) {
    SCOPED_TRACE("version " + std::to_string(version));
    const LightSampler sampler = make_sampler(lamp, version);
    const double sampled = test::sampled_radiance(sampler, plane_point(), 400);
    EXPECT_NEAR(sampled / expected, 1.0, kTolerance);
    if (hits) {
        EXPECT_NEAR(test::hit_radiance(sampler, plane_point(), 1000) / expected, 1.0, kTolerance);
    }
}

TEST(ClosedForm, PointWithoutRadius) {
    const double expected = kPower / (4 * kPiD) / (kHeight * kHeight) / kPiD;
    EXPECT_NEAR(expected, 0.63326, 1e-5);
    for (const std::uint32_t version : {304u, 400u, 405u}) {
        expect_radiance(lamp_above(LightType::Point), version, expected, false);
    }
}

TEST(ClosedForm, PointSphereFrom40) {
    LightDescription lamp = lamp_above(LightType::Point);
    lamp.radius = 0.5f;
    expect_radiance(lamp, 400, 0.63326);
    expect_radiance(lamp, 405, 0.63326);
    lamp.soft_falloff = true;  // the switch does not exist in 4.0
    expect_radiance(lamp, 400, 0.63326);
}

TEST(ClosedForm, PointDiscBefore40AndWithSoftFalloff) {
    LightDescription lamp = lamp_above(LightType::Point);
    lamp.radius = 0.5f;
    const double expected = kPower / (4 * kPiD) / kPiD / (0.25 + kHeight * kHeight);
    EXPECT_NEAR(expected, 0.59601, 1e-5);
    expect_radiance(lamp, 304, expected);
    lamp.soft_falloff = true;
    expect_radiance(lamp, 401, expected);
    expect_radiance(lamp, 405, expected);
}

TEST(ClosedForm, PointWithoutNormalization) {
    LightDescription lamp = lamp_above(LightType::Point);
    lamp.radius = 0.5f;
    lamp.normalize = false;
    expect_radiance(lamp, 405, 0.63326 * kPiD * 0.25);
}

// The receiver sees the spot 20 degrees off its axis.
LightDescription spot_off_axis(double cone_degrees, float blend) {
    LightDescription lamp = lamp_above(LightType::Spot);
    lamp.to_world[3] = Vec4(static_cast<float>(kHeight * std::tan(20.0 * kPiD / 180.0)), 0, 2, 1);
    lamp.spot_angle = static_cast<float>(cone_degrees * kPiD / 180.0);
    lamp.spot_blend = blend;
    return lamp;
}

TEST(ClosedForm, Spot) {
    expect_radiance(spot_off_axis(45, 0.15f), 304, 0.49377, false);
    expect_radiance(spot_off_axis(45, 0.15f), 305, 0.52546, false);
    expect_radiance(spot_off_axis(45, 0.15f), 405, 0.52546, false);
    expect_radiance(spot_off_axis(60, 1.0f), 304, 0.28369, false);
    expect_radiance(spot_off_axis(60, 1.0f), 405, 0.30190, false);
}

TEST(ClosedForm, SpotBlendZeroIsAStep) {
    expect_radiance(spot_off_axis(40.2, 0.0f), 405, 0.52546, false);
    const LightSampler outside = make_sampler(spot_off_axis(39.8, 0.0f), 405);
    EXPECT_FALSE(outside.sample(plane_point(), 0.5f, Vec2(0.5f)));
}

// A spot stretched 3 : 1 along x reaches 3 times as far there, from 3.5 on.
TEST(ClosedForm, SpotFollowsObjectScaleFrom35) {
    LightDescription lamp = spot_off_axis(20, 0.0f);
    lamp.to_world[0] *= 3.0f;
    EXPECT_FALSE(make_sampler(lamp, 304).sample(plane_point(), 0.5f, Vec2(0.5f)));
    expect_radiance(lamp, 305, 0.52546, false);
    expect_radiance(lamp, 405, 0.52546, false);
}

// Form factor integral of a rectangle parallel to the plane, midpoint rule.
double rectangle_factor(double side_u, double side_v) {
    constexpr int kSteps = 1000;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const double x = ((i + 0.5) / kSteps - 0.5) * side_u;
            const double y = ((j + 0.5) / kSteps - 0.5) * side_v;
            const double d2 = x * x + y * y + kHeight * kHeight;
            sum += kHeight * kHeight / (d2 * d2);
        }
    }
    return sum * side_u * side_v / kSteps / kSteps / kPiD;
}

TEST(ClosedForm, AreaRectangle) {
    LightDescription lamp = lamp_above(LightType::Area);
    expect_radiance(lamp, 304, 1.83694);
    expect_radiance(lamp, 405, 2.33887);
    // Extents are the object's scale times the size, also mirrored.
    lamp.size_u = 3.0f;
    lamp.to_world[0] *= -2.0f;
    lamp.size_v = 0.25f;
    lamp.to_world[1] *= 2.0f;
    const double factor = rectangle_factor(6.0, 0.5);
    expect_radiance(lamp, 304, kPower / (4 * 3.0) * factor);
    expect_radiance(lamp, 405, kPower / (kPiD * 3.0) * factor);
    lamp.normalize = false;
    expect_radiance(lamp, 405, kPower / kPiD * factor);
}

TEST(ClosedForm, AreaEllipse) {
    LightDescription lamp = lamp_above(LightType::Area);
    lamp.shape = AreaShape::Ellipse;
    expect_radiance(lamp, 304, 1.87241);
    expect_radiance(lamp, 405, 2.38403);
}

TEST(ClosedForm, AreaSpread) {
    LightDescription lamp = lamp_above(LightType::Area);
    lamp.spread = kPi / 3;
    expect_radiance(lamp, 304, 13.3124);
    expect_radiance(lamp, 405, 16.9498);
}

// Below a wide lamp with narrow spread: exitance S / A arrives undiminished.
TEST(ClosedForm, NarrowSpreadAndBeamKeepTheFlux) {
    for (const AreaShape shape : {AreaShape::Rectangle, AreaShape::Ellipse}) {
        LightDescription lamp = lamp_above(LightType::Area);
        lamp.shape = shape;
        lamp.size_u = lamp.size_v = 4.0f;
        const double area = shape == AreaShape::Rectangle ? 16.0 : 4.0 * kPiD;
        for (const float spread : {0.6f, 0.09f, 0.02f}) {
            lamp.spread = spread;
            expect_radiance(lamp, 405, kPower / area / kPiD, spread > 0.5f);
            expect_radiance(lamp, 304, kPower / area / 4.0, spread > 0.5f);
        }
        lamp.spread = 0.0f;
        expect_radiance(lamp, 405, kPower / area / kPiD, false);
        expect_radiance(lamp, 304, kPower / area / 4.0, false);
    }
}

TEST(ClosedForm, AreaIsOneSided) {
    LightDescription lamp = lamp_above(LightType::Area, -2.0f);
    for (const std::uint32_t version : {304u, 405u}) {
        const LightSampler sampler = make_sampler(lamp, version);
        LightSampleContext context = plane_point();
        context.transmits = true;
        EXPECT_FALSE(sampler.sample(context, 0.5f, Vec2(0.3f)));
        EXPECT_FALSE(sampler.intersect_lamps({Vec3(0.0f), Vec3(0, 0, -1)}, &context));
    }
}

TEST(ClosedForm, Sun) {
    LightDescription sun = lamp_above(LightType::Sun);
    const auto radians = [](double degrees) { return static_cast<float>(degrees * kPiD / 180.0); };
    expect_radiance(sun, 304, 1.0 / kPiD, false);
    expect_radiance(sun, 405, 1.0 / kPiD, false);
    sun.angle = radians(0.526);
    expect_radiance(sun, 304, 1.0 / kPiD, false);
    expect_radiance(sun, 405, 1.0 / kPiD, false);
    sun.angle = radians(10);
    expect_radiance(sun, 304, 0.31770);
    expect_radiance(sun, 405, 1.0 / kPiD);
    sun.angle = radians(90);
    expect_radiance(sun, 304, 0.26370);
    expect_radiance(sun, 405, 1.0 / kPiD);
    sun.angle = radians(180);
    expect_radiance(sun, 405, 1.0 / kPiD);
}

// A point inside of a sphere lamp sees its radiance all around.
TEST(ClosedForm, InsideOfASphere) {
    LightDescription lamp = lamp_above(LightType::Point, 0.5f);
    lamp.radius = 2.0f;
    expect_radiance(lamp, 405, kPower / (4 * kPiD * kPiD * 4.0));
    LightSampleContext context = plane_point();
    context.transmits = true;
    const LightSampler sampler = make_sampler(lamp, 405);
    EXPECT_NEAR(
        test::sampled_radiance(sampler, context, 400), kPower / (4 * kPiD * kPiD * 4.0), 2e-3);
}

}  // namespace

}  // namespace pharos
