// Weights of the passes: those of a hard picture grow, and never look at the pixels they weigh.
#include "session/pass_weights.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace pharos {
namespace {

FilmDescription frame(std::uint32_t side) {
    FilmDescription description;
    description.width = description.crop_width = side;
    description.height = description.crop_height = side;
    return description;
}

// Samples of mean 1: `1 / chance` with that chance, else 0.
class RareLight {
  public:
    RareLight(double chance, std::uint32_t seed) : chance_(chance), random_(seed) {}

    float operator()() {
        return uniform_(random_) < chance_ ? static_cast<float>(1.0 / chance_) : 0.0f;
    }

  private:
    double chance_;
    std::mt19937 random_;
    std::uniform_real_distribution<double> uniform_;
};

// `wrong`: each colour takes the weights of the other.
void add_pass(Film& film, PassWeights& weights, RareLight& light, bool wrong = false) {
    std::vector<float> count(film.width() * film.height());
    film.read(FilmPass::SampleCount, count);
    const auto pass = static_cast<std::uint32_t>(count[0]);
    const std::array<double, 2> weight = weights.of(pass);
    for (std::uint32_t i = 0; i < film.width() * film.height(); ++i) {
        const std::uint32_t color = (i % film.width() + i / film.width() + (wrong ? 1 : 0)) % 2;
        film.add(i, {.radiance = Rgb(light())}, weight[color], pass % 2 == 0);
    }
    weights.see(film, pass + 1);
}

TEST(PassWeights, GrowWhereLightIsHardToFind) {
    for (const double chance : {0.5, 0.02}) {
        Film film(frame(32));
        PassWeights weights;
        RareLight light(chance, 1);
        for (std::uint32_t pass = 0; pass < 2; ++pass) {
            EXPECT_EQ(weights.of(pass), (std::array{1.0, 1.0}));
            add_pass(film, weights, light);
        }
        EXPECT_EQ(weights.hard(), chance < 0.1);
        const double last = chance < 0.1 ? 8.0 : 1.0;
        EXPECT_EQ(weights.of(100), (std::array{last, last}));
        EXPECT_LE(weights.of(2)[0], weights.of(3)[0]);
    }
}

// Known after one sample a pixel, whatever is painted on what is lit.
TEST(PassWeights, QuietLightIsSeenInTheFirstSample) {
    for (const bool painted : {false, true}) {
        for (const double chance : {0.7, 0.05}) {
            Film film(frame(64));
            RareLight light(chance, 4);
            for (std::uint32_t i = 0; i < 64 * 64; ++i) {
                const bool dark = painted && (i % 64 / 8 + i / 64 / 8) % 2 == 0;
                film.add(i, {.radiance = Rgb(light() * (dark ? 0.5f : 1.0f))}, 1.0, true);
            }
            PassWeights weights;
            EXPECT_FALSE(weights.quiet());
            weights.see(film, 1);
            EXPECT_EQ(weights.quiet(), chance > 0.1) << painted << " " << chance;
        }
    }
}

// Variance of a Bernoulli sample of mean 1 is 1 / chance - 1.
TEST(PassWeights, VarianceIsThatOfOneSample) {
    constexpr double kChance = 0.25;
    RareLight light(kChance, 3);
    FirstPasses passes{128, 128, {}, {}};
    for (std::uint32_t i = 0; i < 128 * 128; ++i) {
        passes.first.push_back(light());
        passes.second.push_back(light());
    }
    for (const double variance : relative_variance(passes)) {
        // The square of a noisy mean below the line adds some.
        EXPECT_NEAR(variance / (1.0 / kChance - 1.0), 1.15, 0.15);
    }
}

// A lamp or a bright window in the picture makes the rest of it dark beside it, not quiet.
TEST(PassWeights, NoiseBesideALampIsSeen) {
    constexpr std::uint32_t kSide = 128;
    constexpr std::uint32_t kLamp = 22;  // its side: three percent of the picture
    RareLight light(0.02, 5);
    FirstPasses passes{kSide, kSide, {}, {}};
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const bool in_lamp = i / kSide < kLamp && i % kSide < kLamp;
        passes.first.push_back(in_lamp ? 3000.0f : light());
        passes.second.push_back(in_lamp ? 3000.0f : light());
    }
    for (const double variance : relative_variance(passes)) {
        EXPECT_GT(variance, 20.0);
    }
}

// Light so rare that nearly all of the picture is black is hard to find; a black background is not.
TEST(PassWeights, BlackPixelsTellNothing) {
    constexpr std::uint32_t kSide = 128;
    Film rare(frame(kSide));
    PassWeights of_rare;
    RareLight light(2e-4, 5);
    for (int pass = 0; pass < 2; ++pass) {
        add_pass(rare, of_rare, light);
    }
    EXPECT_TRUE(of_rare.hard());
    FirstPasses small{kSide, kSide, {}, {}};
    FirstPasses whole{kSide, kSide, {}, {}};
    RareLight noise(0.3, 6);
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const bool inside = i % kSide < 12 && i / kSide < 12;
        for (const bool first : {true, false}) {
            const float value = noise();
            (first ? whole.first : whole.second).push_back(value);
            (first ? small.first : small.second).push_back(inside ? value : 0.0f);
        }
    }
    for (std::size_t color = 0; color < 2; ++color) {
        EXPECT_LT(relative_variance(small)[color], 4.0);
        EXPECT_NEAR(relative_variance(small)[color] / relative_variance(whole)[color], 0.8, 0.5);
    }
}

TEST(PassWeights, ColorsDecideForEachOther) {
    constexpr std::uint32_t kSide = 32;
    FirstPasses passes{kSide, kSide, {}, {}};
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const bool own = (i % kSide + i / kSide) % 2 == 0;
        passes.first.push_back(own ? 1.0f : (i % 14 < 2 ? 7.0f : 0.0f));
        passes.second.push_back(1.0f);
    }
    const std::array<double, 2> variance = relative_variance(passes);
    EXPECT_EQ(variance[0], 0.0);
    EXPECT_GT(variance[1], 0.5);
}

struct ManyPictures {
    double mean = 0.0;
    double standard_error = 0.0;
    double grown = 0.0;  // share of the pictures whose weights grew
};

// Pictures of mean 1 on the edge of being hard, so small that single samples decide.
ManyPictures render_pictures(bool wrong) {
    constexpr int kPictures = 20000;
    RareLight light(0.15, 11);
    ManyPictures out;
    double squares = 0.0;
    for (int picture = 0; picture < kPictures; ++picture) {
        Film film(frame(4));
        PassWeights weights;
        for (int pass = 0; pass < 4; ++pass) {
            add_pass(film, weights, light, wrong);
        }
        std::vector<float> combined(4 * 16);
        film.read(FilmPass::Combined, combined);
        double mean = 0.0;
        for (std::size_t i = 0; i < combined.size(); i += 4) {
            mean += static_cast<double>(combined[i]) / 16.0;
        }
        out.mean += mean / kPictures;
        squares += mean * mean / kPictures;
        out.grown += weights.of(4)[0] > 1.0 ? 1.0 / kPictures : 0.0;
    }
    out.standard_error = std::sqrt((squares - out.mean * out.mean) / kPictures);
    return out;
}

TEST(PassWeightsStatistics, PictureIsUnbiasedOnTheEdge) {
    const ManyPictures right = render_pictures(false);
    EXPECT_LT(std::abs(right.mean - 1.0), 4.0 * right.standard_error) << right.mean;
    EXPECT_GT(right.grown, 0.1);
    EXPECT_LT(right.grown, 0.9);
    // Pixels that decide for themselves are seen to be wrong.
    const ManyPictures wrong = render_pictures(true);
    EXPECT_GT(std::abs(wrong.mean - 1.0), 8.0 * wrong.standard_error) << wrong.mean;
}

TEST(PassWeights, BlackAndTinyPicturesAreEasy) {
    for (const std::uint32_t side : {1u, 2u, 9u}) {
        Film film(frame(side));
        PassWeights weights;
        RareLight dark(0.0, 5);
        add_pass(film, weights, dark);
        add_pass(film, weights, dark);
        EXPECT_FALSE(weights.hard());
    }
}

}  // namespace
}  // namespace pharos
