// Values that follow from the hit: coordinates, normals, the camera, the path.
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

constexpr Vec3 kUp(0.0f, 0.0f, 1.0f);

// As the surface's own side has it, not turned to the viewer.
[[nodiscard]] Vec3 own_normal(const SurfaceInteraction& hit) {
    return hit.front_face ? hit.ns : -hit.ns;
}

[[nodiscard]] Vec3 object_point(const Evaluation& e, const SurfaceInteraction& hit) {
    const Instance* instance = e.instance(hit);
    return instance != nullptr ? transform_point(instance->to_object, hit.p) : hit.p;
}

// Object-space direction of a normal to world space.
[[nodiscard]] Vec3 world_normal(const Evaluation& e,
                                const SurfaceInteraction& hit,
                                const Vec3& object) {
    const Instance* instance = e.instance(hit);
    return instance != nullptr ? transform_normal(instance->to_object, object) : object;
}

[[nodiscard]] Bounds3 bounds_of(const Mesh& mesh) {
    Bounds3 bounds;
    for (const Vec3& p : mesh.positions) {
        if (is_finite(p)) {
            bounds.extend(p);
        }
    }
    return bounds;
}

// From the context, or found once a mesh and kept in this thread's scratch.
[[nodiscard]] const Bounds3& mesh_bounds(const Evaluation& e, std::uint32_t mesh) {
    const std::size_t count = e.context.meshes.size();
    if (e.context.mesh_bounds.size() == count) {
        return e.context.mesh_bounds[mesh];
    }
    ShadingScratch& scratch = e.scratch;
    if (scratch.mesh_bounds.size() != count) {
        scratch.mesh_bounds.assign(count, Bounds3());
        scratch.bounded_meshes.assign(count, nullptr);
    }
    const Vec3* positions = e.context.meshes[mesh].positions.data();
    if (scratch.bounded_meshes[mesh] != positions) {
        scratch.mesh_bounds[mesh] = bounds_of(e.context.meshes[mesh]);
        scratch.bounded_meshes[mesh] = positions;
    }
    return scratch.mesh_bounds[mesh];
}

// Camera space as shader nodes see it: z grows away from the camera.
[[nodiscard]] Vec3 camera_point(const Evaluation& e, const Vec3& p) {
    const Vec3 c = transform_point(e.context.world_to_camera, p);
    return Vec3(c.x, c.y, -c.z);
}

[[nodiscard]] Vec3 window_coordinate(const Evaluation& e, const Vec3& p) {
    const Vec4 clip = e.context.camera_to_window * (e.context.world_to_camera * Vec4(p, 1.0f));
    const float scale = clip.w != 0.0f ? 1.0f / clip.w : 0.0f;
    return Vec3(clip.x * scale, clip.y * scale, 0.0f);
}

[[nodiscard]] Vec3 normal_operand(const Operand& normal,
                                  std::size_t lane,
                                  const SurfaceInteraction& hit) {
    return normal.is_default() ? hit.ns : normalize_or(normal.vector(lane), hit.ns);
}

// Unpolarised reflectance of a dielectric, eta = transmitted over incident index.
[[nodiscard]] float dielectric_reflectance(float cosine, float eta) {
    const float c = std::abs(cosine);
    const float squared = eta * eta - 1.0f + c * c;
    if (!(squared > 0.0f)) {
        return 1.0f;  // total internal reflection
    }
    const float g = std::sqrt(squared);
    const float a = (g - c) / (g + c);
    const float b = (c * (g + c) - 1.0f) / (c * (g - c) + 1.0f);
    return 0.5f * a * a * (1.0f + b * b);
}

}  // namespace

Vec3 world_point(const Evaluation& e, const SurfaceInteraction& hit) {
    return e.instance(hit) != nullptr ? hit.p + e.context.origin : hit.p;
}

Vec3 object_normal(const Evaluation& e, const SurfaceInteraction& hit) {
    const Instance* instance = e.instance(hit);
    return instance != nullptr ? normalize_or(transform_normal(instance->to_world, hit.ns), hit.ns)
                               : hit.ns;
}

Vec3 generated_coordinate(const Evaluation& e, const SurfaceInteraction& hit) {
    const Instance* instance = e.instance(hit);
    if (e.mesh(hit) == nullptr) {
        return hit.p;
    }
    const Bounds3& bounds = mesh_bounds(e, instance->mesh);
    if (bounds.empty()) {
        return Vec3(0.0f);
    }
    // A flat side counts as two units long, so that it lies at the middle.
    Vec3 extent = bounds.extent();
    for (int k = 0; k < 3; ++k) {
        extent[k] = extent[k] > 0.0f ? extent[k] : 2.0f;
    }
    return (object_point(e, hit) - bounds.center()) / extent + Vec3(0.5f);
}

Vec3 default_tangent(const Evaluation& e, const SurfaceInteraction& hit) {
    // Around the object's z axis through the middle of its box.
    const Vec3 g = generated_coordinate(e, hit);
    const Vec3 around = world_normal(e, hit, Vec3(0.5f - g.y, g.x - 0.5f, 0.0f));
    const Vec3 side = normalize_or(glm::cross(around, hit.ns), Vec3(0.0f));
    const Vec3 tangent = glm::cross(hit.ns, side);
    return is_zero(tangent) ? Frame::from_z(hit.ns).x : tangent;
}

Vec2 UvLookup::at(const SurfaceInteraction& hit) {
    Vec2 uv[3];
    if (!corners(hit, uv)) {
        return Vec2(0.0f);
    }
    return uv[0] * (1.0f - hit.u - hit.v) + uv[1] * hit.u + uv[2] * hit.v;
}

bool UvLookup::corners(const SurfaceInteraction& hit, Vec2 (&uv)[3]) {
    const Mesh* mesh = e_.mesh(hit);
    if (mesh != mesh_) {
        mesh_ = mesh;
        map_ = nullptr;
        for (std::size_t i = 0; mesh != nullptr && i < mesh->uv_maps.size(); ++i) {
            if (name_ == nullptr || mesh->uv_maps[i].name == *name_) {
                map_ = &mesh->uv_maps[i];
                break;
            }
        }
    }
    const std::size_t first = 3 * std::size_t{hit.triangle};
    if (map_ == nullptr || first + 3 > map_->uv.size()) {
        return false;
    }
    for (std::size_t k = 0; k < 3; ++k) {
        uv[k] = map_->uv[first + k];
    }
    return true;
}

void run_copy(const Evaluation& e, const NodeOp& op) {
    const Operand in = e.operand(op, 0);
    for (std::size_t k = 0; k < op.mode; ++k) {
        float* out = e.output(op, k);
        for (std::size_t i = 0; i < e.lanes; ++i) {
            out[i] = in.data[k * in.component_stride + i * in.lane_stride];
        }
    }
}

void run_uv(const Evaluation& e, const NodeOp& op) {
    UvLookup lookup(e, op.mode == kDefaultName ? nullptr : &e.material.program.names[op.mode]);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, Vec3(lookup.at(e.hit(i)), 0.0f));
    }
}

void run_geometry(const Evaluation& e, const NodeOp& op) {
    const auto output = static_cast<GeometryOutput>(op.mode);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        switch (output) {
            case GeometryOutput::Position:
                e.store(op, i, world_point(e, hit));
                break;
            case GeometryOutput::Normal:
                e.store(op, i, hit.ns);
                break;
            case GeometryOutput::TrueNormal:
                e.store(op, i, hit.ng);
                break;
            case GeometryOutput::Incoming:
                e.store(op, i, hit.wo);
                break;
            case GeometryOutput::Backfacing:
                e.output(op)[i] = hit.front_face ? 0.0f : 1.0f;
                break;
            case GeometryOutput::Parametric:
                e.store(op, i, Vec3(1.0f - hit.u - hit.v, hit.u, 0.0f));
                break;
            case GeometryOutput::Tangent:
                e.store(op, i, default_tangent(e, hit));
                break;
        }
    }
}

void run_coordinate(const Evaluation& e, const NodeOp& op) {
    const auto output = static_cast<CoordinateOutput>(op.mode);
    UvLookup uv(e, nullptr);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const bool world = e.instance(hit) == nullptr;
        switch (output) {
            case CoordinateOutput::Generated:
                e.store(op, i, generated_coordinate(e, hit));
                break;
            case CoordinateOutput::Normal:
                e.store(op, i, object_normal(e, hit));
                break;
            case CoordinateOutput::Uv:
                e.store(op, i, Vec3(uv.at(hit), 0.0f));
                break;
            case CoordinateOutput::Object:
                e.store(op, i, object_point(e, hit));
                break;
            case CoordinateOutput::Camera: {
                // A direction of the world is turned with the camera, not moved.
                const Vec3 d = transform_vector(e.context.world_to_camera, hit.p);
                e.store(op, i, world ? Vec3(d.x, d.y, -d.z) : camera_point(e, hit.p));
                break;
            }
            case CoordinateOutput::Window:
                e.store(op, i, window_coordinate(e, hit.p));
                break;
            case CoordinateOutput::Reflection:
                e.store(
                    op, i, world ? hit.wo : hit.ns * (2.0f * glm::dot(hit.ns, hit.wo)) - hit.wo);
                break;
        }
    }
}

void run_fresnel(const Evaluation& e, const NodeOp& op) {
    const Operand ior = e.operand(op, 0);
    const Operand normal = e.operand(op, 1);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const float eta = std::fmax(ior.scalar(i), 1e-5f);
        const float cosine = glm::dot(hit.wo, normal_operand(normal, i, hit));
        out[i] = dielectric_reflectance(cosine, hit.front_face ? eta : 1.0f / eta);
    }
}

void run_layer_weight(const Evaluation& e, const NodeOp& op) {
    const Operand blend = e.operand(op, 0);
    const Operand normal = e.operand(op, 1);
    float* fresnel = e.output(op, 0);
    float* facing = e.output(op, 1);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const float b = blend.scalar(i);
        const float cosine = glm::dot(hit.wo, normal_operand(normal, i, hit));
        const float eta = std::fmax(1.0f - b, 1e-5f);
        fresnel[i] = dielectric_reflectance(cosine, hit.front_face ? 1.0f / eta : eta);
        float f = std::abs(cosine);
        if (b != 0.5f) {
            const float limited = std::fmin(std::fmax(b, 0.0f), 1.0f - 1e-5f);
            f = std::pow(f, limited < 0.5f ? 2.0f * limited : 0.5f / (1.0f - limited));
        }
        facing[i] = 1.0f - f;
    }
}

namespace {

// Object-space tangent along growing u, and the side the bitangent lies on.
struct UvFrame {
    Vec3 tangent;
    float sign = 1.0f;
    bool valid = false;
};

[[nodiscard]] UvFrame uv_frame(const Evaluation& e,
                               const SurfaceInteraction& hit,
                               const Vec3& normal,
                               UvLookup& lookup) {
    UvFrame frame;
    Vec2 uv[3];
    const Mesh* mesh = e.mesh(hit);
    if (mesh == nullptr || hit.triangle >= mesh->triangles.size() || !lookup.corners(hit, uv)) {
        return frame;
    }
    const UVec3& corner = mesh->triangles[hit.triangle];
    const std::size_t count = mesh->positions.size();
    if (corner.x >= count || corner.y >= count || corner.z >= count) {
        return frame;
    }
    const Vec3 p1 = mesh->positions[corner.y] - mesh->positions[corner.x];
    const Vec3 p2 = mesh->positions[corner.z] - mesh->positions[corner.x];
    const Vec2 d1 = uv[1] - uv[0];
    const Vec2 d2 = uv[2] - uv[0];
    const float area = d1.x * d2.y - d2.x * d1.y;
    frame.sign = area < 0.0f ? -1.0f : 1.0f;
    const Vec3 along = (p1 * d2.y - p2 * d1.y) * frame.sign;
    frame.tangent = normalize_or(along - normal * glm::dot(along, normal), Vec3(0.0f));
    frame.valid = area != 0.0f && !is_zero(frame.tangent);
    return frame;
}

// Turned to the viewer like every normal of the hit.
[[nodiscard]] Vec3 tangent_space_normal(const Evaluation& e,
                                        const SurfaceInteraction& hit,
                                        const Vec3& encoded,
                                        float strength,
                                        UvLookup& lookup) {
    const Instance* instance = e.instance(hit);
    const Vec3 own = own_normal(hit);
    const Vec3 n =
        instance != nullptr ? normalize_or(transform_normal(instance->to_world, own), own) : own;
    const UvFrame frame = uv_frame(e, hit, n, lookup);
    if (!frame.valid) {
        return hit.ns;
    }
    const Vec3 bitangent = glm::cross(n, frame.tangent) * frame.sign;
    const float z = lerp(1.0f, encoded.z, saturate(strength));
    const Vec3 object =
        frame.tangent * (encoded.x * strength) + bitangent * (encoded.y * strength) + n * z;
    const Vec3 world = normalize_or(world_normal(e, hit, object), own);
    return hit.front_face ? world : -world;
}

}  // namespace

void run_normal_map(const Evaluation& e, const NodeOp& op) {
    const Operand strength = e.operand(op, 0);
    const Operand color = e.operand(op, 1);
    const auto space = static_cast<NormalMapSpace>(op.mode & 3);
    const std::uint16_t name = op.mode >> 2;
    UvLookup lookup(e, name == 0 ? nullptr : &e.material.program.names[name - 1u]);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const Vec3 encoded = color.vector(i) * 2.0f - Vec3(1.0f);
        const float s = std::fmax(strength.scalar(i), 0.0f);
        if (space == NormalMapSpace::Tangent) {
            e.store(op, i, tangent_space_normal(e, hit, encoded, s, lookup));
            continue;
        }
        const Vec3 world =
            space == NormalMapSpace::Object ? world_normal(e, hit, encoded) : encoded;
        const Vec3 mapped = normalize_or(world, own_normal(hit)) * (hit.front_face ? 1.0f : -1.0f);
        e.store(op, i, normalize_or(lerp(hit.ns, mapped, s), hit.ns));
    }
}

void run_tangent(const Evaluation& e, const NodeOp& op) {
    const int axis = op.mode & 3;
    const std::uint16_t name = op.mode >> 2;
    UvLookup lookup(e, name == 0 ? nullptr : &e.material.program.names[name - 1u]);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        Vec3 around(0.0f);
        if (axis < 3) {
            // Across the axis and the way out from it, through the middle of the object's box.
            const Vec3 out = generated_coordinate(e, hit) - Vec3(0.5f);
            around = axis == 0   ? Vec3(0.0f, -out.z, out.y)
                     : axis == 1 ? Vec3(-out.z, 0.0f, out.x)
                                 : Vec3(-out.y, out.x, 0.0f);
        } else {
            around = uv_frame(e, hit, object_normal(e, hit), lookup).tangent;
        }
        const Vec3 side =
            normalize_or(glm::cross(world_normal(e, hit, around), hit.ns), Vec3(0.0f));
        e.store(op, i, glm::cross(hit.ns, side));
    }
}

void run_object_info(const Evaluation& e, const NodeOp& op) {
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const Instance* instance = e.instance(hit);
        if (static_cast<ObjectInfoOutput>(op.mode) == ObjectInfoOutput::Location) {
            e.store(
                op,
                i,
                instance != nullptr ? Vec3(instance->to_world[3]) + e.context.origin : Vec3(0.0f));
        } else {
            // A number of its own for each instance (integer hash of Wang, 32 bits).
            std::uint32_t h = hit.instance;
            h = (h ^ 61u) ^ (h >> 16);
            h *= 9u;
            h ^= h >> 4;
            h *= 0x27d4eb2du;
            h ^= h >> 15;
            e.output(op)[i] = static_cast<float>(h >> 8) * 0x1p-24f;
        }
    }
}

void run_camera_data(const Evaluation& e, const NodeOp& op) {
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 c = camera_point(e, e.hit(i).p);
        switch (static_cast<CameraDataOutput>(op.mode)) {
            case CameraDataOutput::ViewVector:
                e.store(op, i, normalize_or(c, kUp));
                break;
            case CameraDataOutput::ViewZDepth:
                e.output(op)[i] = c.z;
                break;
            case CameraDataOutput::ViewDistance:
                e.output(op)[i] = glm::length(c);
                break;
        }
    }
}

void run_light_path(const Evaluation& e, const NodeOp& op) {
    float* out = e.output(op);
    const auto output = static_cast<LightPathOutput>(op.mode);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const PathInfo path = e.paths.empty() ? PathInfo() : e.paths[e.hit_index(i)];
        switch (output) {
            case LightPathOutput::RayLength:
                out[i] = path.length_before + e.hit(i).t;
                break;
            case LightPathOutput::RayDepth:
                out[i] = static_cast<float>(path.depth);
                break;
            case LightPathOutput::DiffuseDepth:
                out[i] = static_cast<float>(path.diffuse_depth);
                break;
            case LightPathOutput::GlossyDepth:
                out[i] = static_cast<float>(path.glossy_depth);
                break;
            case LightPathOutput::TransparentDepth:
                out[i] = static_cast<float>(path.transparent_depth);
                break;
            case LightPathOutput::TransmissionDepth:
                out[i] = static_cast<float>(path.transmission_depth);
                break;
            default:  // the questions for a kind of ray come first, a bit each
                out[i] = static_cast<float>((path.kind >> op.mode) & 1);
                break;
        }
    }
}

namespace {

constexpr int kObjectSpace = 1;
constexpr int kVectorType = 0;
constexpr int kPointType = 1;

// `forward` leads out of the space the result is in; its inverse is given beside it.
[[nodiscard]] Vec3 transform_as(int type, const Mat4& matrix, const Mat4& inverse, const Vec3& v) {
    if (type == kPointType) {
        return transform_point(matrix, v);
    }
    return type == kVectorType ? transform_vector(matrix, v) : transform_normal(inverse, v);
}

}  // namespace

void run_vector_transform(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const int from = op.mode % 3;
    const int to = op.mode / 3 % 3;
    const int type = op.mode / 9;
    // Camera space of the nodes looks along +z.
    Mat4 flip(1.0f);
    flip[2][2] = -1.0f;
    const Mat4 to_camera = flip * e.context.world_to_camera;
    const Mat4 from_camera = glm::inverse(to_camera);
    // Points of the world are the user's; all matrices lead to and from the hits' coordinates.
    const Vec3 origin = type == kPointType ? e.context.origin : Vec3(0.0f);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Instance* instance = e.instance(e.hit(i));
        Vec3 v = vector.vector(i);
        if (from > kObjectSpace) {
            v = transform_as(type, from_camera, to_camera, v);
        } else if (from == kObjectSpace && instance != nullptr) {
            v = transform_as(type, instance->to_world, instance->to_object, v);
        } else {
            v -= origin;
        }
        if (to > kObjectSpace) {
            v = transform_as(type, to_camera, from_camera, v);
        } else if (to == kObjectSpace && instance != nullptr) {
            v = transform_as(type, instance->to_object, instance->to_world, v);
        } else {
            v += origin;
        }
        const bool is_normal = type != kVectorType && type != kPointType;
        e.store(op, i, is_normal ? normalize_or(v, Vec3(0.0f)) : v);
    }
}

}  // namespace pharos::detail
