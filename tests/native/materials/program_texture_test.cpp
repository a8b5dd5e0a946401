// Images in every projection, worlds, checker and gradient.
#include <cstring>

#include <gtest/gtest.h>

#include "program_support.h"

namespace pharos {
namespace {

using test::compile;
using test::emission_of;
using test::OpCase;
using test::ProgramBuilder;
using test::run_op;

// A float image whose red is u and whose green is v, exact between the outermost texel centres.
[[nodiscard]] Texture uv_texture(std::uint32_t size = 64) {
    TexturePixels pixels{size, size, 3, TexelType::Float, {}};
    std::vector<float> values;
    for (std::uint32_t y = 0; y < size; ++y) {
        for (std::uint32_t x = 0; x < size; ++x) {
            values.insert(values.end(),
                          {(static_cast<float>(x) + 0.5f) / static_cast<float>(size),
                           (static_cast<float>(y) + 0.5f) / static_cast<float>(size),
                           0.25f});
        }
    }
    pixels.data.resize(values.size() * sizeof(float));
    std::memcpy(pixels.data.data(), values.data(), pixels.data.size());
    return Texture(std::move(pixels), ImageColorSpace::Linear, ImageAlpha::Straight);
}

// Colour of an Image operation at a constant vector of a hit with normal `n` (no instance).
[[nodiscard]] Rgb look(ImageProjection projection,
                       const Vec3& vector,
                       const Vec3& n = Vec3(0, 0, 1),
                       float blend = 0.0f,
                       NodeOpCode code = NodeOpCode::Image) {
    const Texture texture = uv_texture();
    ProgramBuilder b;
    ImageUse use;
    use.image = 0;
    use.extension = ImageExtension::Extend;
    use.projection = projection;
    use.projection_blend = blend;
    b.program.images = {use};
    b.show(b.add(code, 0, {b.geometry(GeometryOutput::Position)}, 4));
    SurfaceInteraction hit;
    hit.p = vector;
    hit.ns = hit.ng = hit.wo = n;
    hit.instance = kNone;
    ShadingContext context;
    context.textures = {&texture, 1};
    return emission_of(compile(b.program), {&hit, 1}, context)[0];
}

void expect_uv(const Rgb& got, float u, float v) {
    EXPECT_NEAR(got.x, u, 1e-4f);
    EXPECT_NEAR(got.y, v, 1e-4f);
    EXPECT_NEAR(got.z, 0.25f, 1e-5f);
}

TEST(ProgramTexture, FlatSphereAndTube) {
    expect_uv(look(ImageProjection::Flat, Vec3(0.3f, 0.7f, 5)), 0.3f, 0.7f);
    // The unit cube is seen from its middle; -y is the middle of the picture's seam side.
    expect_uv(look(ImageProjection::Sphere, Vec3(0.5f, 1, 0.5f)), 0.5f, 0.5f);
    expect_uv(look(ImageProjection::Sphere, Vec3(1, 0.5f, 0.5f)), 0.25f, 0.5f);
    expect_uv(look(ImageProjection::Sphere, Vec3(0, 0.5f, 0.5f)), 0.75f, 0.5f);
    expect_uv(look(ImageProjection::Sphere, Vec3(0.5f, 0.75f, 0.75f)), 0.5f, 0.75f);
    expect_uv(look(ImageProjection::Tube, Vec3(0.5f, 1, 0.2f)), 0.5f, 0.2f);
    expect_uv(look(ImageProjection::Tube, Vec3(1, 0.5f, 0.9f)), 0.25f, 0.9f);
}

TEST(ProgramTexture, BoxLooksAlongTheLargestAxis) {
    const Vec3 p(0.3f, 0.6f, 0.8f);
    expect_uv(look(ImageProjection::Box, p, Vec3(1, 0, 0)), 0.6f, 0.8f);
    expect_uv(look(ImageProjection::Box, p, Vec3(-1, 0, 0)), 0.4f, 0.8f);
    expect_uv(look(ImageProjection::Box, p, Vec3(0, 1, 0)), 0.7f, 0.8f);
    expect_uv(look(ImageProjection::Box, p, Vec3(0, -1, 0)), 0.3f, 0.8f);
    expect_uv(look(ImageProjection::Box, p, Vec3(0, 0, 1)), 0.4f, 0.3f);
    expect_uv(look(ImageProjection::Box, p, Vec3(0, 0, -1)), 0.6f, 0.3f);
    const Vec3 slanted = glm::normalize(Vec3(0.8f, 0.55f, 0));
    expect_uv(look(ImageProjection::Box, p, slanted), 0.6f, 0.8f);  // no blend: x alone
}

TEST(ProgramTexture, BoxBlendIsSeamlessAndSumsToOne) {
    const Vec3 p(0.3f, 0.6f, 0.8f);
    const Vec3 half = glm::normalize(Vec3(1, 1, 0));
    expect_uv(look(ImageProjection::Box, p, half, 0.5f), 0.5f * (0.6f + 0.7f), 0.8f);
    expect_uv(look(ImageProjection::Box, p, glm::normalize(Vec3(1.0f)), 0.5f),
              (0.6f + 0.7f + 0.4f) / 3.0f,
              (0.8f + 0.8f + 0.3f) / 3.0f);
    // Blue is the same everywhere, so it shows the sum of weights; green must not jump.
    for (const float blend : {0.1f, 0.5f, 1.0f}) {
        Rgb last;
        for (int i = 0; i <= 2000; ++i) {
            const float a = 1.5f * static_cast<float>(i) / 2000.0f;
            const Vec3 n = glm::normalize(Vec3(std::cos(a), std::sin(a), 0.3f + 0.2f * a));
            const Rgb c = look(ImageProjection::Box, p, n, blend);
            EXPECT_NEAR(c.z, 0.25f, 1e-5f);
            if (i > 0) {
                EXPECT_LT(std::abs(c.x - last.x), 0.02f) << blend << ' ' << i;
            }
            last = c;
        }
    }
}

TEST(ProgramTexture, UnconnectedVectorsFollowTheUvMap) {
    std::vector<Mesh> meshes(1);
    meshes[0].positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    meshes[0].triangles.emplace_back(0u, 1u, 2u);
    meshes[0].uv_maps = {{"UVMap", {{0.2f, 0.2f}, {0.8f, 0.2f}, {0.2f, 0.8f}}}};
    const std::vector<Instance> instances(1);
    const Texture texture = uv_texture();
    ShadingContext context;
    context.meshes = meshes;
    context.instances = instances;
    context.textures = {&texture, 1};
    ProgramBuilder b;
    b.program.images = {{.image = 0}};
    b.show(b.add(NodeOpCode::Image, 0, {kDefaultOperand}, 4));
    SurfaceInteraction hit;
    hit.u = 0.5f;
    hit.v = 0.25f;
    expect_uv(emission_of(compile(b.program), {&hit, 1}, context)[0], 0.5f, 0.35f);
    hit.triangle = 7;  // broken: the corner of the picture
    EXPECT_LT(emission_of(compile(b.program), {&hit, 1}, context)[0].x, 0.51f);
}

TEST(ProgramTexture, MissingImagesAreMagenta) {
    for (const std::uint32_t image : {0u, 5u, 0xffffffffu}) {
        ProgramBuilder b;
        b.program.images = {{.image = image}};
        b.show(b.add(NodeOpCode::Image, 0, {b.geometry(GeometryOutput::Position)}, 4));
        const SurfaceInteraction hit;
        EXPECT_EQ(emission_of(compile(b.program), {&hit, 1})[0], Rgb(1, 0, 1));
    }
}

TEST(ProgramTexture, AlphaIsDividedOutOnlyWhereItIsRead) {
    TexturePixels pixels{1, 1, 4, TexelType::Float, std::vector<std::uint8_t>(16)};
    const float texel[4] = {0.8f, 0.4f, 0.2f, 0.5f};
    std::memcpy(pixels.data.data(), texel, sizeof(texel));
    const Texture texture(std::move(pixels), ImageColorSpace::Linear, ImageAlpha::Straight);
    ShadingContext context;
    context.textures = {&texture, 1};
    const SurfaceInteraction hit;
    for (const bool read : {false, true}) {
        ProgramBuilder b;
        b.program.images = {{.image = 0}};
        const std::int32_t out =
            b.add(NodeOpCode::Image, 0, {b.geometry(GeometryOutput::Position)}, 4);
        b.show(out);
        if (read) {
            b.show_scalar(out + 3);
        }
        const Rgb got = emission_of(compile(b.program), {&hit, 1}, context)[0];
        EXPECT_NEAR(got.x, read ? 0.8f + 0.5f : 0.4f, 1e-6f);
    }
}

// World radiance of an environment image in direction d.
[[nodiscard]] Rgb world(ImageProjection projection, const Vec3& d, bool connected) {
    const Texture texture = uv_texture(512);
    ProgramBuilder b;
    ImageUse use;
    use.image = 0;
    use.projection = projection;
    b.program.images = {use};
    const std::int32_t vector =
        connected ? b.add(NodeOpCode::Coordinate, 0, {}, 3) : kDefaultOperand;
    const std::int32_t color = b.add(NodeOpCode::EnvironmentImage, 0, {vector}, 4);
    b.add(NodeOpCode::Background, 0, {b.constant({1, 1, 1}), color, b.constant({2})}, 0);
    const Material material = compile(b.program);
    EXPECT_TRUE(material.emits);
    ShadingContext context;
    context.textures = {&texture, 1};
    ShadingScratch scratch;
    Rgb radiance;
    evaluate_world(material, context, {&d, 1}, scratch, {&radiance, 1});
    return radiance * 0.5f;
}

TEST(ProgramTexture, WorldsAreMappedAsCyclesDoes) {
    for (const bool connected : {false, true}) {
        const auto look_at = [&](const Vec3& d) {
            return world(ImageProjection::Equirectangular, d, connected);
        };
        expect_uv(look_at(Vec3(1, 0, 0)), 0.5f, 0.5f);
        expect_uv(look_at(Vec3(0, 1, 0)), 0.25f, 0.5f);
        expect_uv(look_at(Vec3(0, -1, 0)), 0.75f, 0.5f);
        expect_uv(look_at(glm::normalize(Vec3(1, 0, 1))), 0.5f, 0.75f);
        expect_uv(look_at(glm::normalize(Vec3(1, 0, -1))), 0.5f, 0.25f);
        const Vec3 d = glm::normalize(Vec3(0.3f, -0.6f, 0.2f));
        expect_uv(
            look_at(d), 0.5f - std::atan2(d.y, d.x) / (2.0f * kPi), 1.0f - std::acos(d.z) / kPi);
    }
    // The ball: straight back is its middle, the viewer's own direction its rim.
    const auto ball = [](const Vec3& d) { return world(ImageProjection::MirrorBall, d, true); };
    expect_uv(ball(Vec3(0, -1, 0)), 0.5f, 0.5f);
    expect_uv(ball(Vec3(1, 0, 0)), 0.5f + 0.5f * std::sqrt(0.5f), 0.5f);
    expect_uv(ball(Vec3(0, 0, -1)), 0.5f, 0.5f - 0.5f * std::sqrt(0.5f));
}

TEST(ProgramTexture, WorldBatchesEqualSingleDirections) {
    ProgramBuilder b;
    b.show(b.add(NodeOpCode::Coordinate, 0, {}, 3));
    const Material material = compile(b.program);
    std::vector<Vec3> directions;
    for (const auto& v : test::random_lanes(1000, 3, -1.0f, 1.0f)) {
        directions.push_back(glm::normalize(Vec3(v[0], v[1], v[2])));
    }
    std::vector<Rgb> all(directions.size());
    ShadingScratch scratch;
    evaluate_world(material, ShadingContext(), directions, scratch, all);
    for (std::size_t i = 0; i < directions.size(); ++i) {
        EXPECT_EQ(all[i], directions[i]);
    }
}

TEST(ProgramTexture, CheckerAlternates) {
    const OpCase checker{NodeOpCode::Checker, 0, {3, 3, 3, 1}, 4, {}};
    const auto run = [&](const Vec3& p, float scale) {
        return run_op(checker, {{p.x, p.y, p.z, 1, 0, 0, 0, 1, 0, scale}}, false)[0];
    };
    const Rgb first(1, 0, 0);
    const Rgb second(0, 1, 0);
    EXPECT_EQ(run(Vec3(0.1f), 1), second);
    EXPECT_EQ(run(Vec3(1.1f, 0.1f, 0.1f), 1), first);
    EXPECT_EQ(run(Vec3(1.1f, 1.1f, 0.1f), 1), second);
    EXPECT_EQ(run(Vec3(-0.1f, 0.1f, 0.1f), 1), first);
    EXPECT_EQ(run(Vec3(0.3f, 0.1f, 0.1f), 5), first);
    EXPECT_EQ(run(Vec3(0.0f), 1), second);  // faces through the origin do not flicker
    for (const float extreme : {NAN, INFINITY, 1e30f}) {
        const Rgb c = run(Vec3(extreme, 0.1f, 0.1f), 1);
        EXPECT_TRUE(c == first || c == second);
    }
}

TEST(ProgramTexture, Gradients) {
    const auto run = [](GradientMode mode, const std::vector<float>& p) {
        return run_op({NodeOpCode::Gradient, static_cast<std::uint16_t>(mode), {3}, 1, {}},
                      {p},
                      false)[0]
            .x;
    };
    EXPECT_FLOAT_EQ(run(GradientMode::Linear, {0.3f, 5, 5}), 0.3f);
    EXPECT_FLOAT_EQ(run(GradientMode::Linear, {-0.3f, 5, 5}), 0.0f);
    EXPECT_FLOAT_EQ(run(GradientMode::Quadratic, {0.5f, 5, 5}), 0.25f);
    EXPECT_FLOAT_EQ(run(GradientMode::Easing, {0.25f, 5, 5}), 0.15625f);
    EXPECT_FLOAT_EQ(run(GradientMode::Diagonal, {0.2f, 0.6f, 5}), 0.4f);
    EXPECT_FLOAT_EQ(run(GradientMode::Radial, {0, 1, 5}), 0.75f);
    EXPECT_NEAR(run(GradientMode::Spherical, {0.25f, 0, 0}), 0.75f, 1e-5f);
    EXPECT_NEAR(run(GradientMode::QuadraticSphere, {0.5f, 0, 0}), 0.25f, 1e-5f);
    EXPECT_FLOAT_EQ(run(GradientMode::Spherical, {2, 0, 0}), 0.0f);
}

// Each tile is an image of its own; beside them there is nothing.
TEST(ProgramTexture, TilesAreFoundByTheirNumber) {
    const std::vector<Texture> textures = {uv_texture(), uv_texture(8)};
    ProgramBuilder b;
    ImageUse use;
    use.image = 0;
    use.extension = ImageExtension::Extend;
    use.interpolation = ImageInterpolation::Closest;
    use.tiles = {{0, 0}, {12, 1}};  // the first, and the third of the second row
    b.program.images = {use};
    b.show(b.add(NodeOpCode::Image, 0, {b.geometry(GeometryOutput::Position)}, 4));
    std::vector<SurfaceInteraction> hits(5);
    const Vec2 places[] = {{0.3f, 0.6f}, {2.3f, 1.6f}, {1.5f, 0.5f}, {-1.5f, 0.5f}, {0.5f, 2e9f}};
    for (std::size_t i = 0; i < hits.size(); ++i) {
        hits[i].p = Vec3(places[i], 0.0f);
        hits[i].ns = hits[i].ng = hits[i].wo = Vec3(0, 0, 1);
        hits[i].instance = kNone;
    }
    ShadingContext context;
    context.textures = textures;
    const std::vector<Rgb> seen = emission_of(compile(b.program), hits, context);
    EXPECT_NEAR(seen[0].x, 0.3f, 1.0f / 128.0f);
    EXPECT_NEAR(seen[0].y, 0.6f, 1.0f / 128.0f);
    EXPECT_NEAR(seen[1].x, 0.3f, 1.0f / 16.0f);
    EXPECT_NEAR(seen[1].y, 0.6f, 1.0f / 16.0f);
    EXPECT_NE(seen[1].x, seen[0].x);
    for (std::size_t i = 2; i < hits.size(); ++i) {
        EXPECT_EQ(seen[i], Rgb(1.0f, 0.0f, 1.0f)) << i;
    }
}

}  // namespace
}  // namespace pharos
