// Every lamp's sampled directions against the density that a chance hit at the same direction has.

#include <cmath>

#include "lights_support.h"
#include "support/chi_square.h"

namespace pharos {

namespace {

using test::hit_along;
using test::lamp_above;
using test::make_sampler;
using test::Random;

struct LampCase {
    std::string name;
    LightDescription lamp;
    std::uint32_t version = 405;
    LightSampleContext context{Vec3(0.0f), Vec3(0, 0, 1), false};
    int fine = 48;  // steps of integration across a cell of the chi-square test
};

Mat4 turned(const Vec3& position, const Vec3& shine_along) {
    const Frame frame = Frame::from_z(-glm::normalize(shine_along));
    Mat4 m(1.0f);
    m[0] = Vec4(frame.x, 0);
    m[1] = Vec4(frame.y, 0);
    m[2] = Vec4(frame.z, 0);
    m[3] = Vec4(position, 1);
    return m;
}

LampCase area_case(const std::string& name,
                   const Vec2& size,
                   const Vec3& position,
                   float spread = kPi) {
    LampCase c{name, lamp_above(LightType::Area)};
    c.lamp.to_world = turned(position, -position);
    c.lamp.size_u = size.x;
    c.lamp.size_v = size.y;
    c.lamp.spread = spread;
    return c;
}

std::vector<LampCase> bulb_cases() {
    std::vector<LampCase> cases;
    for (const std::uint32_t version : {304u, 405u}) {
        for (const float radius : {0.01f, 0.5f, 1.9f}) {
            LampCase c{"bulb " + std::to_string(radius), lamp_above(LightType::Point), version};
            c.lamp.radius = radius;
            cases.push_back(c);
            c.name = "spot " + std::to_string(radius);
            c.lamp.type = LightType::Spot;
            c.lamp.spot_angle = 2.0f;
            c.lamp.spot_blend = 0.3f;
            cases.push_back(c);
        }
    }
    LampCase inside{"inside a sphere", lamp_above(LightType::Point, 1.0f)};
    inside.lamp.radius = 1.5f;
    cases.push_back(inside);
    inside.context.transmits = true;
    cases.push_back(inside);
    LampCase within_disc{"within a disc's radius", lamp_above(LightType::Point, 0.3f), 304};
    within_disc.lamp.radius = 1.5f;
    cases.push_back(within_disc);
    return cases;
}

std::vector<LampCase> area_cases() {
    std::vector<LampCase> cases;
    cases.push_back(area_case("square", Vec2(1.0f), Vec3(0, 0, 2)));
    cases.push_back(area_case("close", Vec2(4.0f, 1.0f), Vec3(0.1f, 0.2f, 0.3f)));
    cases.push_back(area_case("far", Vec2(0.2f, 0.1f), Vec3(3, 1, 2)));
    cases.push_back(area_case("spread", Vec2(2.0f, 1.0f), Vec3(0.5f, 0, 2), 1.0f));
    LampCase side = area_case("beside", Vec2(2.0f, 2.0f), Vec3(0, 0, 1));
    side.lamp.to_world = turned(Vec3(1.5f, 0.5f, 0.4f), Vec3(0, 0, -1));
    cases.push_back(side);
    side.name = "grazing";
    side.fine = 192;
    side.lamp.to_world = turned(Vec3(2.5f, 0, 0.1f), Vec3(0, 0, -1));
    cases.push_back(side);
    side.name = "spread beside";
    side.fine = 48;
    side.lamp.to_world = turned(Vec3(1.2f, 0.5f, 1.5f), Vec3(0, 0, -1));
    side.lamp.spread = 2.0f;
    cases.push_back(side);
    LampCase sheared = area_case("sheared", Vec2(1.0f), Vec3(0, 0, 1));
    sheared.lamp.to_world[1] += 0.7f * sheared.lamp.to_world[0];
    cases.push_back(sheared);
    const std::size_t rectangles = cases.size();
    for (std::size_t i = 0; i < rectangles; ++i) {
        LampCase ellipse = cases[i];
        ellipse.name += " ellipse";
        ellipse.lamp.shape = AreaShape::Ellipse;
        ellipse.version = i % 2 == 0 ? 405 : 304;
        cases.push_back(ellipse);
    }
    return cases;
}

std::vector<LampCase> sun_cases() {
    std::vector<LampCase> cases;
    for (const std::uint32_t version : {304u, 405u}) {
        for (const float angle : {0.001f, 0.00918f, 0.5f, 2.0f}) {
            LampCase c{"sun " + std::to_string(angle), lamp_above(LightType::Sun), version};
            c.lamp.to_world = turned(Vec3(0.0f), Vec3(0.3f, -0.5f, -1.0f));
            c.lamp.angle = angle;
            cases.push_back(c);
        }
    }
    return cases;
}

std::vector<LampCase> all_cases() {
    std::vector<LampCase> cases = bulb_cases();
    for (const auto& more : {area_cases(), sun_cases()}) {
        cases.insert(cases.end(), more.begin(), more.end());
    }
    return cases;
}

// Mean direction of samples, and the tangent-plane radius around it that holds all of them;
// infinite where they fill more than a hemisphere's core.
struct Extent {
    Frame frame;
    float radius = kInfinity;
};

Extent sample_extent(const LightSampler& sampler, const LightSampleContext& context) {
    Random random(5);
    std::vector<Vec3> directions;
    Vec3 mean(0.0f);
    for (int i = 0; i < 2000; ++i) {
        if (const auto s = sampler.sample(context, random.uniform(), random.uniform2())) {
            directions.push_back(s->sample.wi);
            mean += s->sample.wi;
        }
    }
    Extent extent{Frame::from_z(normalize_or(mean, Vec3(0, 0, 1)))};
    float radius = 0.0f;
    for (const Vec3& wi : directions) {
        const Vec3 local = extent.frame.to_local(wi);
        const float lateral = std::sqrt(local.x * local.x + local.y * local.y);
        radius = std::max(radius, local.z > 0.0f ? lateral / local.z : kInfinity);
    }
    extent.radius = radius < 3.0f ? radius * 1.15f : kInfinity;
    return extent;
}

// Directions as points of a square: on a plane across the mean direction, d(omega) = cos^3 d(area);
// or, for wide sources, (phi, z) of the sphere around it.
struct DirectionMap {
    Extent extent;

    [[nodiscard]] bool planar() const { return extent.radius < kInfinity; }

    [[nodiscard]] Vec2 to_square(const Vec3& wi) const {
        const Vec3 local = extent.frame.to_local(wi);
        if (planar()) {
            return Vec2(local.x, local.y) * (0.5f / (local.z * extent.radius)) + 0.5f;
        }
        return Vec2(std::atan2(local.y, local.x) * (0.5f * kInvPi) + 0.5f, 0.5f * local.z + 0.5f);
    }

    struct Point {
        Vec3 wi;
        float solid_angle = 0.0f;  // per area of the square
    };

    [[nodiscard]] Point from_square(const Vec2& q) const {
        if (planar()) {
            const Vec2 plane = (2.0f * q - 1.0f) * extent.radius;
            const float stretch = std::sqrt(1.0f + glm::dot(plane, plane));
            const Vec3 wi = extent.frame.to_world(Vec3(plane, 1.0f)) * (1.0f / stretch);
            return {wi, 4.0f * sqr(extent.radius / stretch) / stretch};
        }
        const float phi = (q.x - 0.5f) * 2.0f * kPi;
        const float z = 2.0f * q.y - 1.0f;
        const float r = safe_sqrt(1.0f - z * z);
        return {extent.frame.to_world(Vec3(r * std::cos(phi), r * std::sin(phi), z)), 4.0f * kPi};
    }
};

// Counts in a cell that the integration grid missed belong to a neighbour, if they are a sliver of
// it.
void merge_slivers(std::vector<double>& observed, const std::vector<double>& expected, int side) {
    for (int cell = 0; cell < side * side; ++cell) {
        const auto at = [side](int x, int y) { return static_cast<std::size_t>(y * side + x); };
        const int cx = cell % side;
        const int cy = cell / side;
        if (expected[at(cx, cy)] > 0.0 || observed[at(cx, cy)] == 0.0) {
            continue;
        }
        std::size_t best = at(cx, cy);
        for (int y = std::max(cy - 1, 0); y <= std::min(cy + 1, side - 1); ++y) {
            for (int x = std::max(cx - 1, 0); x <= std::min(cx + 1, side - 1); ++x) {
                best = expected[at(x, y)] > expected[best] ? at(x, y) : best;
            }
        }
        if (observed[at(cx, cy)] < 0.05 * expected[best] + 2.0) {
            observed[best] += observed[at(cx, cy)];
            observed[at(cx, cy)] = 0.0;
        }
    }
}

// Densities here end abruptly at outlines, so cells are integrated on a fine fixed grid.
test::ChiSquareResult chi_square(const LampCase& c, const test::ChiSquareOptions& options) {
    const LightSampler sampler = make_sampler(c.lamp, c.version);
    const DirectionMap map{sample_extent(sampler, c.context)};
    const int side = options.rows;
    const auto cells = static_cast<std::size_t>(side * side);
    std::vector<double> observed(cells + 1, 0.0);
    std::vector<double> expected(cells + 1, 0.0);
    Random random(options.seed);
    for (int i = 0; i < options.samples; ++i) {
        const auto s = sampler.sample(c.context, random.uniform(), random.uniform2());
        std::size_t cell = cells;
        if (s) {
            const Vec2 q = glm::clamp(map.to_square(s->sample.wi), 0.0f, kOneMinusEpsilon);
            const Vec2 scaled = q * static_cast<float>(side);
            cell = static_cast<std::size_t>(static_cast<int>(scaled.y) * side +
                                            static_cast<int>(scaled.x));
        }
        ++observed[cell];
    }
    const int grid = side * c.fine;
    double mass = 0.0;
    for (int y = 0; y < grid; ++y) {
        for (int x = 0; x < grid; ++x) {
            const Vec2 q = (Vec2(static_cast<float>(x), static_cast<float>(y)) + 0.5f) /
                           static_cast<float>(grid);
            const auto point = map.from_square(q);
            const auto hit = hit_along(sampler, c.context, point.wi);
            // Where the spot or spread is dark the sampler returns nothing.
            if (hit && !is_zero(hit->L)) {
                const double m = static_cast<double>(hit->pdf * point.solid_angle) / grid / grid;
                expected[static_cast<std::size_t>((y / c.fine) * side + x / c.fine)] +=
                    m * options.samples;
                mass += m;
            }
        }
    }
    EXPECT_LT(mass, 1.005) << c.name;
    expected[cells] = std::max(1.0 - mass, 0.0) * options.samples;
    if (expected[cells] < 5e-3 * options.samples) {
        EXPECT_LT(observed[cells], 5e-3 * options.samples) << c.name;
        observed[cells] = expected[cells] = 0.0;
    }
    merge_slivers(observed, expected, side);
    return test::compare_histograms(observed, expected, options);
}

TEST(LampSampling, ChiSquare) {
    const std::vector<LampCase> cases = all_cases();
    test::ChiSquareOptions options;
    options.tests = static_cast<int>(cases.size());
    options.samples = 50000;
    options.rows = 16;
    for (const LampCase& c : cases) {
        const test::ChiSquareResult r = chi_square(c, options);
        EXPECT_TRUE(r.passed) << c.name << " " << c.version << ": " << r.message;
    }
}

TEST(LampSampling, ChanceHitHasTheSamplingDensity) {
    for (const LampCase& c : all_cases()) {
        const LightSampler sampler = make_sampler(c.lamp, c.version);
        Random random(9);
        int missed = 0;
        int drawn = 0;
        double worst = 0.0;
        for (int i = 0; i < 20000; ++i) {
            const auto s = sampler.sample(c.context, random.uniform(), random.uniform2());
            if (!s) {
                continue;
            }
            ++drawn;
            ASSERT_NEAR(glm::length(s->sample.wi), 1.0f, 1e-5f) << c.name;
            const auto hit = hit_along(sampler, c.context, s->sample.wi);
            if (!hit) {
                ++missed;  // rounding at the rim
                continue;
            }
            const auto error = [](float a, float b) {
                return a == b ? 0.0 : std::abs(static_cast<double>(a / b) - 1.0);
            };
            worst = std::max(worst, error(hit->pdf, s->sample.pdf));
            // Radiance and distance are those of the sample, too.
            worst = std::max(worst, 0.1 * error(hit->L.x, s->sample.L.x));
            worst = std::max(worst, 0.1 * error(hit->distance, s->sample.distance));
        }
        EXPECT_GT(drawn, 500) << c.name;
        EXPECT_LE(missed, drawn / 200 + 1) << c.name << " " << c.version;
        EXPECT_LT(worst, 1e-3) << c.name << " " << c.version;
    }
}

TEST(LampSampling, ATransparentRestartKeepsTheDensity) {
    // The ray restarts halfway; density and radiance belong to the vertex it came from.
    for (const LampCase& c : all_cases()) {
        if (c.lamp.type == LightType::Sun) {
            continue;
        }
        const LightSampler sampler = make_sampler(c.lamp, c.version);
        const auto s = sampler.sample(c.context, 0.5f, Vec2(0.4f, 0.7f));
        if (!s) {
            continue;
        }
        const Ray rest{c.context.p + s->sample.wi * (0.3f * s->sample.distance), s->sample.wi};
        const auto hit = sampler.intersect_lamps(rest, &c.context);
        ASSERT_TRUE(hit) << c.name;
        EXPECT_NEAR(hit->pdf / s->sample.pdf, 1.0f, 1e-3f) << c.name;
        EXPECT_NEAR(hit->distance / s->sample.distance, 0.7f, 1e-2f) << c.name;
    }
}

}  // namespace

}  // namespace pharos
