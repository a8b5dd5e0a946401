#include "geometry/accelerator.h"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include "core/check.h"
#include "core/fp_state.h"
#include "geometry/instance_surface.h"
#include "geometry/occluder_cache.h"
#include "geometry/speed_trial.h"

namespace pharos {

namespace {

constexpr std::uint32_t kCancelPollInterval = 1u << 16;  // vertices or triangles copied in between
constexpr std::size_t kShortBuild = 100000;              // triangles or instances, tens of ms
constexpr std::size_t kCacheTrial = 64;                  // rays
constexpr std::chrono::milliseconds kPollInterval(5);
constexpr std::chrono::milliseconds kPatience(100);  // with a build that has been told to stop

struct DeviceRelease {
    void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};

struct SceneRelease {
    void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};

struct GeometryRelease {
    void operator()(RTCGeometryTy* geometry) const { rtcReleaseGeometry(geometry); }
};

using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceRelease>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneRelease>;
using GeometryPtr = std::unique_ptr<RTCGeometryTy, GeometryRelease>;

// What Embree's callbacks see while it builds, on any of its threads.
struct Monitor {
    std::atomic<bool> stop{false};
    std::atomic<std::int64_t> bytes{0};
};

bool on_memory(void* user, ssize_t change, bool /*post*/) {
    auto& monitor = *static_cast<Monitor*>(user);
    monitor.bytes.fetch_add(change, std::memory_order_relaxed);
    // A refused allocation ends a build early; releases are never refused.
    return change <= 0 || !monitor.stop.load(std::memory_order_relaxed);
}

bool on_progress(void* user, double /*fraction*/) {
    return !static_cast<const Monitor*>(user)->stop.load(std::memory_order_relaxed);
}

void throw_if_cancelled(const CancelFlag& cancel) {
    if (cancel.cancelled()) {
        throw Cancelled();
    }
}

void throw_if_failed(RTCError error) {
    switch (error) {
        case RTC_ERROR_NONE:
            return;
        case RTC_ERROR_OUT_OF_MEMORY:
            throw std::bad_alloc();
        case RTC_ERROR_CANCELLED:
            throw Cancelled();
        default:
            throw std::runtime_error("Embree error " + std::to_string(error));
    }
}

// No threads= here: it would set the task scheduler's limit for the whole process, host included.
DevicePtr make_device() {
    DevicePtr device(rtcNewDevice(nullptr));
    if (device == nullptr) {
        throw std::runtime_error("Embree cannot be started");
    }
    if (rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_VERSION) / 10000 != 3 ||
        rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0) {
        throw std::runtime_error("Embree 3 with ray masks is needed");
    }
    return device;
}

ScenePtr make_scene(RTCDevice device, Monitor& monitor) {
    ScenePtr scene(rtcNewScene(device));
    if (scene == nullptr) {
        throw std::bad_alloc();
    }
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneProgressMonitorFunction(scene.get(), on_progress, &monitor);
    return scene;
}

// Copies a mesh into buffers of Embree's own, transformed unless `to_world` is null.
GeometryPtr make_triangles(RTCDevice device,
                           const Mesh& mesh,
                           const Mat4* to_world,
                           const CancelFlag& cancel) {
    GeometryPtr geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry.get(),
                                                                 RTC_BUFFER_TYPE_VERTEX,
                                                                 0,
                                                                 RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float),
                                                                 mesh.positions.size()));
    auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry.get(),
                                                                          RTC_BUFFER_TYPE_INDEX,
                                                                          0,
                                                                          RTC_FORMAT_UINT3,
                                                                          3 * sizeof(std::uint32_t),
                                                                          mesh.triangles.size()));
    throw_if_failed(rtcGetDeviceError(device));
    CHECK(vertices != nullptr && triangles != nullptr);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        const Vec3 p = to_world ? transform_point(*to_world, mesh.positions[i]) : mesh.positions[i];
        vertices[3 * i] = p.x;
        vertices[3 * i + 1] = p.y;
        vertices[3 * i + 2] = p.z;
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (i % kCancelPollInterval == 0) {
            throw_if_cancelled(cancel);
        }
        const UVec3& t = mesh.triangles[i];
        triangles[3 * i] = t.x;
        triangles[3 * i + 1] = t.y;
        triangles[3 * i + 2] = t.z;
    }
    return geometry;
}

GeometryPtr make_instance(RTCDevice device, RTCScene object, const Mat4& to_world) {
    GeometryPtr geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(geometry.get(), object);
    rtcSetGeometryTimeStepCount(geometry.get(), 1);
    float columns[12];
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            columns[3 * column + row] = to_world[column][row];
        }
    }
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    return geometry;
}

// False for rays Embree must not see: x - x is 0 for finite x and NaN otherwise.
bool traceable(const Ray& ray) {
    const Vec3 zero = (ray.origin - ray.origin) + (ray.direction - ray.direction);
    return zero.x + zero.y + zero.z + (ray.t_min - ray.t_min) == 0.0f && ray.t_max >= ray.t_min;
}

// Two whole-register stores: the traversal reads these members back as vectors.
void fill(RTCRay& out, const Ray& ray, std::uint32_t mask) {
    _mm_store_ps(&out.org_x, _mm_setr_ps(ray.origin.x, ray.origin.y, ray.origin.z, ray.t_min));
    _mm_store_ps(&out.dir_x, _mm_setr_ps(ray.direction.x, ray.direction.y, ray.direction.z, 0.0f));
    out.tfar = ray.t_max;
    out.mask = mask;
    out.id = 0;
    out.flags = 0;
}

void fill(RTCRayHit& out, const Ray& ray, std::uint32_t mask) {
    fill(out.ray, ray, mask);
    out.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    out.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

Hit hit_of(const RTCRayHit& query) {
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        return Hit{};
    }
    const bool shared = query.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
    return {query.ray.tfar,
            query.hit.u,
            query.hit.v,
            shared ? query.hit.instID[0] : query.hit.geomID,
            query.hit.primID};
}

// Chunks in the order given, which Embree traverses as frusta.
void intersect_stream(RTCScene scene,
                      std::span<const Ray> rays,
                      std::span<const std::uint32_t> visibility,
                      std::span<Hit> hits) {
    constexpr std::size_t kChunk = 64;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    std::array<RTCRayHit, kChunk> queries;
    std::array<std::size_t, kChunk> ray_of;
    for (std::size_t begin = 0; begin < rays.size(); begin += kChunk) {
        unsigned count = 0;
        for (std::size_t i = begin; i < std::min(begin + kChunk, rays.size()); ++i) {
            hits[i] = Hit{};
            if (traceable(rays[i])) {
                fill(queries[count], rays[i], visibility[i]);
                ray_of[count++] = i;
            }
        }
        rtcIntersect1M(scene, &context, queries.data(), count, sizeof(RTCRayHit));
        for (unsigned k = 0; k < count; ++k) {
            hits[ray_of[k]] = hit_of(queries[k]);
        }
    }
}

// Buffers of a mesh that is traced in world space; null for an instanced one.
struct WorldTriangles {
    const float* vertices = nullptr;
    const std::uint32_t* indices = nullptr;
};

void occluded_plain(RTCScene scene, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay query;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        occluded[i] = 0;
        if (traceable(rays[i])) {
            fill(query, rays[i], kVisibleShadow);
            rtcOccluded1(scene, &context, &query);
            occluded[i] = query.tfar < 0.0f ? 1 : 0;  // Embree marks occlusion by tfar = -inf
        }
    }
}

// Everything a build makes. Shared with the thread that runs a long build.
struct Structure {
    Monitor monitor;  // outlives the device, whose end it still counts
    DevicePtr device;
    std::vector<ScenePtr> objects;  // of meshes used more than once, by mesh index
    ScenePtr scene;
};

struct Commit {
    std::shared_ptr<Structure> structure;
    RTCScene scene = nullptr;
    std::mutex mutex;
    std::condition_variable changed;
    bool done = false;
    RTCError error = RTC_ERROR_NONE;

    void run() {
        const FloatStateGuard float_state;
        rtcCommitScene(scene);
        const std::lock_guard lock(mutex);
        error = rtcGetDeviceError(structure->device.get());  // errors are kept by thread
        done = true;
        changed.notify_all();
    }

    // True when the build has ended within the time.
    bool wait(std::chrono::milliseconds time) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, time, [this] { return done; });
    }
};

// Builds that were cancelled but still run: Embree asks its monitor only between stages, which take
// up to seconds for ten million triangles. They are joined when they have ended or, at the latest,
// when the process exits, because Embree must not be torn down under them.
class AbandonedBuilds {
  public:
    static AbandonedBuilds& instance() {
        static AbandonedBuilds builds;
        return builds;
    }

    void keep(std::jthread thread, std::shared_ptr<Commit> commit) {
        const std::lock_guard lock(mutex_);
        std::erase_if(builds_, [](const Build& build) {
            return build.commit->wait(std::chrono::milliseconds(0));
        });
        builds_.push_back({std::move(commit), std::move(thread)});
    }

  private:
    struct Build {
        std::shared_ptr<Commit> commit;
        std::jthread thread;  // joined before commit goes
    };

    std::mutex mutex_;
    std::vector<Build> builds_;
};

// A build too long to wait for its end runs on a thread of its own, and is left behind there when
// it does not end soon after it was cancelled.
void commit_scene(const std::shared_ptr<Structure>& structure,
                  RTCScene scene,
                  std::size_t triangles,
                  const CancelFlag& cancel) {
    throw_if_cancelled(cancel);
    const auto commit = std::make_shared<Commit>();
    commit->structure = structure;
    commit->scene = scene;
    if (triangles < kShortBuild) {
        commit->run();
    } else {
        std::jthread thread([commit] { commit->run(); });
        while (!commit->wait(kPollInterval)) {
            if (!cancel.cancelled()) {
                continue;
            }
            structure->monitor.stop.store(true, std::memory_order_relaxed);
            if (!commit->wait(kPatience)) {
                AbandonedBuilds::instance().keep(std::move(thread), commit);
            }
            throw Cancelled();
        }
    }
    throw_if_cancelled(cancel);
    throw_if_failed(commit->error);
}

}  // namespace

struct Accelerator::Impl {
    std::shared_ptr<Structure> structure = std::make_shared<Structure>();
    RTCScene scene = nullptr;  // the structure's
    Bounds3 bounds;
    std::vector<WorldTriangles> world;  // by instance
    SpeedTrial occluder_trial;          // with the cache of occluders or without

    void build(std::span<const Mesh> meshes,
               std::span<const Instance> instances,
               const CancelFlag& cancel);
    void attach(std::uint32_t index, const GeometryPtr& geometry, std::uint32_t visibility) const;
    void occluded_cached(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;
    void remember(const RTCHit& hit, OccluderCache& cache) const;
    [[nodiscard]] RTCScene object_scene(const Mesh& mesh,
                                        std::uint32_t index,
                                        const CancelFlag& cancel) const;
};

// A cache of its own for each call: neighbouring pixels share their occluders. Where it stops less
// than half of the rays it is left alone.
void Accelerator::Impl::occluded_cached(std::span<const Ray> rays,
                                        std::span<std::uint8_t> occluded) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    OccluderCache cache;
    std::size_t asked = 0;
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        occluded[i] = 0;
        if (!traceable(rays[i])) {
            continue;
        }
        if (asked >= kCacheTrial && 2 * stopped < asked) {
            occluded_plain(scene, rays.subspan(i), occluded.subspan(i));
            return;
        }
        ++asked;
        if (cache.stops(rays[i])) {
            ++stopped;
            occluded[i] = 1;
            continue;
        }
        RTCRayHit query;
        fill(query, rays[i], kVisibleShadow);
        rtcIntersect1(scene, &context, &query);
        if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
            occluded[i] = 1;
            remember(query.hit, cache);
        }
    }
}

// Only triangles in world space: those of instances would have to be transformed each time.
void Accelerator::Impl::remember(const RTCHit& hit, OccluderCache& cache) const {
    const WorldTriangles& mesh = world[hit.geomID];
    if (hit.instID[0] != RTC_INVALID_GEOMETRY_ID || mesh.vertices == nullptr) {
        return;
    }
    const auto corner = [&](std::size_t k) {
        const float* p = mesh.vertices + 3 * std::size_t{mesh.indices[3 * hit.primID + k]};
        return Vec3(p[0], p[1], p[2]);
    };
    cache.insert(corner(0), corner(1), corner(2));
}

// The scene of a shared mesh, built when it is first met.
RTCScene Accelerator::Impl::object_scene(const Mesh& mesh,
                                         std::uint32_t index,
                                         const CancelFlag& cancel) const {
    RTCDevice device = structure->device.get();
    ScenePtr& object = structure->objects[index];
    if (object == nullptr) {
        object = make_scene(device, structure->monitor);
        const GeometryPtr geometry = make_triangles(device, mesh, nullptr, cancel);
        rtcSetGeometryMask(geometry.get(), 0xffffffffu);
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometryByID(object.get(), geometry.get(), 0);
        commit_scene(structure, object.get(), mesh.triangles.size(), cancel);
    }
    return object.get();
}

// The geometry's id in the scene is the index of its instance.
void Accelerator::Impl::attach(std::uint32_t index,
                               const GeometryPtr& geometry,
                               std::uint32_t visibility) const {
    rtcSetGeometryMask(geometry.get(), visibility);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene, geometry.get(), index);
}

void Accelerator::Impl::build(std::span<const Mesh> meshes,
                              std::span<const Instance> instances,
                              const CancelFlag& cancel) {
    structure->device = make_device();
    RTCDevice device = structure->device.get();
    rtcSetDeviceMemoryMonitorFunction(device, on_memory, &structure->monitor);
    structure->objects.resize(meshes.size());
    world.resize(instances.size());
    structure->scene = make_scene(device, structure->monitor);
    scene = structure->scene.get();
    const std::vector<std::uint32_t> uses = count_mesh_uses(meshes.size(), instances);
    std::size_t primitives = 0;
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
        const Instance& instance = instances[i];
        const Mesh& mesh = meshes[instance.mesh];
        throw_if_cancelled(cancel);
        if (mesh.triangles.empty() || mesh.positions.empty()) {
            continue;
        }
        if (uses[instance.mesh] == 1) {
            const GeometryPtr triangles = make_triangles(device, mesh, &instance.to_world, cancel);
            const auto data = [&](RTCBufferType type) {
                return rtcGetGeometryBufferData(triangles.get(), type, 0);
            };
            world[i] = {static_cast<const float*>(data(RTC_BUFFER_TYPE_VERTEX)),
                        static_cast<const std::uint32_t*>(data(RTC_BUFFER_TYPE_INDEX))};
            attach(i, triangles, instance.visibility);
            primitives += mesh.triangles.size();
        } else {
            RTCScene object = object_scene(mesh, instance.mesh, cancel);
            attach(i, make_instance(device, object, instance.to_world), instance.visibility);
            ++primitives;
        }
    }
    throw_if_failed(rtcGetDeviceError(device));
    commit_scene(structure, scene, primitives, cancel);

    RTCBounds b;
    rtcGetSceneBounds(scene, &b);
    bounds.lower = Vec3(b.lower_x, b.lower_y, b.lower_z);
    bounds.upper = Vec3(b.upper_x, b.upper_y, b.upper_z);
}

Accelerator::Accelerator(std::span<const Mesh> meshes,
                         std::span<const Instance> instances,
                         const CancelFlag& cancel)
    : impl_(std::make_unique<Impl>()) {
    for (const Instance& instance : instances) {
        if (instance.mesh >= meshes.size()) {
            throw std::invalid_argument("Accelerator: an instance refers to no mesh");
        }
    }
    const FloatStateGuard float_state;
    impl_->build(meshes, instances, cancel);
}

Accelerator::~Accelerator() = default;

void Accelerator::intersect(std::span<const Ray> rays,
                            std::span<const std::uint32_t> visibility,
                            std::span<Hit> hits,
                            RayOrder order) const {
    DCHECK(visibility.size() >= rays.size() && hits.size() >= rays.size());
    RTCScene scene = impl_->scene;
    if (order == RayOrder::Coherent) {
        intersect_stream(scene, rays, visibility, hits);
        return;
    }
    // One by one: packets and streams of bounced rays were never faster.
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!traceable(rays[i])) {
            hits[i] = Hit{};
            continue;
        }
        fill(query, rays[i], visibility[i]);
        rtcIntersect1(scene, &context, &query);
        hits[i] = hit_of(query);
    }
}

void Accelerator::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    DCHECK(occluded.size() >= rays.size());
    impl_->occluder_trial.run(rays.size(), [&](bool cached) {
        if (cached) {
            impl_->occluded_cached(rays, occluded);
        } else {
            occluded_plain(impl_->scene, rays, occluded);
        }
    });
}

Bounds3 Accelerator::bounds() const {
    return impl_->bounds;
}

std::uint64_t Accelerator::bytes() const {
    const std::int64_t bytes = impl_->structure->monitor.bytes.load(std::memory_order_relaxed);
    return bytes > 0 ? static_cast<std::uint64_t>(bytes) : 0;
}

bool accelerator_self_test() {
    try {
        Mesh mesh;
        mesh.name = "self test";
        mesh.positions.assign(3, Vec3(0));
        mesh.positions[1].x = 1.0f;
        mesh.positions[2].y = 1.0f;
        mesh.triangles.emplace_back(0, 1, 2);
        Instance instance;
        instance.materials = {0};
        const Accelerator accelerator(std::span(&mesh, 1), std::span(&instance, 1), CancelFlag());
        const Ray ray{Vec3(0.25f, 0.5f, 2.0f), Vec3(0, 0, -1)};
        const std::uint32_t visibility = kVisibleAll;
        Hit hit;
        accelerator.intersect(std::span(&ray, 1), std::span(&visibility, 1), std::span(&hit, 1));
        return hit.instance == 0 && hit.triangle == 0 && std::abs(hit.t - 2.0f) < 1e-5f &&
               std::abs(hit.u - 0.25f) < 1e-5f && std::abs(hit.v - 0.5f) < 1e-5f;
    } catch (const std::exception&) {
        return false;
    }
}

}  // namespace pharos
