// The cache of occluders stops only rays that the robust traversal stops too.
#include "geometry/occluder_cache.h"

#include <random>

#include <gtest/gtest.h>

#include "core/cancel.h"
#include "geometry/accelerator.h"
#include "geometry/speed_trial.h"

namespace pharos {
namespace {

class Random {
  public:
    float operator()(float low, float high) {
        return std::uniform_real_distribution<float>(low, high)(engine_);
    }

    Vec3 point(float size) {
        return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)};
    }

  private:
    std::mt19937 engine_{7};
};

TEST(OccluderCache, KnowsNothingWhenEmpty) {
    const OccluderCache cache;
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 1), Vec3(0, 0, -1)}));
    EXPECT_FALSE(cache.stops({Vec3(0), Vec3(1, 0, 0)}));
}

TEST(OccluderCache, StopsInsideAndBetweenTheEnds) {
    OccluderCache cache;
    cache.insert(Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(0, 1, 0));
    EXPECT_TRUE(cache.stops({Vec3(0, 0, 1), Vec3(0, 0, -1)}));
    EXPECT_TRUE(cache.stops({Vec3(0, 0, -1), Vec3(0, 0, 1)}));  // from behind
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 1), Vec3(0, 0, 1)}));
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 1), Vec3(0, 0, -1), 0.0f, 1.0f}));  // ends on it
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 0), Vec3(0, 0, -1)}));              // starts on it
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 1e-6f), Vec3(0.6f, 0, -0.8f)}));
    EXPECT_FALSE(cache.stops({Vec3(5, 0, 1), Vec3(0, 0, -1)}));
    // Eight others push it out.
    for (int i = 0; i < 8; ++i) {
        cache.insert(Vec3(9, 9, 9), Vec3(10, 9, 9), Vec3(9, 10, 9));
    }
    EXPECT_FALSE(cache.stops({Vec3(0, 0, 1), Vec3(0, 0, -1)}));
}

TEST(OccluderCache, BrokenTrianglesStopNothing) {
    OccluderCache cache;
    cache.insert(Vec3(1), Vec3(1), Vec3(1));
    cache.insert(Vec3(0), Vec3(1, 0, 0), Vec3(2, 0, 0));
    cache.insert(Vec3(std::nanf("")), Vec3(1, 0, 0), Vec3(0, 1, 0));
    Random random;
    for (int i = 0; i < 10000; ++i) {
        EXPECT_FALSE(cache.stops({random.point(2), glm::normalize(random.point(1))}));
    }
}

// Rays at all scales, many of them along edges, from and to surfaces.
TEST(OccluderCache, AgreesWithTheTraversal) {
    Random random;
    std::size_t stopped = 0;
    for (int round = 0; round < 200; ++round) {
        const float scale = std::pow(10.0f, random(-3.0f, 5.0f));
        Mesh mesh;
        for (int i = 0; i < 3; ++i) {
            mesh.positions.push_back(random.point(scale));
        }
        mesh.triangles.emplace_back(0, 1, 2);
        Instance instance;
        instance.materials = {0};
        const Accelerator accelerator(std::span(&mesh, 1), std::span(&instance, 1), CancelFlag());
        OccluderCache cache;
        cache.insert(mesh.positions[0], mesh.positions[1], mesh.positions[2]);
        for (int i = 0; i < 2000; ++i) {
            const float u = random(-0.05f, 1.05f);
            const Vec3 on_plane =
                mesh.positions[0] + u * (mesh.positions[1] - mesh.positions[0]) +
                random(-0.05f, 1.05f - u) * (mesh.positions[2] - mesh.positions[0]);
            Ray ray{i % 5 == 0 ? on_plane : random.point(3.0f * scale), Vec3(0)};
            const Vec3 to = on_plane - ray.origin;
            ray.direction = glm::length(to) > 0.0f ? glm::normalize(to) : Vec3(0, 0, 1);
            ray.t_max = i % 3 == 0 ? kInfinity : glm::length(to) * random(0.9f, 1.1f);
            if (cache.stops(ray)) {
                ++stopped;
                std::uint8_t occluded = 0;
                accelerator.occluded(std::span(&ray, 1), std::span(&occluded, 1));
                EXPECT_EQ(occluded, 1) << "round " << round << ", ray " << i;
            }
        }
    }
    EXPECT_GT(stopped, 50000u);
}

// A wall with a gap: whole batches, so that the accelerator tries its cache, against single rays.
TEST(OccluderCache, BatchesAgreeWithSingleRays) {
    Mesh mesh;
    for (const float x : {-10.0f, 0.3f}) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(
            mesh.positions.end(),
            {Vec3(x, -10, 0), Vec3(x + 9.7f, -10, 0), Vec3(x + 9.7f, 10, 0), Vec3(x, 10, 0)});
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangles.emplace_back(first, first + 2, first + 3);
    }
    Instance instance;
    instance.materials = {0};
    const Accelerator accelerator(std::span(&mesh, 1), std::span(&instance, 1), CancelFlag());
    Random random;
    constexpr std::size_t kBatch = 4096;
    for (int round = 0; round < 60; ++round) {
        std::vector<Ray> rays(kBatch);
        for (Ray& ray : rays) {
            ray.origin = Vec3(random(-8, 8), random(-8, 8), random(1, 3));
            const Vec3 to = Vec3(random(-8, 8), random(-8, 8), random(-3, -1)) - ray.origin;
            ray.direction = glm::normalize(to);
            ray.t_max = glm::length(to);
        }
        std::vector<std::uint8_t> together(kBatch);
        accelerator.occluded(rays, together);
        for (std::size_t i = 0; i < kBatch; ++i) {
            std::uint8_t alone = 0;
            accelerator.occluded(std::span(&rays[i], 1), std::span(&alone, 1));
            ASSERT_EQ(together[i], alone) << "round " << round << ", ray " << i;
        }
    }
}

TEST(SpeedTrial, TakesTheFasterWay) {
    SpeedTrial trial;
    volatile std::uint64_t sink = 0;
    for (int i = 0; i < 600 && trial.choice() < 0; ++i) {
        trial.run(1024, [&](bool second) {
            for (int k = 0; k < (second ? 2000 : 200000); ++k) {
                sink = sink + 1;
            }
        });
    }
    EXPECT_EQ(trial.choice(), 1);
    trial.run(1024, [](bool second) { EXPECT_TRUE(second); });
}

}  // namespace
}  // namespace pharos
