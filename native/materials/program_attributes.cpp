// Attributes: values that meshes and instances bring along under a name.
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

struct AttributeValue {
    Vec3 vector{0.0f};
    float alpha = 0.0f;  // of what is not there
};

// Finds the attribute again only when the mesh changes.
class AttributeLookup {
  public:
    AttributeLookup(const Evaluation& e, const std::string& name)
        : e_(e), name_(name), uv_(e, &name) {}

    [[nodiscard]] AttributeValue at(const SurfaceInteraction& hit) {
        const Mesh* mesh = e_.mesh(hit);
        if (mesh != mesh_) {
            mesh_ = mesh;
            found_ = find(mesh);
        }
        if (found_ == nullptr) {
            Vec2 corner[3];
            return uv_.corners(hit, corner) ? AttributeValue{Vec3(uv_.at(hit), 0.0f), 1.0f}
                                            : AttributeValue{};
        }
        if (hit.triangle >= mesh->triangles.size()) {
            return {};
        }
        return interpolate(*mesh, hit);
    }

  private:
    [[nodiscard]] const MeshAttribute* find(const Mesh* mesh) const {
        for (std::size_t i = 0; mesh != nullptr && i < mesh->attributes.size(); ++i) {
            if (mesh->attributes[i].name == name_) {
                return &mesh->attributes[i];
            }
        }
        return nullptr;
    }

    [[nodiscard]] AttributeValue interpolate(const Mesh& mesh,
                                             const SurfaceInteraction& hit) const {
        const UVec3& t = mesh.triangles[hit.triangle];
        const std::size_t first = 3 * std::size_t{hit.triangle};
        switch (found_->domain) {
            case NormalDomain::Face:
                return element(hit.triangle);
            case NormalDomain::Vertex:
                return blend(hit, {t.x, t.y, t.z});
            default:
                return blend(hit, {first, first + 1, first + 2});
        }
    }

    [[nodiscard]] AttributeValue blend(const SurfaceInteraction& hit,
                                       const std::size_t (&corner)[3]) const {
        const float weight[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
        AttributeValue sum;
        for (int k = 0; k < 3; ++k) {
            const AttributeValue value = element(corner[k]);
            sum.vector += value.vector * weight[k];
            sum.alpha += value.alpha * weight[k];
        }
        return sum;
    }

    // A number counts in all components.
    [[nodiscard]] AttributeValue element(std::size_t index) const {
        const std::size_t count = found_->components;
        const std::size_t first = index * count;
        if (first + count > found_->values.size()) {
            return {};
        }
        const float* v = &found_->values[first];
        switch (count) {
            case 1:
                return {Vec3(v[0]), 1.0f};
            case 2:
                return {Vec3(v[0], v[1], 0.0f), 1.0f};
            case 3:
                return {Vec3(v[0], v[1], v[2]), 1.0f};
            default:
                return {Vec3(v[0], v[1], v[2]), v[3]};
        }
    }

    const Evaluation& e_;
    const std::string& name_;
    UvLookup uv_;
    const Mesh* mesh_ = nullptr;
    const MeshAttribute* found_ = nullptr;
};

void store(const Evaluation& e, const NodeOp& op, std::size_t lane, const AttributeValue& value) {
    e.store(op, lane, value.vector);
    e.output(op, 3)[lane] = value.alpha;
    e.output(op, 4)[lane] = (value.vector.x + value.vector.y + value.vector.z) * (1.0f / 3.0f);
}

}  // namespace

void run_attribute(const Evaluation& e, const NodeOp& op) {
    AttributeLookup lookup(e, e.material.program.names[op.mode]);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        store(e, op, i, lookup.at(e.hit(i)));
    }
}

void run_instance_attribute(const Evaluation& e, const NodeOp& op) {
    const std::string& name = e.material.program.names[op.mode];
    const InstanceAttribute* found = nullptr;
    for (const InstanceAttribute& attribute : e.context.instance_attributes) {
        found = attribute.name == name ? &attribute : found;
    }
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const std::uint32_t instance = e.hit(i).instance;
        AttributeValue value;
        if (found != nullptr && instance < found->values.size()) {
            const Vec4& v = found->values[instance];
            value = {Vec3(v), v.w};
        }
        store(e, op, i, value);
    }
}

}  // namespace pharos::detail
