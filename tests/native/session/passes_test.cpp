// Passes on request: exact values of simple scenes, the guide's passes, and nothing where none is
// wanted.
#include <cmath>

#include <gtest/gtest.h>

#include "support/description_builders.h"
#include "support/render.h"

namespace pharos {
namespace {

using namespace pharos::testing;

std::vector<float> read(const RenderSession& session, FilmPass pass) {
    std::vector<float> out(std::size_t{session.width()} * session.height() *
                           static_cast<std::size_t>(film_pass_channels(pass)));
    EXPECT_TRUE(session.read(pass, out)) << film_pass_info(pass).name;
    return out;
}

void finish(const RenderSession& session) {
    while (!session.wait(std::chrono::milliseconds(1000))) {
    }
    ASSERT_EQ(session.progress().state, SessionState::Finished) << session.progress().error;
}

std::uint32_t all_passes() {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kFilmPasses; ++i) {
        bits |= pass_bit(static_cast<FilmPass>(i));
    }
    return bits;
}

// The left half of the picture is an emitting card at distance 4, the right half the world.
SceneDescription card() {
    SceneBuilder b;
    const auto emitter = b.material("emitter", emission_program(Rgb(0.2f, 0.4f, 0.8f), 1.0f));
    b.object(quad_mesh("hidden", Vec3(50), Vec3(1, 0, 0), Vec3(0, 1, 0)), emitter);
    b.object(quad_mesh("card", Vec3(-8, -8, 0), Vec3(8, 0, 0), Vec3(0, 16, 0)), emitter);
    b.world(background_program(Rgb(0.5f, 0.3f, 0.1f), 1.0f));
    b.camera(Vec3(0, 0, 4), Vec3(0), 0.9f, 8, 4);
    SceneDescription d = b.build();
    d.film.filter = PixelFilter::Box;
    d.settings.samples = 8;
    d.passes = {all_passes(), 1.0f, 6.0f, 1.0f, {3, 7}, {11}, {}};
    return d;
}

TEST(Passes, SimpleSceneHasTheExactValues) {
    const RenderSession session(card(), 2);
    finish(session);
    constexpr std::size_t kLeft = 8 + 1;
    constexpr std::size_t kRight = 8 + 6;
    const auto value = [&](FilmPass pass, std::size_t pixel, std::size_t channel = 0) {
        const auto channels = static_cast<std::size_t>(film_pass_channels(pass));
        return read(session, pass)[pixel * channels + channel];
    };
    EXPECT_EQ(value(FilmPass::ObjectIndex, kLeft), 7.0f);
    EXPECT_EQ(value(FilmPass::MaterialIndex, kLeft), 11.0f);
    EXPECT_EQ(value(FilmPass::ObjectIndex, kRight), 0.0f);
    EXPECT_FLOAT_EQ(value(FilmPass::Emission, kLeft, 2), 0.8f);
    EXPECT_EQ(value(FilmPass::Emission, kRight, 2), 0.0f);
    EXPECT_FLOAT_EQ(value(FilmPass::Environment, kRight), 0.5f);
    EXPECT_EQ(value(FilmPass::Environment, kLeft), 0.0f);
    EXPECT_EQ(value(FilmPass::Mist, kRight), 1.0f);
    EXPECT_EQ(value(FilmPass::Uv, kLeft, 2), 1.0f);
    EXPECT_EQ(value(FilmPass::Uv, kRight, 2), 0.0f);

    // The point of the first sample, and the means of what varies over the pixel.
    const float x = value(FilmPass::Position, kLeft, 0);
    const float y = value(FilmPass::Position, kLeft, 1);
    const float half = 4.0f * std::tan(0.45f);
    const float size = 2.0f * half / 8.0f;
    EXPECT_GE(x, -half + size);
    EXPECT_LE(x, -half + 2.0f * size);
    EXPECT_NEAR(value(FilmPass::Position, kLeft, 2), 0.0f, 1e-5f);
    EXPECT_NEAR(value(FilmPass::Uv, kLeft, 0), (x + 8.0f) / 8.0f, size / 8.0f);
    EXPECT_NEAR(value(FilmPass::Uv, kLeft, 1), (y + 8.0f) / 16.0f, size / 16.0f);
    const float distance = std::sqrt(x * x + y * y + 16.0f);
    EXPECT_NEAR(value(FilmPass::Mist, kLeft), (distance - 1.0f) / 6.0f, size / 6.0f);
}

// Panes in front: light through them keeps its share, and the surface that shows gives the index.
TEST(Passes, TransparentSurfacesLetPassesThrough) {
    SceneDescription d = card();
    SceneBuilder b;
    b.description() = std::move(d);
    const auto pane = b.material("pane", transparent_program(Rgb(0.75f)));
    b.object(quad_mesh("pane", Vec3(-8, -8, 2), Vec3(16, 0, 0), Vec3(0, 16, 0)), pane);
    SceneDescription with_pane = b.build();
    with_pane.passes.object_indices.push_back(99);
    const RenderSession session(std::move(with_pane), 2);
    finish(session);
    constexpr std::size_t kLeft = 8 + 1;
    constexpr std::size_t kRight = 8 + 6;
    EXPECT_FLOAT_EQ(read(session, FilmPass::Emission)[3 * kLeft + 2], 0.75f * 0.8f);
    EXPECT_FLOAT_EQ(read(session, FilmPass::Environment)[3 * kRight], 0.75f * 0.5f);
    EXPECT_EQ(read(session, FilmPass::ObjectIndex)[kLeft], 7.0f);
}

// What a program that emits writes beside: its emission's colour as AOV 0, `value` as AOV 1.
NodeProgram writing_program(const Rgb& color, float value) {
    ProgramBuilder b;
    b.closure(NodeOpCode::Emission, 0, {b.color(Vec3(1)), b.color(color), b.scalar(1.0f)});
    b.closure(NodeOpCode::AovColor, 0, {b.color(color)});
    b.closure(NodeOpCode::AovValue, 1, {b.scalar(value)});
    b.closure(NodeOpCode::AovValue, 0, {b.scalar(9.0f)});   // a colour's place: not written
    b.closure(NodeOpCode::AovValue, 12, {b.scalar(9.0f)});  // no place
    return b.build();
}

TEST(Passes, MaterialsWriteTheirOwn) {
    SceneDescription d = card();
    d.materials[0].program = writing_program(Rgb(0.25f, 0.5f, 2.0f), -3.0f);
    d.passes.wanted = 0;
    d.passes.aovs = {{"color", true}, {"value", false}};
    const RenderSession session(std::move(d), 2);
    finish(session);
    std::vector<float> color(8 * 4 * 4);
    std::vector<float> value(8 * 4);
    ASSERT_TRUE(session.read_aov(0, color));
    ASSERT_TRUE(session.read_aov(1, value));
    EXPECT_FALSE(session.read_aov(2, value));
    EXPECT_THROW(static_cast<void>(session.read_aov(0, value)), std::invalid_argument);
    constexpr std::size_t kLeft = 8 + 1;
    constexpr std::size_t kRight = 8 + 6;
    const float expected[4] = {0.25f, 0.5f, 2.0f, 1.0f};
    for (std::size_t c = 0; c < 4; ++c) {
        EXPECT_FLOAT_EQ(color[4 * kLeft + c], expected[c]);
        EXPECT_EQ(color[4 * kRight + c], 0.0f);
    }
    EXPECT_FLOAT_EQ(value[kLeft], -3.0f);
    EXPECT_EQ(value[kRight], 0.0f);
}

TEST(Passes, NoneWantedCostNothing) {
    SceneDescription d = card();
    d.passes.wanted = 0;
    const RenderSession session(std::move(d), 1);
    finish(session);
    std::vector<float> out(8 * 4 * 3);
    EXPECT_FALSE(session.has(FilmPass::Position));
    EXPECT_FALSE(session.read(FilmPass::Position, out));
    for (const StageStatistics& stage : session.statistics().stages) {
        if (stage.name == "write_passes") {
            EXPECT_EQ(stage.items, 0u);
        }
    }
}

// The picture itself does not change with what else is asked for.
TEST(Passes, CombinedIsTheSameWithAndWithout) {
    SceneDescription without = card();
    without.passes = {};
    EXPECT_EQ(render(card(), 2).combined, render(std::move(without), 1).combined);
}

SceneDescription lit_room(GuidingMode guiding) {
    SceneBuilder b;
    const auto white = b.material("white", diffuse_program(Rgb(0.7f)));
    b.object(box_mesh("room", Vec3(-2, -2, 0), Vec3(2, 2, 2.5f), true), white);
    b.lamp(area_lamp(look_at(Vec3(1, 1, 2.4f), Vec3(1, 1, 0)), Rgb(50.0f), 0.4f, 0.4f));
    b.camera(Vec3(0, -1.9f, 1.2f), Vec3(0, 0, 1), 1.0f, 32, 24);
    SceneDescription d = b.build();
    d.settings.samples = 24;
    d.settings.guiding = guiding;
    d.passes.wanted = kGuidePasses;
    return d;
}

// Diffuse, glossy, rough and smooth glass, a pane, an emitter and the world, guided or not: what
// the passes of light tell adds up to the picture.
TEST(Passes, LightByLobesAddsUpToThePicture) {
    for (const GuidingMode guiding : {GuidingMode::Off, GuidingMode::Slides}) {
        SceneBuilder b;
        b.description() = lit_room(guiding);
        const auto object = [&](const char* name, const Vec3& at, NodeProgram program) {
            b.object(sphere_mesh(name, at, 0.35f), b.material(name, std::move(program)));
        };
        object("gloss", Vec3(-0.8f, 0.2f, 0.4f), glossy_program(Rgb(0.8f, 0.6f, 0.4f), 0.2f));
        object("glass", Vec3(0.0f, 0.0f, 0.5f), glass_program(Rgb(0.9f, 1.0f, 0.8f), 0.0f, 1.5f));
        object("rough", Vec3(0.8f, 0.2f, 0.4f), glass_program(Rgb(1.0f), 0.3f, 1.4f));
        object("lamp", Vec3(1.0f, 0.8f, 1.2f), emission_program(Rgb(1.0f, 0.8f, 0.5f), 2.0f));
        const auto pane = b.material("pane", transparent_program(Rgb(0.8f)));
        b.object(quad_mesh("pane", Vec3(-2, -1, 0), Vec3(2, 0, 0), Vec3(0, 0, 2)), pane);
        SceneDescription d = b.build();
        d.film.exposure = 1.5f;
        d.passes.wanted = all_passes();
        const RenderSession session(std::move(d), 2);
        finish(session);
        auto sum = read(session, FilmPass::Emission);
        const auto environment = read(session, FilmPass::Environment);
        for (std::size_t i = 0; i < sum.size(); ++i) {
            sum[i] += environment[i];
        }
        bool seen[3] = {};
        for (std::size_t lobe = 0; lobe < 3; ++lobe) {
            const auto pass = [&](std::size_t part) {
                return read(
                    session,
                    static_cast<FilmPass>(static_cast<std::size_t>(FilmPass::DiffuseDirect) +
                                          3 * lobe + part));
            };
            const auto direct = pass(0);
            const auto indirect = pass(1);
            const auto color = pass(2);
            for (std::size_t i = 0; i < sum.size(); ++i) {
                sum[i] += (direct[i] + indirect[i]) * color[i];
                seen[lobe] |= (direct[i] + indirect[i]) * color[i] > 0.01f;
            }
        }
        EXPECT_TRUE(seen[0] && seen[1] && seen[2]);
        const auto combined = read(session, FilmPass::Combined);
        for (std::size_t i = 0; i < sum.size(); ++i) {
            const float expected = combined[i / 3 * 4 + i % 3];
            ASSERT_NEAR(sum[i], expected, 2e-4f * std::max(1.0f, expected)) << i;
        }
    }
}

TEST(Passes, GuideIsShownWhereItServes) {
    const RenderSession session(lit_room(GuidingMode::Slides), 2);
    finish(session);
    const auto direction = read(session, FilmPass::GuideDirection);
    const auto kappa = read(session, FilmPass::GuideKappa);
    const auto irradiance = read(session, FilmPass::GuideIrradiance);
    for (std::size_t i = 0; i < kappa.size(); ++i) {
        const Vec3 d(direction[3 * i], direction[3 * i + 1], direction[3 * i + 2]);
        ASSERT_NEAR(glm::length(d), 1.0f, 1e-5f);
        ASSERT_GT(kappa[i], 0.0f);
        ASSERT_GT(irradiance[i], 0.0f);
    }
    EXPECT_EQ(read(session, FilmPass::GuideShare), std::vector<float>(32 * 24, 0.5f));
}

TEST(Passes, GuidePassesAreTheSameOnAnyNumberOfThreads) {
    const RenderSession one(lit_room(GuidingMode::Slides), 1);
    const RenderSession three(lit_room(GuidingMode::Slides), 3);
    finish(one);
    finish(three);
    for (const FilmPass pass :
         {FilmPass::GuideDirection, FilmPass::GuideKappa, FilmPass::GuideIrradiance}) {
        EXPECT_EQ(read(one, pass), read(three, pass));
    }
}

TEST(Passes, GuideThatIsOffShowsNothing) {
    const RenderSession session(lit_room(GuidingMode::Off), 2);
    finish(session);
    EXPECT_EQ(read(session, FilmPass::GuideDirection), std::vector<float>(32 * 24 * 3));
    EXPECT_EQ(read(session, FilmPass::GuideShare), std::vector<float>(32 * 24));
}

}  // namespace
}  // namespace pharos
