// Emissive triangles: density against chance hits, closed form of a quad, groups and choice.

#include "lights_support.h"
#include "support/chi_square.h"

namespace pharos {

namespace {

using test::Random;

// Meshes with instances and emissive triangles that a test fills.
struct TriangleScene {
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<EmissiveTriangle> emitters;
    std::vector<LightDescription> lamps;

    std::uint32_t add_mesh(std::vector<Vec3> positions, std::vector<UVec3> triangles) {
        Mesh mesh;
        mesh.positions = std::move(positions);
        mesh.triangles = std::move(triangles);
        meshes.push_back(std::move(mesh));
        return static_cast<std::uint32_t>(meshes.size() - 1);
    }

    void add_instance(std::uint32_t mesh, const Mat4& to_world, float L) {
        Instance instance;
        instance.mesh = mesh;
        instance.to_world = to_world;
        instance.to_object = glm::inverse(to_world);
        instance.materials = {0};
        instances.push_back(instance);
        const auto index = static_cast<std::uint32_t>(instances.size() - 1);
        for (std::uint32_t t = 0; t < meshes[mesh].triangles.size(); ++t) {
            emitters.push_back({index, t, Rgb(L)});
        }
    }

    [[nodiscard]] LightSampler sampler() const {
        LightSamplerInput input;
        input.lamps = lamps;
        input.blender_version = 405;
        input.triangles = emitters;
        input.meshes = meshes;
        input.instances = instances;
        return LightSampler(input);
    }

    struct Nearest {
        std::uint32_t instance = kNone;
        std::uint32_t triangle = kNone;
        float t = kInfinity;
        float cosine = 0.0f;
    };

    // Brute force, Moeller and Trumbore 1997.
    [[nodiscard]] Nearest trace(const Vec3& origin, const Vec3& direction) const {
        Nearest nearest;
        for (std::uint32_t i = 0; i < instances.size(); ++i) {
            const Mesh& mesh = meshes[instances[i].mesh];
            for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
                Vec3 p[3];
                for (int c = 0; c < 3; ++c) {
                    p[c] = transform_point(instances[i].to_world,
                                           mesh.positions[mesh.triangles[k][c]]);
                }
                const Vec3 e1 = p[1] - p[0];
                const Vec3 e2 = p[2] - p[0];
                const Vec3 h = glm::cross(direction, e2);
                const float a = glm::dot(e1, h);
                const Vec3 s = origin - p[0];
                const float u = glm::dot(s, h) / a;
                const Vec3 q = glm::cross(s, e1);
                const float v = glm::dot(direction, q) / a;
                const float t = glm::dot(e2, q) / a;
                if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < nearest.t) {
                    const float cosine = glm::dot(direction, glm::normalize(glm::cross(e1, e2)));
                    nearest = {i, k, t, cosine};
                }
            }
        }
        return nearest;
    }
};

Mat4 placed(const Vec3& position, const Vec3& scale) {
    Mat4 m(1.0f);
    m[0].x = scale.x;
    m[1].y = scale.y;
    m[2].z = scale.z;
    m[3] = Vec4(position, 1);
    return m;
}

std::uint32_t add_quad(TriangleScene& scene) {
    return scene.add_mesh({{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}},
                          {{0, 1, 2}, {0, 2, 3}});
}

std::uint32_t add_tetrahedron(TriangleScene& scene) {
    return scene.add_mesh({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                          {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}});
}

// A sphere of triangles around the origin, radius 1.
std::uint32_t add_sphere(TriangleScene& scene, unsigned rows, unsigned columns) {
    std::vector<Vec3> positions = {Vec3(0, 0, 1)};
    std::vector<UVec3> triangles;
    for (unsigned y = 1; y < rows; ++y) {
        for (unsigned x = 0; x < columns; ++x) {
            const float theta = kPi * static_cast<float>(y) / static_cast<float>(rows);
            const float phi = 2.0f * kPi * static_cast<float>(x) / static_cast<float>(columns);
            positions.emplace_back(
                std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        }
    }
    positions.emplace_back(0, 0, -1);
    const auto vertex = [&](unsigned y, unsigned x) {
        return y == 0
                   ? 0u
                   : (y == rows ? (rows - 1) * columns + 1 : (y - 1) * columns + x % columns + 1);
    };
    for (unsigned y = 0; y < rows; ++y) {
        for (unsigned x = 0; x < columns; ++x) {
            if (y > 0) {
                triangles.emplace_back(vertex(y, x), vertex(y + 1, x), vertex(y, x + 1));
            }
            if (y + 1 < rows) {
                triangles.emplace_back(vertex(y, x + 1), vertex(y + 1, x), vertex(y + 1, x + 1));
            }
        }
    }
    return scene.add_mesh(std::move(positions), std::move(triangles));
}

TriangleScene two_quads_and_lamp() {
    TriangleScene scene;
    const std::uint32_t quad = add_quad(scene);
    scene.add_instance(quad, placed(Vec3(0.3f, 0, 2), Vec3(1, 1, 1)), 2.0f);
    scene.add_instance(quad, placed(Vec3(-1.5f, 1, 1), Vec3(0.5f, 2, 1)), 10.0f);
    LightDescription lamp = test::lamp_above(LightType::Area, 3.0f);
    lamp.to_world[3].x = -2.0f;
    scene.lamps.push_back(lamp);
    return scene;
}

// The quad's reflected radiance equals that of a square area lamp with the same radiance.
TEST(EmissiveTriangles, QuadClosedForm) {
    TriangleScene scene;
    const std::uint32_t quad = add_quad(scene);
    // Both sides emit: turned over it shines the same.
    for (const float side : {1.0f, -1.0f}) {
        scene.instances.clear();
        scene.emitters.clear();
        scene.add_instance(quad, placed(Vec3(0, 0, 2), Vec3(1, side, 1)), 1.0f);
        const LightSampler sampler = scene.sampler();
        Random random(1);
        double sum = 0.0;
        constexpr int kSamples = 1000000;
        for (int i = 0; i < kSamples; ++i) {
            const auto s = sampler.sample(test::plane_point(), random.uniform(), random.uniform2());
            ASSERT_TRUE(s);
            ASSERT_EQ(s->instance, 0u);
            sum += static_cast<double>(s->sample.wi.z / s->sample.pdf);
        }
        EXPECT_NEAR(sum / kSamples / std::numbers::pi / (1.83694 / 25.0), 1.0, 2e-3);
    }
}

TEST(EmissiveTriangles, BarycentricsNameThePoint) {
    const TriangleScene scene = two_quads_and_lamp();
    const LightSampler sampler = scene.sampler();
    Random random(7);
    for (int i = 0; i < 1000; ++i) {
        const auto s = sampler.sample(test::plane_point(), random.uniform(), random.uniform2());
        if (!s || s->instance == kNone) {
            continue;
        }
        const Mesh& mesh = scene.meshes[scene.instances[s->instance].mesh];
        const UVec3 corner = mesh.triangles[s->triangle];
        const Vec3 local = mesh.positions[corner.x] * (1.0f - s->u - s->v) +
                           mesh.positions[corner.y] * s->u + mesh.positions[corner.z] * s->v;
        const Vec3 world = transform_point(scene.instances[s->instance].to_world, local);
        EXPECT_LT(glm::length(world - s->sample.wi * s->sample.distance), 1e-5f);
    }
}

// The density of a chance hit is the one the sample reported, the choice among lamps included.
TEST(EmissiveTriangles, ChanceHitHasTheSamplingDensity) {
    TriangleScene scene = two_quads_and_lamp();
    scene.add_instance(add_tetrahedron(scene), placed(Vec3(2, -1, 2), Vec3(0.3f)), 5.0f);
    scene.add_instance(
        add_sphere(scene, 6, 8), placed(Vec3(1, 1, 1), Vec3(0.2f, -0.3f, 0.4f)), 5.0f);
    const LightSampler sampler = scene.sampler();
    Random random(11);
    std::vector<int> seen(5, 0);
    for (int i = 0; i < 20000; ++i) {
        const LightSampleContext context{random.uniform3() * 0.5f, random.direction(), i % 2 == 0};
        const auto s = sampler.sample(context, random.uniform(), random.uniform2());
        if (!s) {
            continue;
        }
        if (s->instance == kNone) {
            ++seen[4];
            const auto hit = sampler.intersect_lamps({context.p, s->sample.wi}, &context);
            ASSERT_TRUE(hit);
            EXPECT_NEAR(hit->pdf / s->sample.pdf, 1.0f, 1e-3f);
            continue;
        }
        ++seen[s->instance];
        const auto nearest = scene.trace(context.p, s->sample.wi);
        if (nearest.instance != s->instance || nearest.triangle != s->triangle) {
            continue;  // another triangle in front, or a shared edge
        }
        const float pdf = sampler.pdf_triangle(
            context, nearest.instance, nearest.triangle, nearest.t, nearest.cosine);
        // Grazing hits amplify the rounding of the direction.
        const float tolerance = std::max(1e-4f, 1e-6f / std::abs(nearest.cosine));
        EXPECT_NEAR(pdf / s->sample.pdf, 1.0f, tolerance);
    }
    for (const int count : seen) {
        EXPECT_GT(count, 100);
    }
}

TEST(EmissiveTriangles, ChiSquare) {
    TriangleScene scene = two_quads_and_lamp();
    scene.lamps.clear();
    scene.add_instance(add_tetrahedron(scene), placed(Vec3(2, -1, 2), Vec3(0.5f)), 5.0f);
    const LightSampler sampler = scene.sampler();
    const LightSampleContext context = test::plane_point();
    // Directions meet several triangles of the closed tetrahedron: densities add up.
    const auto density = [&](const Vec3& wi) {
        float sum = 0.0f;
        Vec3 origin = context.p;
        float passed = 0.0f;
        for (int layer = 0; layer < 4; ++layer) {
            const auto hit = scene.trace(origin, wi);
            if (hit.instance == kNone) {
                break;
            }
            passed += hit.t;
            sum += sampler.pdf_triangle(context, hit.instance, hit.triangle, passed, hit.cosine);
            passed += 1e-4f;
            origin = context.p + wi * passed;
        }
        return sum;
    };
    test::ChiSquareOptions options;
    options.samples = 100000;
    const auto result = test::chi_square_sphere(
        [&](Random& random) -> std::optional<Vec3> {
            const auto s = sampler.sample(context, random.uniform(), random.uniform2());
            return s ? std::optional(s->sample.wi) : std::nullopt;
        },
        density,
        options);
    EXPECT_TRUE(result.passed) << result.message;
    EXPECT_NEAR(result.total_mass, 1.0, 3e-3);
}

// A closed emitter is sampled where it faces the receiver: low variance, right mean; with one
// triangle missing (an open surface) both sides are sampled alike.
TEST(EmissiveTriangles, ClosedEmittersAreSampledWhereTheyFace) {
    for (const bool inside_out : {false, true}) {
        TriangleScene scene;
        const std::uint32_t mesh = add_sphere(scene, 10, 16);
        scene.add_instance(
            mesh, placed(Vec3(0.5f, 0, 2), Vec3(inside_out ? -0.1f : 0.1f, 0.1f, 0.1f)), 1.0f);
        const auto spread_of = [&](double& mean) {
            const LightSampler sampler = scene.sampler();
            Random random(3);
            double sum = 0.0;
            double sum2 = 0.0;
            constexpr int kSamples = 20000;
            for (int i = 0; i < kSamples; ++i) {
                const auto s =
                    sampler.sample(test::plane_point(), random.uniform(), random.uniform2());
                const auto nearest = scene.trace(Vec3(0.0f), s->sample.wi);
                if (nearest.triangle != s->triangle) {
                    continue;  // occluded by its own front
                }
                const auto value = static_cast<double>(s->sample.wi.z / s->sample.pdf);
                sum += value;
                sum2 += value * value;
            }
            mean = sum / kSamples;
            return sum2 / kSamples / mean / mean - 1.0;
        };
        double closed_mean = 0.0;
        double open_mean = 0.0;
        const double closed = spread_of(closed_mean);
        scene.emitters.pop_back();
        const double open = spread_of(open_mean);
        EXPECT_LT(closed, 0.35);
        EXPECT_GT(open, 1.3);
        EXPECT_NEAR(closed_mean / open_mean, 1.0, 0.04);
        // pi (r / d)^2 cos of a sphere, slightly less for its triangles.
        const double expected = std::numbers::pi * 0.01 / 4.25 * (2.0 / std::sqrt(4.25));
        EXPECT_NEAR(closed_mean / expected, 0.97, 0.02);
    }
}

// Triangles are chosen in proportion to area times radiance, without a bias in huge groups.
TEST(EmissiveTriangles, HugeGroupIsSampledEvenly) {
    TriangleScene scene;
    constexpr int kSide = 300;  // 180 k triangles
    std::vector<Vec3> positions;
    std::vector<UVec3> triangles;
    for (int y = 0; y <= kSide; ++y) {
        for (int x = 0; x <= kSide; ++x) {
            positions.emplace_back(
                static_cast<float>(x) / kSide - 0.5f, static_cast<float>(y) / kSide - 0.5f, 0.0f);
        }
    }
    for (unsigned y = 0; y < kSide; ++y) {
        for (unsigned x = 0; x < kSide; ++x) {
            const unsigned a = y * (kSide + 1) + x;
            triangles.emplace_back(a, a + 1, a + kSide + 2);
            triangles.emplace_back(a, a + kSide + 2, a + kSide + 1);
        }
    }
    const std::uint32_t mesh = scene.add_mesh(std::move(positions), std::move(triangles));
    scene.add_instance(mesh, placed(Vec3(0, 0, 2), Vec3(1)), 1.0f);
    const LightSampler sampler = scene.sampler();
    Random random(31);
    double sum = 0.0;
    constexpr int kSamples = 400000;
    for (int i = 0; i < kSamples; ++i) {
        const auto s = sampler.sample(test::plane_point(), random.uniform(), random.uniform2());
        ASSERT_TRUE(s);
        sum += static_cast<double>(s->sample.wi.z / s->sample.pdf);
    }
    EXPECT_NEAR(sum / kSamples / std::numbers::pi / (1.83694 / 25.0), 1.0, 2e-3);
}

TEST(EmissiveTriangles, DegenerateOnesAreLeftOut) {
    TriangleScene scene;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::uint32_t mesh =
        scene.add_mesh({{0, 0, 2}, {1, 0, 2}, {0, 1, 2}, {nan, 0, 0}, {kInfinity, 0, 0}},
                       {{0, 0, 1}, {0, 1, 3}, {0, 1, 4}});
    scene.add_instance(mesh, Mat4(1.0f), 1.0f);
    scene.emitters.push_back({99, 0, Rgb(1.0f)});
    scene.emitters.push_back({0, 99, Rgb(1.0f)});
    EXPECT_TRUE(scene.sampler().empty());
    EXPECT_EQ(scene.sampler().pdf_triangle(test::plane_point(), 0, 0, 1.0f, 1.0f), 0.0f);
    EXPECT_EQ(scene.sampler().pdf_triangle(test::plane_point(), 77, 0, 1.0f, 1.0f), 0.0f);
}

}  // namespace

}  // namespace pharos
