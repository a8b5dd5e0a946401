// Closed emitting boxes under a guide that is deliberately wrong: whatever it believes, the picture
// keeps its closed form within 0.1 %, and a density that is wrong by 1 % is found out.
//
// The linker sends the integrator's questions to the field (GuidingField::evaluate, see
// CMakeLists.txt) to answer() here: the renderer itself has no switch for this.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "integrator/integrator.h"
#include "support/description_builders.h"

namespace pharos::testing {
namespace {

using Poison = std::function<VmfMixture(const Vec3& p, const Vec3& n)>;

// What the field answers; set before a render starts and left alone while it runs.
Poison poison;

}  // namespace

void answer(const GuidingField* field, const FieldQuery& query, std::span<VmfMixture> mixtures) asm(
    "__wrap__ZNK6pharos12GuidingField8evaluateERKNS_10FieldQueryESt4spanINS_"
    "10VmfMixtureELm18446744073709551615EE");

void answer(const GuidingField* /*field*/,
            const FieldQuery& query,
            std::span<VmfMixture> mixtures) {
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
        mixtures[i] = poison(Vec3(query.px[i], query.py[i], query.pz[i]),
                             Vec3(query.nx[i], query.ny[i], query.nz[i]));
    }
}

namespace {

constexpr double kEmitted = 0.5;
constexpr double kAlbedo = 0.6;
constexpr std::uint32_t kSize = 16;  // pixels a side
constexpr std::uint32_t kSamples = 4096;
constexpr std::uint32_t kMaxBounces = 1;
constexpr double kBar = 1e-3;

// e (1 + a + a^2): radiance after kMaxBounces + 1 scatterings, wherever one looks.
const double kExact =
    kEmitted * (1.0 - std::pow(kAlbedo, static_cast<double>(kMaxBounces) + 2.0)) / (1.0 - kAlbedo);

// Everything emits and scatters alike; with `transmission` a sheet that lets light through, and
// mirrors some, stands in the middle.
SceneDescription emitting_box(bool transmission) {
    const Rgb albedo(static_cast<float>(kAlbedo));
    const Rgb emitted(static_cast<float>(kEmitted));
    SceneBuilder builder;
    const auto walls = builder.material("walls", diffuse_emission_program(albedo, emitted));
    builder.object(box_mesh("box", Vec3(-1, -2, -1.5f), Vec3(1.5f, 1, 1), true), walls);
    if (transmission) {
        const auto sheet = builder.material("sheet", sheet_emission_program(albedo, emitted));
        builder.object(quad_mesh("sheet", Vec3(0.4f, -1, -1), Vec3(0, 1.5f, 0), Vec3(0, 0, 1.5f)),
                       sheet);
    }
    builder.camera(Vec3(-0.8f, 0.4f, 0), Vec3(1, -0.5f, 0), 1.2f, kSize, kSize);
    SceneDescription description = builder.build();
    description.settings.max_bounces = kMaxBounces;
    return description;
}

struct Box {
    bool nee = true;
    bool transmission = false;
    bool roulette = false;
};

// Mean of the picture over the closed form, minus 1.
double error_of(const Box& box) {
    SceneDescription description = emitting_box(box.transmission);
    description.settings.use_nee = box.nee;
    const FilmDescription frame = description.film;
    SceneReport report;
    const CancelFlag cancel;
    ThreadPool pool;
    const auto scene = build_scene(std::move(description), cancel, report);
    const GuidingField field(GuidingConfig::neural(), scene->bounds);
    const std::vector<float> estimate(std::size_t{kSize} * kSize, static_cast<float>(kExact));
    GuidingContext guiding;
    guiding.field = &field;
    guiding.fixed_share = {0.5f, 0.5f};
    guiding.adjoint_scale.fill(box.roulette ? 1.0f : 0.0f);
    guiding.pixel_estimate = estimate;
    Integrator integrator(*scene, pool);
    SharedFilm film(frame);
    EXPECT_TRUE(integrator.render_pass({0, kSamples}, guiding, film, {cancel, {}}));
    EXPECT_EQ(integrator.statistics().nonfinite, 0u);
    EXPECT_GT(
        integrator.statistics().stages[static_cast<std::size_t>(Stage::QueryGuidingField)].items,
        kSize * kSize);
    std::vector<float> pixels(estimate.size() * 4);
    film.film.read(FilmPass::Combined, pixels);
    double sum = 0.0;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        sum += static_cast<double>(pixels[i]);
    }
    return sum / static_cast<double>(estimate.size()) / kExact - 1.0;
}

VmfMixture one_lobe(const Vec3& mu, float kappa, float A) {
    VmfMixture mixture;
    set_lobe(mixture, 0, 1.0f, {mu, kappa});
    mixture.A = mixture.expected = A;
    return mixture;
}

// About the right answer where light is even: a lobe as wide as the cosine around the normal.
VmfMixture fair(const Vec3& /*p*/, const Vec3& n) {
    return one_lobe(n, 1.5f, kPi);
}

VmfMixture rotated(const Vec3& /*p*/, const Vec3& n) {
    return one_lobe(-n, 3.0f, kPi);
}

// Along the surface, much narrower than the light, and sure of thirty times as much of it.
VmfMixture sideways(const Vec3& /*p*/, const Vec3& n) {
    return one_lobe(Vec3(n.y, n.z, n.x), 30.0f, 30.0f * kPi);
}

VmfMixture like_a_delta(const Vec3& /*p*/, const Vec3& /*n*/) {
    return one_lobe(Vec3(0.6f, 0.0f, 0.8f), 1e7f, 0.3f * kPi);
}

// Lobes of all widths, moving with the place, and an adjoint that is no number.
VmfMixture confused(const Vec3& p, const Vec3& n) {
    VmfMixture mixture;
    mixture.lobe_count = kMaxLobes;
    mixture.A = mixture.expected = std::nanf("");
    float kappa = 0.01f;
    Vec3 mu = normalize_or(p, n);
    for (int k = 0; k < kMaxLobes; ++k) {
        set_lobe(mixture, k, 1.0f / kMaxLobes, {mu, kappa});
        mu = normalize_or(Vec3(mu.y + n.z, mu.z + 0.3f * p.x, mu.x), n);
        kappa *= 8.0f;
    }
    return mixture;
}

struct Case {
    const char* name;
    Poison poison;
};

class PoisonedBoxStatistics : public ::testing::TestWithParam<Case> {};

TEST_P(PoisonedBoxStatistics, KeepsTheClosedForm) {
    poison = GetParam().poison;
    for (const bool nee : {true, false}) {
        for (const bool transmission : {false, true}) {
            Box box;
            box.nee = nee;
            box.transmission = transmission;
            box.roulette = transmission;
            EXPECT_LT(std::abs(error_of(box)), kBar) << "nee " << nee << ", sheet " << transmission;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Poisons,
                         PoisonedBoxStatistics,
                         ::testing::Values(Case{"Fair", fair},
                                           Case{"Rotated", rotated},
                                           Case{"Sideways", sideways},
                                           Case{"LikeADelta", like_a_delta},
                                           Case{"Confused", confused}),
                         [](const auto& test) { return test.param.name; });

// The test above is worth something: a density that is 1 % off moves the picture over its bar.
TEST(PoisonedBoxPowerStatistics, DensityWrongByOnePercentIsFoundOut) {
    for (const float factor : {0.99f, 1.01f}) {
        poison = [factor](const Vec3& p, const Vec3& n) {
            VmfMixture mixture = fair(p, n);
            mixture.coefficient[0] *= factor;
            return mixture;
        };
        for (const bool nee : {true, false}) {
            Box box;
            box.nee = nee;
            box.transmission = factor > 1.0f;
            EXPECT_GT(std::abs(error_of(box)), 1.3 * kBar) << "nee " << nee << ", " << factor;
        }
    }
}

}  // namespace
}  // namespace pharos::testing
