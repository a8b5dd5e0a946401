// Sampled directions against the density that eval_bsdf reports, for every kind of lobe.
#include <gtest/gtest.h>

#include "materials/lobes/ggx.h"
#include "native/materials/closure_cases.h"
#include "support/chi_square.h"

namespace pharos::test {
namespace {

constexpr int kConfigurations = 6;

std::optional<Vec3> smooth_direction(const Bsdf& bsdf, Random& random) {
    const float u = random.uniform();
    const auto s = sample_bsdf(bsdf, u, random.uniform2());
    return s && (s->lobe & kLobeDelta) == 0 ? std::optional(s->wi) : std::nullopt;
}

TEST(BsdfChiSquare, EveryLobeOverRandomParameters) {
    const std::vector<LobeCase> cases = lobe_cases();
    Random parameters(2024);
    for (const LobeCase& lobe : cases) {
        for (int i = 0; i < kConfigurations; ++i) {
            ClosureSetupContext ctx = make_context(
                direction_at(parameters.uniform(0.05f, 1.0f), parameters.uniform(0, 6)),
                i % 2 == 0 ? 304 : 405);
            ctx.front_face = i % 3 != 0;
            Surface surface;
            const Bsdf& bsdf = build(surface, ctx, lobe.make(parameters, 0.3f));
            ChiSquareOptions options;
            options.seed = parameters.bits();
            options.tests = static_cast<int>(cases.size()) * kConfigurations;
            options.frame = Frame::from_z(glm::normalize(Vec3(0.6f, 0.3f, 0.7f)));
            const ChiSquareResult result =
                chi_square_sphere([&](Random& r) { return smooth_direction(bsdf, r); },
                                  [&](const Vec3& wi) { return eval_bsdf(bsdf, wi).pdf; },
                                  options);
            EXPECT_TRUE(result.passed) << lobe.name << " #" << i << ": " << result.message;
        }
    }
}

// Single lobes that the nodes reach only inside of mixtures.
TEST(BsdfChiSquare, ClearcoatAndSheen) {
    Random parameters(5);
    for (int i = 0; i < 12; ++i) {
        Surface surface;
        Closure& c = surface.storage[0];
        c.type = i % 2 == 0 ? ClosureType::Clearcoat : ClosureType::Sheen;
        c.smith = i % 4 == 1 ? 1 : 0;
        c.weight = Rgb(1.0f);
        c.sample_weight = 1.0f;
        c.n = Vec3(0, 0, 1);
        c.tangent = Vec3(0, 1, 0);
        c.alpha_x = parameters.uniform(0.05f, 1.0f);
        c.alpha_y = i % 2 == 0 ? c.alpha_x : parameters.uniform(-1.0f, 1.0f);
        c.eta = 1.5f;
        const Vec3 wo = direction_at(parameters.uniform(0.1f, 1.0f));
        surface.bsdf = {std::span<const Closure>(surface.storage.data(), 1), wo, c.n, 1.0f};
        ChiSquareOptions options;
        options.seed = parameters.bits();
        options.tests = 12;
        options.frame = Frame::from_z(glm::normalize(Vec3(0.6f, -0.3f, 0.7f)));
        const ChiSquareResult result =
            chi_square_sphere([&](Random& r) { return smooth_direction(surface.bsdf, r); },
                              [&](const Vec3& wi) { return eval_bsdf(surface.bsdf, wi).pdf; },
                              options);
        EXPECT_TRUE(result.passed) << "#" << i << ": " << result.message;
    }
}

// Narrow lobes in the plane across their mirror or refracted direction, in units of their width.
TEST(BsdfChiSquare, NarrowLobes) {
    constexpr float kReach = 6.0f;
    Random parameters(78);
    int index = 0;
    for (const float alpha : {1e-4f, 1e-3f, 0.03f}) {
        for (const bool refraction : {false, true}) {
            ScatterInputs in;
            in.color = Rgb(1.0f);
            in.roughness = std::sqrt(alpha);
            in.ior = 1.5f;
            in.normal = Vec3(0, 0, 1);
            const Vec3 wo = direction_at(0.8f, 1.1f);
            Surface surface;
            const Bsdf& bsdf =
                build(surface, make_context(wo, 405), [&](const auto& ctx, ClosureSink& sink) {
                    (refraction ? setup_refraction : setup_glossy)(in, ctx, sink);
                });
            const float through = refracted_cosine(wo.z, in.ior);
            const Vec3 axis =
                refraction ? glm::normalize(Vec3(0, 0, 1) * (wo.z / in.ior - through) - wo / in.ior)
                           : Vec3(-wo.x, -wo.y, wo.z);
            const Frame frame = Frame::from_z(axis);
            ChiSquareOptions options;
            options.seed = parameters.bits();
            options.tests = 6;
            options.columns = 20;
            const ChiSquareResult result = chi_square_rectangle(
                [&](Random& r) -> std::optional<Vec2> {
                    const auto wi = smooth_direction(bsdf, r);
                    const Vec3 w = wi ? frame.to_local(*wi) / alpha : Vec3(1e9f);
                    const bool inside = std::max(std::abs(w.x), std::abs(w.y)) < kReach && w.z > 0;
                    return inside ? std::optional(Vec2(w.x, w.y)) : std::nullopt;
                },
                [&](const Vec2& p) {
                    const Vec2 q = p * alpha;
                    const float z = safe_sqrt(1.0f - glm::dot(q, q));
                    return eval_bsdf(bsdf, frame.to_world(Vec3(q.x, q.y, z))).pdf * alpha * alpha /
                           z;
                },
                Vec2(-kReach),
                Vec2(kReach),
                options);
            EXPECT_TRUE(result.passed) << "#" << index << ": " << result.message;
            ++index;
        }
    }
}

}  // namespace
}  // namespace pharos::test
