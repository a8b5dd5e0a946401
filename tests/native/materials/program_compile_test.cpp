// Compiling: flags, folding, broken programs; evaluation of whole materials over batches.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "materials/closure_setup.h"
#include "program_support.h"
#include "support/stress.h"

namespace pharos {
namespace {

using test::compile;
using test::emission_of;
using test::ProgramBuilder;

[[nodiscard]] ProgramBuilder diffuse_program() {
    ProgramBuilder b;
    b.add(NodeOpCode::Diffuse,
          0,
          {b.constant({1, 1, 1}), b.constant({0.2f, 0.4f, 0.6f}), b.constant({0}), kDefaultOperand},
          0);
    return b;
}

// Operands of Principled v2 with everything neutral, by position.
struct PrincipledV2 {
    ProgramBuilder b;
    std::vector<std::int32_t> operands;

    PrincipledV2() {
        for (const float v : {1.0f, 0.8f}) {
            operands.push_back(b.constant({v, v, v}));  // weight, base colour
        }
        for (const float v : {0.0f, 0.5f, 1.5f, 0.0f, 0.0f, 0.5f}) {
            operands.push_back(b.constant({v}));  // metallic ... specular level
        }
        operands.push_back(b.constant({1, 1, 1}));  // specular tint
        for (const float v : {0.0f, 0.0f, 0.0f, 0.0f, 0.03f, 1.5f}) {
            operands.push_back(b.constant({v}));  // anisotropic ... coat ior
        }
        operands.push_back(b.constant({1, 1, 1}));  // coat tint
        operands.push_back(b.constant({0}));
        operands.push_back(b.constant({0.5f}));
        operands.push_back(b.constant({1, 1, 1}));  // sheen tint
        operands.push_back(b.constant({1, 1, 1}));  // emission colour
        for (const float v : {0.0f, 0.0f, 1.33f, 1.0f}) {
            operands.push_back(b.constant({v}));  // emission strength, film, film ior, alpha
        }
        operands.insert(operands.end(), 3, kDefaultOperand);
    }

    [[nodiscard]] Material material() {
        b.add(NodeOpCode::PrincipledV2,
              static_cast<std::uint16_t>(Distribution::MultiGgx),
              operands,
              0);
        return compile(b.program);
    }
};

constexpr std::size_t kTransmission = 11;
constexpr std::size_t kEmissionStrength = 20;
constexpr std::size_t kAlpha = 23;

[[nodiscard]] std::vector<SurfaceInteraction> random_hits(std::size_t count) {
    std::vector<SurfaceInteraction> hits(count);
    const auto lanes = test::random_lanes(count, 9, -1.0f, 1.0f);
    for (std::size_t i = 0; i < count; ++i) {
        const auto& v = lanes[i];
        hits[i].p = Vec3(v[0], v[1], v[2]);
        hits[i].ng = hits[i].ns = normalize_or(Vec3(v[3], v[4], v[5]), Vec3(0, 0, 1));
        const Vec3 wo = normalize_or(Vec3(v[6], v[7], v[8]), hits[i].ng);
        hits[i].wo = glm::dot(wo, hits[i].ng) < 0.0f ? -wo : wo;
        hits[i].front_face = i % 3 != 0;
        hits[i].instance = kNone;
    }
    return hits;
}

struct Surfaces {
    ClosureBatch batch;
    ShadingScratch scratch;

    void run(const Material& material,
             std::span<const SurfaceInteraction> hits,
             std::span<const std::uint32_t> index,
             const ShadingContext& context = {}) {
        evaluate_surfaces(material, context, hits, index, scratch, batch);
    }
};

[[nodiscard]] std::vector<std::uint32_t> all_of(std::size_t count) {
    std::vector<std::uint32_t> index(count);
    for (std::size_t i = 0; i < count; ++i) {
        index[i] = static_cast<std::uint32_t>(i);
    }
    return index;
}

TEST(ProgramCompile, ConstantDiffuseHasOneClosureAHit) {
    const Material material = compile(diffuse_program().program);
    EXPECT_TRUE(material.constant);
    EXPECT_TRUE(material.scatters);
    EXPECT_FALSE(material.emits);
    EXPECT_FALSE(material.transparent);
    EXPECT_FALSE(material.transmits);
    EXPECT_FALSE(material.textured);
    EXPECT_EQ(material.program.register_count, 0u);
    const auto hits = random_hits(700);
    Surfaces surfaces;
    surfaces.batch.reset(hits.size());
    surfaces.run(material, hits, all_of(hits.size()));
    for (std::size_t i = 0; i < hits.size(); ++i) {
        ASSERT_EQ(surfaces.batch.count[i], 1u);
        const Closure& c = surfaces.batch.closures[surfaces.batch.first[i]];
        EXPECT_EQ(c.type, ClosureType::Diffuse);
        EXPECT_NEAR(c.weight.y, 0.4f, 1e-6f);
        EXPECT_NEAR(glm::dot(c.n, hits[i].ns), 1.0f, 1e-5f);
        EXPECT_GT(c.sample_weight, 0.0f);
        EXPECT_EQ(surfaces.batch.emission[i], Rgb(0.0f));
    }
}

// The quick ways through constant materials give what set-up gives hit by hit.
TEST(ProgramCompile, BatchesEqualSingleHits) {
    std::vector<Material> materials = {compile(diffuse_program().program),
                                       PrincipledV2().material()};
    ProgramBuilder bumped = diffuse_program();
    bumped.program.operands.back() = bumped.constant({0.3f, -0.4f, 2.0f});
    materials.push_back(compile(bumped.program));
    ProgramBuilder several = diffuse_program();
    several.add(NodeOpCode::Glass,
                static_cast<std::uint16_t>(Distribution::Ggx),
                {several.constant({0.5f, 0.5f, 0.5f}),
                 several.geometry(GeometryOutput::Normal),
                 several.constant({0.3f}),
                 several.constant({1.45f}),
                 kDefaultOperand},
                0);
    several.show(several.geometry(GeometryOutput::Position));
    materials.push_back(compile(several.program));
    ShadingContext context;
    for (const std::uint32_t version : {304u, 405u}) {
        context.blender_version = version;
        for (const Material& material : materials) {
            const auto hits = random_hits(500);
            Surfaces whole;
            whole.batch.reset(hits.size());
            whole.run(material, hits, all_of(hits.size()), context);
            for (std::size_t i = 0; i < hits.size(); ++i) {
                Surfaces one;
                one.batch.reset(1);
                one.run(material, {&hits[i], 1}, all_of(1), context);
                ASSERT_EQ(whole.batch.count[i], one.batch.count[0]);
                EXPECT_EQ(whole.batch.emission[i], one.batch.emission[0]);
                for (std::uint32_t k = 0; k < one.batch.count[0]; ++k) {
                    const Closure& a = whole.batch.closures[whole.batch.first[i] + k];
                    const Closure& b = one.batch.closures[k];
                    EXPECT_EQ(a.type, b.type);
                    EXPECT_EQ(a.weight, b.weight);
                    EXPECT_EQ(a.n, b.n);
                    EXPECT_EQ(a.sample_weight, b.sample_weight);
                    EXPECT_EQ(a.alpha_x, b.alpha_x);
                    EXPECT_EQ(a.tangent, b.tangent);
                    EXPECT_EQ(a.smith, b.smith);
                }
            }
        }
    }
}

TEST(ProgramCompile, GroupsOfMaterialsShareABatch) {
    const Material diffuse = compile(diffuse_program().program);
    ProgramBuilder b;
    b.show(b.constant({3, 2, 1}));
    const Material lamp = compile(b.program);
    const auto hits = random_hits(10);
    const std::vector<std::uint32_t> even = {0, 2, 4, 6, 8};
    const std::vector<std::uint32_t> odd = {1, 3, 5, 7, 9};
    Surfaces surfaces;
    surfaces.batch.reset(hits.size());
    surfaces.run(diffuse, hits, odd);
    surfaces.run(lamp, hits, even);
    surfaces.run(diffuse, hits, {});
    EXPECT_EQ(surfaces.batch.closures.size(), odd.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        EXPECT_EQ(surfaces.batch.count[i], i % 2);
        EXPECT_EQ(surfaces.batch.emission[i], i % 2 == 0 ? Rgb(3, 2, 1) : Rgb(0.0f));
    }
}

TEST(ProgramCompile, ConstantValuesAreFolded) {
    // Multiply, map range and a ramp of constants feed a diffuse colour.
    ProgramBuilder b;
    b.program.tables = {{0, 0, 0, 1, 1, 1, 1, 1}};
    const std::int32_t product = b.add(NodeOpCode::Math,
                                       static_cast<std::uint16_t>(MathMode::Multiply),
                                       {b.constant({0.5f}), b.constant({0.5f}), b.constant({0})},
                                       1);
    const std::int32_t ramp = b.add(NodeOpCode::Ramp, 0, {product}, 4);
    b.add(
        NodeOpCode::Diffuse, 0, {b.constant({1, 1, 1}), ramp, b.constant({0}), kDefaultOperand}, 0);
    const Material material = compile(b.program);
    EXPECT_TRUE(material.constant);
    EXPECT_TRUE(material.surface.values.empty());
    Surfaces surfaces;
    surfaces.batch.reset(1);
    surfaces.run(material, random_hits(1), all_of(1));
    EXPECT_NEAR(surfaces.batch.closures[0].weight.x, 0.25f, 1e-6f);
}

TEST(ProgramCompile, MixedOperandsAreGathered) {
    // A colour whose red varies and whose green and blue are constants, from three operations that
    // do not write side by side.
    ProgramBuilder b;
    b.program.register_count = 3;
    const auto put = [&](std::int32_t target, std::int32_t operand) {
        b.add(NodeOpCode::Copy, 1, {operand}, 1);
        --b.program.register_count;
        b.program.ops.back().output = target;
    };
    const std::int32_t p = b.geometry(GeometryOutput::Position);
    put(1, b.constant({0.5f}));
    put(0, p + 2);
    put(2, b.constant({0.25f}));
    b.show(0);
    const Material material = compile(b.program);
    EXPECT_FALSE(material.constant);
    SurfaceInteraction hit;
    hit.p = Vec3(1, 2, 3);
    EXPECT_EQ(emission_of(material, {&hit, 1})[0], Rgb(3, 0.5f, 0.25f));
}

TEST(ProgramCompile, ReusedRegistersKeepTheirMeaning) {
    // The exporter may use a register again once nothing needs its old value.
    ProgramBuilder b;
    const std::int32_t p = b.geometry(GeometryOutput::Position);
    b.show(p);
    b.geometry(GeometryOutput::Incoming);
    b.program.ops.back().output = p;
    b.show(p);
    SurfaceInteraction hit;
    hit.p = Vec3(1, 2, 3);
    hit.wo = Vec3(10, 20, 30);
    EXPECT_EQ(emission_of(compile(b.program), {&hit, 1})[0], Rgb(11, 22, 33));
}

TEST(ProgramCompile, WhatNoClosureReadsIsDropped) {
    ProgramBuilder b = diffuse_program();
    b.program.images = {{.image = 0}};
    b.add(NodeOpCode::Image, 0, {b.geometry(GeometryOutput::Position)}, 4);
    const Material material = compile(b.program);
    EXPECT_TRUE(material.constant);
    EXPECT_FALSE(material.textured);
}

TEST(ProgramCompile, ClosuresOfNoWeightAreDropped) {
    ProgramBuilder b = diffuse_program();
    const std::int32_t zero = b.constant({0, 0, 0});
    b.add(NodeOpCode::Transparent, 0, {zero, b.constant({1, 1, 1})}, 0);
    b.add(NodeOpCode::Emission,
          0,
          {b.constant({1, 1, 1}), b.constant({1, 1, 1}), b.constant({0})},
          0);
    b.add(NodeOpCode::Emission, 0, {b.constant({1, 1, 1}), zero, b.constant({5})}, 0);
    const Material material = compile(b.program);
    EXPECT_FALSE(material.transparent);
    EXPECT_FALSE(material.emits);
    EXPECT_EQ(material.surface.closures.size(), 1u);
}

TEST(ProgramCompile, FlagsOfPrincipled) {
    const auto with = [](std::size_t operand, float value) {
        PrincipledV2 p;
        p.operands[operand] = p.b.constant({value});
        return p.material();
    };
    const Material plain = PrincipledV2().material();
    EXPECT_TRUE(plain.scatters && plain.constant);
    EXPECT_FALSE(plain.transparent || plain.emits || plain.transmits);
    EXPECT_TRUE(with(kTransmission, 0.5f).transmits);
    EXPECT_TRUE(with(kAlpha, 0.5f).transparent);
    EXPECT_TRUE(with(kEmissionStrength, 2.0f).emits);
}

TEST(ProgramCompile, EmissionAndItsEstimate) {
    ProgramBuilder b;
    b.add(NodeOpCode::Emission,
          0,
          {b.constant({0.5f, 0.5f, 0.5f}), b.constant({1, 2, 3}), b.constant({4})},
          0);
    const Material lamp = compile(b.program);
    EXPECT_TRUE(lamp.emits && lamp.constant);
    EXPECT_FALSE(lamp.scatters);
    EXPECT_EQ(lamp.emission_estimate, Rgb(2, 4, 6));
    const auto hits = random_hits(3);
    for (const Rgb& e : emission_of(lamp, hits)) {
        EXPECT_EQ(e, Rgb(2, 4, 6));  // no pi, from both sides
    }
    PrincipledV2 p;
    p.operands[kEmissionStrength] = p.b.constant({3});
    const Material glowing = p.material();
    EXPECT_NEAR(glowing.emission_estimate.x, 3.0f, 1e-5f);
    EXPECT_NEAR(emission_of(glowing, hits)[1].y, 3.0f, 1e-5f);
    Surfaces surfaces;
    surfaces.batch.reset(hits.size());
    surfaces.run(glowing, hits, all_of(hits.size()));
    EXPECT_NEAR(surfaces.batch.emission[2].z, 3.0f, 1e-5f);
}

TEST(ProgramCompile, TexturedEmissionIsEstimatedByTheMean) {
    TexturePixels pixels{2, 1, 1, TexelType::Float, std::vector<std::uint8_t>(8)};
    const float texels[2] = {1.0f, 5.0f};
    std::memcpy(pixels.data.data(), texels, sizeof(texels));
    const Texture texture(std::move(pixels), ImageColorSpace::Linear, ImageAlpha::None);
    ProgramBuilder b;
    b.program.images = {{.image = 0}};
    const std::int32_t color = b.add(NodeOpCode::Image, 0, {kDefaultOperand}, 4);
    b.add(NodeOpCode::Emission, 0, {b.constant({1, 1, 1}), color, b.constant({2})}, 0);
    const Material material = compile(b.program, {&texture, 1});
    EXPECT_TRUE(material.textured);
    EXPECT_NEAR(material.emission_estimate.x, 6.0f, 1e-5f);
}

// Channel by channel, as Cycles drops what is no number.
TEST(ProgramCompile, BrokenEmissionIsBlack) {
    ProgramBuilder b;
    b.show(b.geometry(GeometryOutput::Position));
    SurfaceInteraction hit;
    hit.p = Vec3(1, NAN, 2);
    EXPECT_EQ(emission_of(compile(b.program), {&hit, 1})[0], Rgb(1, 0, 2));
    hit.p = Vec3(1, INFINITY, 2);
    EXPECT_EQ(emission_of(compile(b.program), {&hit, 1})[0], Rgb(1, 0, 2));
}

// Each of them is a number, their sum is none in one channel.
TEST(ProgramCompile, SumsOfLightThatOverflowAreBlack) {
    constexpr float kHuge = 3e38f;
    ProgramBuilder b;
    for (int i = 0; i < 2; ++i) {
        const std::int32_t one = b.constant({1, 1, 1});
        b.add(NodeOpCode::Emission, 0, {one, b.constant({1, kHuge, 2}), b.constant({1})}, 0);
        b.add(NodeOpCode::Transparent, 0, {one, b.constant({kHuge, 0.25f, 0})}, 0);
    }
    const Material material = compile(b.program);
    const auto hits = random_hits(3);
    EXPECT_EQ(emission_of(material, hits)[0], Rgb(2, 0, 4));
    Surfaces surfaces;
    surfaces.batch.reset(hits.size());
    surfaces.run(material, hits, all_of(hits.size()));
    EXPECT_EQ(surfaces.batch.emission[0], Rgb(2, 0, 4));
    std::vector<Rgb> through(hits.size());
    evaluate_transparency(material, ShadingContext(), hits, surfaces.scratch, through);
    EXPECT_EQ(through[0], Rgb(0, 0.5f, 0));
}

TEST(ProgramCompile, TransparencyIsTheSumOfItsClosures) {
    ProgramBuilder b = diffuse_program();
    b.add(
        NodeOpCode::Transparent, 0, {b.constant({0.5f, 0.5f, 0.5f}), b.constant({1, 0.5f, 0})}, 0);
    b.add(
        NodeOpCode::Transparent, 0, {b.constant({0.25f, 0.25f, 0.25f}), b.constant({1, 1, 1})}, 0);
    const Material material = compile(b.program);
    EXPECT_TRUE(material.transparent);
    const auto hits = random_hits(5);
    std::vector<Rgb> through(hits.size());
    ShadingScratch scratch;
    evaluate_transparency(material, ShadingContext(), hits, scratch, through);
    for (const Rgb& t : through) {
        EXPECT_EQ(t, Rgb(0.75f, 0.5f, 0.25f));
    }
    PrincipledV2 p;
    p.operands[kAlpha] = p.b.constant({0.25f});
    evaluate_transparency(p.material(), ShadingContext(), hits, scratch, through);
    EXPECT_NEAR(through[3].x, 0.75f, 1e-6f);
    evaluate_transparency(
        compile(diffuse_program().program), ShadingContext(), hits, scratch, through);
    EXPECT_EQ(through[3], Rgb(0.0f));
}

TEST(ProgramCompile, EmptyProgramsAreBlack) {
    const Material material = compile(NodeProgram());
    EXPECT_FALSE(material.emits || material.scatters || material.transparent);
    const auto hits = random_hits(2);
    Surfaces surfaces;
    surfaces.batch.reset(2);
    surfaces.run(material, hits, all_of(2));
    EXPECT_EQ(surfaces.batch.count[1], 0u);
    const Vec3 up(0, 0, 1);
    Rgb radiance(9.0f);
    evaluate_world(material, ShadingContext(), {&up, 1}, surfaces.scratch, {&radiance, 1});
    EXPECT_EQ(radiance, Rgb(0.0f));
}

// Each of these breaks a working program in one way.
TEST(ProgramCompile, BrokenProgramsAreReportedAndGrey) {
    const auto expect_broken = [](const char* what, const NodeProgram& program) {
        SceneReport report;
        const Material material = compile_material("broken", program, report);
        ASSERT_EQ(report.entries().size(), 1u) << what;
        EXPECT_EQ(report.entries()[0].object, "broken");
        EXPECT_EQ(report.entries()[0].severity, Severity::Error);
        EXPECT_TRUE(material.constant && material.scatters) << what;
        Surfaces surfaces;
        surfaces.batch.reset(1);
        surfaces.run(material, random_hits(1), all_of(1));
        EXPECT_NEAR(surfaces.batch.closures.at(0).weight.x, 0.8f, 1e-6f) << what;
    };
    const auto changed = [&](const char* what, const auto& change) {
        ProgramBuilder b;
        b.program.images = {{.image = 0}};
        const std::int32_t p = b.geometry(GeometryOutput::Position);
        b.show(b.add(NodeOpCode::Image, 0, {p}, 4));
        EXPECT_TRUE(compile(b.program).emits);
        change(b.program);
        expect_broken(what, b.program);
    };
    changed("code", [](NodeProgram& p) { p.ops[0].code = static_cast<NodeOpCode>(77); });
    changed("mode", [](NodeProgram& p) { p.ops[0].mode = 50; });
    changed("image", [](NodeProgram& p) { p.ops[1].mode = 1; });
    changed("operand count", [](NodeProgram& p) { p.ops[1].operand_count = 2; });
    changed("first operand", [](NodeProgram& p) { p.ops[1].first_operand = 0xffffffffu; });
    changed("output", [](NodeProgram& p) { p.ops[1].output = 4; });
    changed("negative output", [](NodeProgram& p) { p.ops[1].output = -1; });
    changed("largest output", [](NodeProgram& p) { p.ops[1].output = 0x7fffffff; });
    changed("register", [](NodeProgram& p) { p.operands[0] = 1000; });
    changed("unwritten", [](NodeProgram& p) { p.operands[0] = 3; });
    changed("constant", [](NodeProgram& p) { p.operands[1] = ~1000; });
    changed("half a constant", [](NodeProgram& p) {
        p.operands[1] = ~static_cast<std::int32_t>(p.constants.size() - 1);
    });
    changed("no default", [](NodeProgram& p) { p.operands[1] = kDefaultOperand; });
    changed("registers", [](NodeProgram& p) { p.register_count = 0xffffffffu; });
    changed("table", [](NodeProgram& p) { p.ops[1] = {NodeOpCode::Ramp, 0, 3, 0, 1}; });
}

// How often something in a random program is wrong.
struct Noise {
    std::mt19937& random;
    std::uint32_t one_in;

    [[nodiscard]] std::uint32_t below(std::uint32_t limit) {
        const auto raw = static_cast<std::uint32_t>(random());
        return raw % one_in == 0 ? static_cast<std::uint32_t>(random())
                                 : raw / one_in % std::max(limit, 1u);
    }
};

// Operands and results of each operation, in the order of the codes.
constexpr std::uint32_t kOperandCounts[] = {1, 0, 0, 0, 1, 1, 1, 1, 1, 3, 4, 3, 3, 4,  1, 3,
                                            2, 2, 2, 0, 0, 0, 6, 6, 3, 2, 2, 3, 5, 4,  1, 3,
                                            4, 1, 1, 5, 1, 4, 4, 5, 5, 2, 3, 3, 3, 20, 27};
constexpr std::uint32_t kModes[] = {4, 3, 7,  7, 2, 2,  1, 1, 1, 41, 29, 19, 1, 4, 2, 1,
                                    1, 1, 3,  2, 3, 13, 4, 4, 2, 1,  1,  1,  1, 2, 3, 3,
                                    1, 7, 27, 5, 1, 1,  5, 5, 5, 1,  1,  1,  1, 5, 5};
constexpr std::uint32_t kOutputs[] = {1, 3, 3, 3, 4, 4, 3, 1, 1, 1, 3, 3, 1, 3, 4, 3, 1, 2, 3,
                                      1, 1, 1, 1, 3, 1, 3, 3, 3, 3, 3, 3, 3, 4, 1, 3, 3, 3};
constexpr std::uint32_t kMostOutputs = 4;

// Bytes of ops and operands that are nearly programs: one thing in `one_in` is anything at all.
[[nodiscard]] NodeProgram random_program(std::mt19937& random, std::uint32_t one_in) {
    constexpr float kSpecial[] = {
        0.0f, 1.0f, -1.0f, 0.5f, NAN, INFINITY, -INFINITY, 1e30f, 1e-30f, 3.0f};
    Noise noise{random, one_in};
    const auto special = [&] { return kSpecial[random() % std::size(kSpecial)]; };
    NodeProgram p;
    p.constants.resize(4 + random() % 60);
    std::generate(p.constants.begin(), p.constants.end(), special);
    p.images.resize(1 + random() % 3);
    for (ImageUse& use : p.images) {
        use.image = noise.below(2);
        use.interpolation = static_cast<ImageInterpolation>(random() % 5);
        use.extension = static_cast<ImageExtension>(random() % 5);
        use.projection = static_cast<ImageProjection>(random() % 7);
        use.projection_blend = special();
    }
    p.names.resize(1 + random() % 3, "UVMap");
    p.tables.resize(1 + random() % 3, std::vector<float>(8 + 4 * (random() % 3), 0.5f));
    const std::uint32_t ops = static_cast<std::uint32_t>(random()) % 12;
    std::uint32_t written = 0;
    for (std::uint32_t i = 0; i < ops; ++i) {
        NodeOp op;
        const auto kind = static_cast<std::uint16_t>(random() % 47);
        op.code = static_cast<NodeOpCode>(kind < 37 ? kind : kind + 63);
        op.mode = static_cast<std::uint16_t>(noise.below(kModes[kind]));
        op.operand_count = random() % (8 * one_in) == 0 ? noise.below(8) : kOperandCounts[kind];
        op.first_operand = static_cast<std::uint32_t>(p.operands.size());
        for (std::uint32_t k = 0; k < std::min(op.operand_count, 40u); ++k) {
            const bool last = kind >= 37 && k + 3 >= op.operand_count && k > 1;
            const std::uint32_t choice = static_cast<std::uint32_t>(random()) % 4;
            if (choice == 0 && last) {
                p.operands.push_back(kDefaultOperand);
            } else if (choice < 2 || written < 3) {
                p.operands.push_back(~static_cast<std::int32_t>(
                    noise.below(static_cast<std::uint32_t>(p.constants.size()) - 2)));
            } else {
                p.operands.push_back(static_cast<std::int32_t>(noise.below(written - 2)));
            }
        }
        if (kind < 37) {
            op.output = static_cast<std::int32_t>(
                random() % (4 * one_in) == 0 ? noise.below(written + kMostOutputs) : written);
            written += kOutputs[kind];
        }
        p.ops.push_back(op);
    }
    p.register_count = random() % (8 * one_in) == 0 ? noise.below(40) : written + kMostOutputs;
    return p;
}

TEST(ProgramCompile, RandomProgramsNeverCrash) {
    std::mt19937 random(2024);
    std::vector<Mesh> meshes(1);
    meshes[0].positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    meshes[0].triangles.emplace_back(0u, 1u, 2u);
    meshes[0].uv_maps = {{"UVMap", {{0, 0}, {1, 0}, {0, 1}}}};
    const std::vector<Instance> instances(1);
    const std::vector<Texture> textures(2);
    ShadingContext context;
    context.meshes = meshes;
    context.instances = instances;
    context.textures = textures;
    std::vector<SurfaceInteraction> hits = random_hits(4);
    hits[0].instance = hits[0].triangle = 0;
    hits[1].instance = 0;
    hits[1].triangle = 99;
    hits[2].p = Vec3(NAN, INFINITY, -1e38f);
    std::vector<Rgb> values(hits.size());
    std::vector<Vec3> directions = {Vec3(0, 0, 1), Vec3(NAN), Vec3(0.0f)};
    std::vector<Rgb> radiance(directions.size());
    Surfaces surfaces;
    std::uint64_t accepted = 0;
    std::uint64_t varying = 0;
    const std::uint64_t tries = testing::case_count(100000, 10000000);
    for (std::uint64_t i = 0; i < tries; ++i) {
        context.blender_version = i % 2 == 0 ? 304 : 405;
        SceneReport report;
        const Material material = compile_material(
            "fuzz", random_program(random, i % 2 == 0 ? 16 : 200), report, textures);
        accepted += report.entries().empty() ? 1 : 0;
        varying += material.constant ? 0 : 1;
        surfaces.batch.reset(hits.size());
        surfaces.run(material, hits, all_of(hits.size()), context);
        for (std::size_t k = 0; k < hits.size(); ++k) {
            ASSERT_LE(surfaces.batch.first[k] + surfaces.batch.count[k],
                      surfaces.batch.closures.size());
            ASSERT_TRUE(is_finite(surfaces.batch.emission[k]));
        }
        evaluate_emission(material, context, hits, surfaces.scratch, values);
        evaluate_transparency(material, context, hits, surfaces.scratch, values);
        evaluate_world(material, context, directions, surfaces.scratch, radiance);
        ASSERT_TRUE(is_finite(radiance[1]));
    }
    // Enough of them are whole for the test to mean something.
    EXPECT_GT(accepted, tries / 5);
    EXPECT_GT(varying, tries / 20);
    testing::say_stress("node programs: crashes, not finite", tries, 0.0, 0.0);
}

}  // namespace
}  // namespace pharos
