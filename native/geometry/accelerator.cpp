#include "geometry/accelerator.h"

#include <array>
#include <exception>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include "core/check.h"
#include "core/fp_state.h"
#include "geometry/embree_build.h"
#include "geometry/instance_surface.h"
#include "geometry/mesh_trees.h"
#include "geometry/occluder_cache.h"
#include "geometry/speed_trial.h"

namespace pharos {

namespace {

constexpr std::uint32_t kCancelPollInterval = 1u << 16;  // vertices or triangles copied in between
constexpr std::size_t kCacheTrial = 64;                  // rays

// Copies a mesh into buffers of Embree's own, transformed unless `to_world` is null.
GeometryPtr make_triangles(const EmbreeDevice& owner,
                           const Mesh& mesh,
                           const Mat4* to_world,
                           const CancelFlag& cancel) {
    RTCDevice device = owner.device.get();
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
    throw_if_failed(owner, rtcGetDeviceError(device));
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

// Embree ends the program at coordinates above, where its assertions are compiled in.
constexpr float kLargestCoordinate = 1.844e18f;

bool within(const Vec3& v) {
    return (std::abs(v.x) <= kLargestCoordinate) & (std::abs(v.y) <= kLargestCoordinate) &
           (std::abs(v.z) <= kLargestCoordinate);
}

// False for rays Embree must not see; they hit nothing.
bool traceable(const Ray& ray) {
    return within(ray.origin) & within(ray.direction) & (ray.t_min >= 0.0f) &
           (ray.t_min <= kLargestCoordinate) & (ray.t_max >= ray.t_min);
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

// The buffers of a mesh as it is traced, and its matrix where that is in object space.
struct TracedTriangles {
    const float* vertices = nullptr;
    const std::uint32_t* indices = nullptr;
    const Mat4* to_world = nullptr;
};

TracedTriangles traced_triangles(RTCGeometry geometry, const Mat4* to_world) {
    const auto data = [&](RTCBufferType type) {
        return rtcGetGeometryBufferData(geometry, type, 0);
    };
    return {static_cast<const float*>(data(RTC_BUFFER_TYPE_VERTEX)),
            static_cast<const std::uint32_t*>(data(RTC_BUFFER_TYPE_INDEX)),
            to_world};
}

// One by one: in packets they would take a quarter to a third less time, but a ray exactly through
// the common edge of two triangles may then pass between them.
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

// The structure of one mesh in object space.
struct MeshTree {
    std::shared_ptr<EmbreeDevice> device;
    GeometryPtr triangles;
    ScenePtr scene;
};

std::shared_ptr<const MeshTree> build_tree(const std::shared_ptr<EmbreeDevice>& device,
                                           const Mesh& mesh,
                                           const CancelFlag& cancel) {
    const auto tree = std::make_shared<MeshTree>();
    tree->device = device;
    tree->scene = make_scene(*device);
    tree->triangles = make_triangles(*device, mesh, nullptr, cancel);
    rtcSetGeometryMask(tree->triangles.get(), 0xffffffffu);
    rtcCommitGeometry(tree->triangles.get());
    rtcAttachGeometryByID(tree->scene.get(), tree->triangles.get(), 0);
    commit_scene({tree, device, tree->scene.get()}, mesh.triangles.size(), cancel);
    return tree;
}

using Trees = std::vector<std::shared_ptr<const MeshTree>>;  // by mesh; null: not instanced

// Everything a build makes. Shared with the thread that runs a long build.
struct Structure {
    std::shared_ptr<EmbreeDevice> device;
    Trees trees;
    ScenePtr scene;
};

}  // namespace

struct MeshTrees::Impl {
    std::shared_ptr<EmbreeDevice> device = std::make_shared<EmbreeDevice>();
    std::map<std::uint64_t, std::shared_ptr<const MeshTree>> by_version;
};

MeshTrees::MeshTrees() : impl_(std::make_unique<Impl>()) {}

MeshTrees::~MeshTrees() = default;

std::size_t MeshTrees::size() const {
    return impl_->by_version.size();
}

struct Accelerator::Impl {
    std::shared_ptr<Structure> structure = std::make_shared<Structure>();
    RTCScene scene = nullptr;  // the structure's
    Bounds3 bounds;
    std::vector<TracedTriangles> traced;  // by instance
    SpeedTrial occluder_trial;            // with the cache of occluders or without

    void build(std::span<const Mesh> meshes,
               std::span<const Instance> instances,
               const CancelFlag& cancel,
               MeshTrees::Impl* kept,
               std::uint64_t most_bytes);
    void attach(std::uint32_t index, const GeometryPtr& geometry, std::uint32_t visibility) const;
    void occluded_cached(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;
    void remember(const RTCHit& hit, OccluderCache& cache) const;
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

void Accelerator::Impl::remember(const RTCHit& hit, OccluderCache& cache) const {
    const bool instanced = hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
    const TracedTriangles& mesh = traced[instanced ? hit.instID[0] : hit.geomID];
    const auto corner = [&](std::size_t k) {
        const float* p = mesh.vertices + 3 * std::size_t{mesh.indices[3 * hit.primID + k]};
        const Vec3 point(p[0], p[1], p[2]);
        return mesh.to_world != nullptr ? transform_point(*mesh.to_world, point) : point;
    };
    cache.insert(corner(0), corner(1), corner(2));
}

// The geometry's id in the scene is the index of its instance.
void Accelerator::Impl::attach(std::uint32_t index,
                               const GeometryPtr& geometry,
                               std::uint32_t visibility) const {
    rtcSetGeometryMask(geometry.get(), visibility);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene, geometry.get(), index);
}

// Trees of the meshes that are brought into the scene by matrices: those used more than once, or
// all of them where they are kept.
Trees make_trees(const std::shared_ptr<EmbreeDevice>& device,
                 std::span<const Mesh> meshes,
                 std::span<const std::uint32_t> uses,
                 MeshTrees::Impl* kept,
                 const CancelFlag& cancel) {
    Trees trees(meshes.size());
    std::map<std::uint64_t, std::shared_ptr<const MeshTree>> used;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const Mesh& mesh = meshes[i];
        if (uses[i] < (kept != nullptr ? 1u : 2u) || mesh.triangles.empty() ||
            mesh.positions.empty()) {
            continue;
        }
        const auto known = kept != nullptr ? kept->by_version.find(mesh.version) : used.end();
        if (kept != nullptr && known != kept->by_version.end()) {
            trees[i] = known->second;
        } else {
            trees[i] = build_tree(device, mesh, cancel);
        }
        if (mesh.version != 0) {
            used.emplace(mesh.version, trees[i]);
        }
    }
    if (kept != nullptr) {
        kept->by_version = std::move(used);
    }
    return trees;
}

void Accelerator::Impl::build(std::span<const Mesh> meshes,
                              std::span<const Instance> instances,
                              const CancelFlag& cancel,
                              MeshTrees::Impl* kept,
                              std::uint64_t most_bytes) {
    structure->device = kept != nullptr ? kept->device : std::make_shared<EmbreeDevice>();
    structure->device->allow(most_bytes);
    RTCDevice device = structure->device->device.get();
    const std::vector<std::uint32_t> uses = count_mesh_uses(meshes.size(), instances);
    structure->trees = make_trees(structure->device, meshes, uses, kept, cancel);
    traced.resize(instances.size());
    structure->scene = make_scene(*structure->device);
    scene = structure->scene.get();
    std::size_t primitives = 0;
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
        const Instance& instance = instances[i];
        const Mesh& mesh = meshes[instance.mesh];
        throw_if_cancelled(cancel);
        if (mesh.triangles.empty() || mesh.positions.empty()) {
            continue;
        }
        if (const auto& tree = structure->trees[instance.mesh]) {
            const GeometryPtr placed = make_instance(device, tree->scene.get(), instance.to_world);
            attach(i, placed, instance.visibility);
            traced[i] = traced_triangles(tree->triangles.get(), &instance.to_world);
            ++primitives;
        } else {
            const GeometryPtr triangles =
                make_triangles(*structure->device, mesh, &instance.to_world, cancel);
            traced[i] = traced_triangles(triangles.get(), nullptr);
            attach(i, triangles, instance.visibility);
            primitives += mesh.triangles.size();
        }
    }
    throw_if_failed(*structure->device, rtcGetDeviceError(device));
    commit_scene({structure, structure->device, scene}, primitives, cancel);

    RTCBounds b;
    rtcGetSceneBounds(scene, &b);
    bounds.lower = Vec3(b.lower_x, b.lower_y, b.lower_z);
    bounds.upper = Vec3(b.upper_x, b.upper_y, b.upper_z);
}

Accelerator::Accelerator(std::span<const Mesh> meshes,
                         std::span<const Instance> instances,
                         const CancelFlag& cancel,
                         MeshTrees* kept,
                         std::uint64_t most_bytes)
    : impl_(std::make_unique<Impl>()) {
    for (const Instance& instance : instances) {
        if (instance.mesh >= meshes.size()) {
            throw std::invalid_argument("Accelerator: an instance refers to no mesh");
        }
    }
    const FloatStateGuard float_state;
    impl_->build(meshes, instances, cancel, kept != nullptr ? &kept->impl() : nullptr, most_bytes);
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
    const std::int64_t bytes = impl_->structure->device->bytes.load(std::memory_order_relaxed);
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
