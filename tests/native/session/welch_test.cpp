// Guided against unguided renders by Welch's test: the same mean in every block of pixels, so that
// p-values are spread evenly, and in the whole picture.
//
// Long form: tests/welch renders scenes of the project with 64 seeds (PHAROS_WELCH names a folder
// of dump files).
#include "support/welch.h"

#include <cstdlib>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>

#include "core/color.h"
#include "scene/dump.h"
#include "support/render.h"
#include "support/stress.h"
#include "support/test_scenes.h"

namespace pharos::testing {
namespace {

constexpr std::size_t kBlock = 8;

// Block means of luminance over seeds, and those of the picture in the last place.
struct BlockMoments {
    std::vector<Moments> blocks;
    Moments picture;
};

void add_picture(const Rendered& result, const FilmDescription& film, BlockMoments& moments) {
    const std::size_t columns = film.crop_width / kBlock;
    const std::size_t rows = film.crop_height / kBlock;
    std::vector<double> sums(columns * rows, 0.0);
    double all = 0.0;
    for (std::size_t y = 0; y < rows * kBlock; ++y) {
        for (std::size_t x = 0; x < columns * kBlock; ++x) {
            const float* rgba = &result.combined[4 * (y * film.crop_width + x)];
            const auto value = static_cast<double>(luminance(Rgb(rgba[0], rgba[1], rgba[2])));
            sums[y / kBlock * columns + x / kBlock] += value;
            all += value;
        }
    }
    moments.blocks.resize(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        moments.blocks[i].add(sums[i]);
    }
    moments.picture.add(all);
}

BlockMoments render_seeds(SceneDescription description, GuidingMode mode, std::uint32_t seeds) {
    BlockMoments moments;
    description.settings.guiding = mode;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
        description.settings.seed = seed + (mode == GuidingMode::Off ? 0u : 1000u);
        add_picture(render(description), description.film, moments);
    }
    return moments;
}

struct Agreement {
    double uniformity = 0.0;  // probability of p-values spread as unevenly as these
    double picture_t = 0.0;   // of the whole picture's means
};

Agreement compare(const SceneDescription& description,
                  std::uint32_t seeds,
                  GuidingMode mode = GuidingMode::Neural) {
    const BlockMoments off = render_seeds(description, GuidingMode::Off, seeds);
    const BlockMoments guided = render_seeds(description, mode, seeds);
    std::vector<double> p;
    for (std::size_t i = 0; i < off.blocks.size(); ++i) {
        if (off.blocks[i].mean > 0.0 || guided.blocks[i].mean > 0.0) {
            p.push_back(welch_test(guided.blocks[i], off.blocks[i]).p);
        }
    }
    return {uniformity_p(p), welch_test(guided.picture, off.picture).t};
}

TEST(WelchStatistics, NormalNumbersPassAndShiftedOnesFail) {
    std::mt19937 random(1);
    std::normal_distribution<double> wide(1.0, 0.3);
    std::normal_distribution<double> narrow(1.0, 0.1);
    for (const double shift : {0.0, 0.05}) {
        std::vector<double> p;
        for (int i = 0; i < 500; ++i) {
            Moments a;
            Moments b;
            for (int seed = 0; seed < 64; ++seed) {
                a.add(wide(random));
                b.add(narrow(random) + shift);
            }
            p.push_back(welch_test(a, b).p);
        }
        EXPECT_EQ(uniformity_p(p) > 0.01, shift == 0.0) << uniformity_p(p);
    }
    EXPECT_NEAR(two_sided_p(2.228, 10.0), 0.05, 1e-4);
    EXPECT_NEAR(two_sided_p(12.706, 1.0), 0.05, 1e-4);
}

TEST(WelchStatistics, GuidedAndUnguidedHaveOneMean) {
    const Agreement agreement = compare(two_rooms(32, 24, 20), 10);
    EXPECT_GT(agreement.uniformity, 1e-4);
    EXPECT_LT(std::abs(agreement.picture_t), 4.0);
}

// Two rooms side by side, open towards the camera and nowhere else: light of one never gets into
// the other. One has a lamp of 1e8, the other an ember of 1e-8.
SceneDescription huge_and_tiny(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
    SceneBuilder builder;
    const auto white = builder.material("white", diffuse_program(Rgb(0.7f)));
    const auto gloss = builder.material("gloss", glossy_program(Rgb(0.8f), 0.3f));
    const auto ember = builder.material("ember", diffuse_emission_program(Rgb(0.5f), Rgb(1e-8f)));
    const Vec3 wide(4, 0, 0);
    const Vec3 deep(0, 2, 0);
    const Vec3 high(0, 0, 2);
    builder.object(quad_mesh("floor", Vec3(-2, 0, 0), wide, deep), white);
    builder.object(quad_mesh("ceiling", Vec3(-2, 0, 2), wide, deep), white);
    builder.object(quad_mesh("back", Vec3(-2, 2, 0), wide, high), white);
    for (const float x : {-2.0f, 0.0f, 2.0f}) {
        builder.object(quad_mesh("side", Vec3(x, 0, 0), deep, high), white);
    }
    builder.object(sphere_mesh("left", Vec3(-1, 1.2f, 0.4f), 0.4f), gloss);
    builder.object(sphere_mesh("right", Vec3(1.2f, 1.4f, 0.4f), 0.4f), gloss);
    builder.object(box_mesh("ember", Vec3(0.3f, 0.8f, 1.0f), Vec3(0.5f, 1.0f, 1.2f)), ember);
    builder.lamp(area_lamp(look_at(Vec3(-1, 1, 1.9f), Vec3(-1, 1, 0)), Rgb(1e8f), 0.4f, 0.4f));
    builder.camera(Vec3(0, -4.5f, 1), Vec3(0, 1, 1), 0.8f, width, height);
    SceneDescription description = builder.build();
    description.settings.samples = samples;
    return description;
}

TEST(WelchStatistics, HugeAndTinyEmissionHaveOneMeanWithAGuide) {
    for (const GuidingMode mode : {GuidingMode::Neural, GuidingMode::Slides}) {
        const auto seeds = static_cast<std::uint32_t>(case_count(10, 40));
        const Agreement agreement = compare(huge_and_tiny(48, 32, 20), seeds, mode);
        EXPECT_GT(agreement.uniformity, 1e-4) << static_cast<int>(mode);
        EXPECT_LT(std::abs(agreement.picture_t), 4.0) << static_cast<int>(mode);
        say_stress("lights of 1e8 and 1e-8 with a guide: its means differ by sigmas",
                   seeds,
                   std::abs(agreement.picture_t),
                   4.0);
    }
    // The rooms are as far apart as their lights.
    const BlockMoments blocks = render_seeds(huge_and_tiny(48, 32, 4), GuidingMode::Neural, 2);
    EXPECT_GT(blocks.blocks[6 + 1].mean, 1e5);
    EXPECT_GT(blocks.blocks[6 + 4].mean, 0.0);
    EXPECT_LT(blocks.blocks[6 + 4].mean, 1e-5);
}

TEST(WelchLongStatistics, ScenesOfTheProject) {
    const char* folder = std::getenv("PHAROS_WELCH");
    if (folder == nullptr) {
        GTEST_SKIP() << "tests/welch is the long form";
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        SceneDescription description = read_dump(entry.path().string());
        // The same view in 64 pixels across: a render takes a moment, and blocks are many.
        FilmDescription& film = description.film;
        film.height = film.crop_height = std::max(64u * film.height / film.width, 8u);
        film.width = film.crop_width = 64;
        film.crop_x = film.crop_y = 0;
        description.settings.samples = 64;
        const Agreement agreement = compare(description, 64);
        std::printf("MEASURED %s: p-values uniform with p = %.3f, picture differs by %.2f sigma\n",
                    entry.path().stem().c_str(),
                    agreement.uniformity,
                    agreement.picture_t);
        std::fflush(stdout);
        EXPECT_GT(agreement.uniformity, 1e-3) << entry.path();
        EXPECT_LT(std::abs(agreement.picture_t), 3.0) << entry.path();
    }
}

}  // namespace
}  // namespace pharos::testing
