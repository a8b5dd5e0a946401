// What our tracing costs over a bare Embree loop on the same rays: camera rays in pixel order and
// rays after some diffuse bounces, in a room of boxes and in a room of fine spheres. Rays are
// traced in batches of the integrator's size; the bare loop has its queries ready. `of_bare` is the
// bare loop's time over ours.
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include "bench/limits.h"
#include "geometry/accelerator.h"
#include "geometry/instance_surface.h"
#include "geometry/ray_offset.h"
#include "sampling/warps.h"

namespace pharos {
namespace {

constexpr std::size_t kRays = 1u << 15;
constexpr std::size_t kBatch = 1024;

enum Room { kBoxes, kSpheres };

enum Rays { kCamera, kBounced };

void append_box(Mesh& mesh, const Vec3& lower, const Vec3& upper) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (int i = 0; i < 8; ++i) {
        mesh.positions.emplace_back(
            i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z);
    }
    constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides = {
        {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
    for (const auto& side : kSides) {
        mesh.triangles.emplace_back(base + side[0], base + side[1], base + side[2]);
        mesh.triangles.emplace_back(base + side[0], base + side[2], base + side[3]);
    }
}

void append_sphere(Mesh& mesh, const Vec3& center, float radius) {
    constexpr std::uint32_t kRings = 100;
    constexpr std::uint32_t kSegments = 200;
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
        for (std::uint32_t s = 0; s < kSegments; ++s) {
            const float theta = kPi * static_cast<float>(ring) / kRings;
            const float phi = 2.0f * kPi * static_cast<float>(s) / kSegments;
            const Vec3 n(
                std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            mesh.positions.push_back(center + radius * n);
        }
    }
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
        for (std::uint32_t s = 0; s < kSegments; ++s) {
            const std::uint32_t a = base + ring * kSegments + s;
            const std::uint32_t b = base + ring * kSegments + (s + 1) % kSegments;
            mesh.triangles.emplace_back(a, a + kSegments, b + kSegments);
            mesh.triangles.emplace_back(a, b + kSegments, b);
        }
    }
}

// The same triangles in our accelerator and in a scene of Embree's own, and rays through them.
struct Workload {
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<InstanceSurface> surfaces;
    std::unique_ptr<Accelerator> accelerator;
    RTCDevice device = rtcNewDevice(nullptr);
    RTCScene scene = rtcNewScene(device);
    std::vector<Ray> rays;
    std::vector<std::uint32_t> visibility;

    Workload(Room room, Rays kind) : visibility(kRays, kVisibleAll) {
        std::mt19937 random(5);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        const auto next_point = [&](float size) {
            const float x = unit(random);
            const float y = unit(random);
            return size * Vec3(x, y, unit(random));
        };
        Mesh mesh;
        append_box(mesh, Vec3(-3.0f), Vec3(3.0f));
        for (int i = 0; i < (room == kBoxes ? 2 : 30); ++i) {
            const Vec3 center = next_point(2.2f);
            room == kBoxes ? append_box(mesh, center - 0.7f, center + 0.7f)
                           : append_sphere(mesh, center, 0.3f + 0.2f * unit(random));
        }
        meshes.push_back(std::move(mesh));
        Instance instance;
        instance.materials.assign(1, 0);
        instances.push_back(instance);
        surfaces = make_instance_surfaces(meshes, instances);
        accelerator = std::make_unique<Accelerator>(meshes, instances, CancelFlag());
        build_bare_scene();
        make_camera_rays();
        for (int bounce = 0; kind == kBounced && bounce < 3; ++bounce) {
            bounce_rays(random);
        }
    }

    ~Workload() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }

    Workload(const Workload&) = delete;
    Workload& operator=(const Workload&) = delete;

    void build_bare_scene() const {
        const Mesh& mesh = meshes.front();
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry,
                                                                     RTC_BUFFER_TYPE_VERTEX,
                                                                     0,
                                                                     RTC_FORMAT_FLOAT3,
                                                                     3 * sizeof(float),
                                                                     mesh.positions.size()));
        auto* triangles =
            static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry,
                                                                RTC_BUFFER_TYPE_INDEX,
                                                                0,
                                                                RTC_FORMAT_UINT3,
                                                                3 * sizeof(std::uint32_t),
                                                                mesh.triangles.size()));
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                vertices[3 * i + static_cast<std::size_t>(axis)] = mesh.positions[i][axis];
            }
        }
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            for (int corner = 0; corner < 3; ++corner) {
                triangles[3 * i + static_cast<std::size_t>(corner)] = mesh.triangles[i][corner];
            }
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcCommitScene(scene);
    }

    void make_camera_rays() {
        constexpr std::size_t kWidth = 256;
        constexpr std::size_t kHeight = kRays / kWidth;
        for (std::size_t i = 0; i < kRays; ++i) {
            const std::size_t row = i / kWidth;
            const float x = static_cast<float>(i % kWidth) / kWidth - 0.5f;
            const float y = static_cast<float>(row) / kHeight - 0.5f;
            rays.push_back({Vec3(0.0f, -2.95f, 0.0f), glm::normalize(Vec3(x, 1.0f, 0.6f * y))});
        }
    }

    void bounce_rays(std::mt19937& random) {
        std::uniform_real_distribution<float> unit(0.0f, kOneMinusEpsilon);
        std::vector<Hit> hits(kRays);
        accelerator->intersect(rays, visibility, hits);
        for (std::size_t i = 0; i < kRays; ++i) {
            if (hits[i].instance == kNone) {
                continue;
            }
            const SurfaceInteraction si = surface_interaction(surfaces[0], rays[i], hits[i]);
            const float u = unit(random);
            const Vec3 local = sample_cosine_hemisphere(Vec2(u, unit(random)));
            const Vec3 wi = Frame::from_z(si.ng).to_world(local);
            rays[i] = {offset_ray_origin(si.p, si.ng, si.p_error, wi), wi};
        }
    }
};

RTCRayHit bare_query(const Ray& ray) {
    RTCRayHit query{};
    query.ray.org_x = ray.origin.x;
    query.ray.org_y = ray.origin.y;
    query.ray.org_z = ray.origin.z;
    query.ray.dir_x = ray.direction.x;
    query.ray.dir_y = ray.direction.y;
    query.ray.dir_z = ray.direction.z;
    query.ray.tfar = ray.t_max;
    query.ray.mask = kVisibleAll;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return query;
}

// All rays of a workload by Embree alone, time after time.
class BareLoop {
  public:
    explicit BareLoop(const Workload& work) : work_(work) {
        rtcInitIntersectContext(&context_);
        for (const Ray& ray : work.rays) {
            queries_.push_back(bare_query(ray));
        }
    }

    void intersect() {
        for (std::size_t i = 0; i < queries_.size(); ++i) {
            queries_[i].ray.tfar = work_.rays[i].t_max;
            queries_[i].hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(work_.scene, &context_, &queries_[i]);
        }
        benchmark::DoNotOptimize(queries_.data());
    }

    void occlude() {
        for (std::size_t i = 0; i < queries_.size(); ++i) {
            queries_[i].ray.tfar = work_.rays[i].t_max;
            rtcOccluded1(work_.scene, &context_, &queries_[i].ray);
        }
        benchmark::DoNotOptimize(queries_.data());
    }

  private:
    const Workload& work_;
    RTCIntersectContext context_{};
    std::vector<RTCRayHit> queries_;
};

void trace_ours(benchmark::State& state, Room room, Rays kind, RayOrder order) {
    const Workload work(room, kind);
    BareLoop bare(work);
    const double bare_seconds = bench::least_seconds([&] { bare.intersect(); });
    std::vector<Hit> hits(kBatch);
    const std::span<const std::uint32_t> visibility(work.visibility);
    const bench::LoopTime time;
    for (auto _ : state) {
        for (std::size_t first = 0; first < kRays; first += kBatch) {
            const std::span<const Ray> batch = std::span(work.rays).subspan(first, kBatch);
            work.accelerator->intersect(batch, visibility.first(kBatch), hits, order);
            benchmark::DoNotOptimize(hits.data());
        }
    }
    bench::set_per_item(state, kRays);
    time.set_of_bare(state, bare_seconds);
}

void trace_bare(benchmark::State& state, Room room, Rays kind) {
    const Workload work(room, kind);
    BareLoop bare(work);
    for (auto _ : state) {
        bare.intersect();
    }
    bench::set_per_item(state, kRays);
}

void occluded_ours(benchmark::State& state, Room room, Rays kind) {
    Workload work(room, kind);
    for (Ray& ray : work.rays) {
        ray.t_max = 1.0f;  // as far as a near lamp
    }
    BareLoop bare(work);
    const double bare_seconds = bench::least_seconds([&] { bare.occlude(); });
    std::vector<std::uint8_t> occluded(kBatch);
    const bench::LoopTime time;
    for (auto _ : state) {
        for (std::size_t first = 0; first < kRays; first += kBatch) {
            const std::span<const Ray> batch = std::span(work.rays).subspan(first, kBatch);
            work.accelerator->occluded(batch, occluded);
            benchmark::DoNotOptimize(occluded.data());
        }
    }
    bench::set_per_item(state, kRays);
    time.set_of_bare(state, bare_seconds);
}

void interactions(benchmark::State& state, Room room, Rays kind) {
    const Workload work(room, kind);
    std::vector<Hit> hits(kRays);
    work.accelerator->intersect(work.rays, work.visibility, hits);
    for (auto _ : state) {
        for (std::size_t i = 0; i < kRays; ++i) {
            if (hits[i].instance != kNone) {
                benchmark::DoNotOptimize(
                    surface_interaction(work.surfaces[0], work.rays[i], hits[i]));
            }
        }
    }
    bench::set_per_item(state, kRays);
}

BENCHMARK_CAPTURE(trace_ours, boxes_camera, kBoxes, kCamera, RayOrder::Incoherent);
BENCHMARK_CAPTURE(trace_ours, boxes_camera_stream, kBoxes, kCamera, RayOrder::Coherent);
BENCHMARK_CAPTURE(trace_bare, boxes_camera, kBoxes, kCamera);
BENCHMARK_CAPTURE(trace_ours, boxes_bounced, kBoxes, kBounced, RayOrder::Incoherent);
BENCHMARK_CAPTURE(trace_bare, boxes_bounced, kBoxes, kBounced);
BENCHMARK_CAPTURE(occluded_ours, boxes_bounced, kBoxes, kBounced);
BENCHMARK_CAPTURE(interactions, boxes_bounced, kBoxes, kBounced);
BENCHMARK_CAPTURE(trace_ours, spheres_camera, kSpheres, kCamera, RayOrder::Incoherent);
BENCHMARK_CAPTURE(trace_ours, spheres_camera_stream, kSpheres, kCamera, RayOrder::Coherent);
BENCHMARK_CAPTURE(trace_bare, spheres_camera, kSpheres, kCamera);
BENCHMARK_CAPTURE(trace_ours, spheres_bounced, kSpheres, kBounced, RayOrder::Incoherent);
BENCHMARK_CAPTURE(trace_bare, spheres_bounced, kSpheres, kBounced);
BENCHMARK_CAPTURE(occluded_ours, spheres_bounced, kSpheres, kBounced);
BENCHMARK_CAPTURE(interactions, spheres_bounced, kSpheres, kBounced);

}  // namespace
}  // namespace pharos
