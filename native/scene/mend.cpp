#include "scene/mend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace pharos {

namespace {

constexpr std::size_t kCancelPollInterval = 1u << 18;

void poll(const CancelFlag& cancel, std::size_t i) {
    if (i % kCancelPollInterval == 0) {
        throw_if_cancelled(cancel);
    }
}

bool is_sound(const Vec3& p) {
    const Vec3 a = glm::abs(p);
    return a.x < kMaxCoordinate && a.y < kMaxCoordinate && a.z < kMaxCoordinate;
}

bool is_finite(const Mat4& m) {
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) {
            if (!std::isfinite(m[column][row])) {
                return false;
            }
        }
    }
    return true;
}

std::string counted(std::size_t count, const char* singular, const char* plural) {
    return std::to_string(count) + ' ' + (count == 1 ? singular : plural);
}

// Broken positions are replaced by a sound one, so that nothing that looks at all of them, a
// bounding box say, meets them. Returns which ones were broken; empty: none.
std::vector<bool> mend_positions(Mesh& mesh, const CancelFlag& cancel, SceneReport& report) {
    std::vector<bool> broken;
    std::size_t count = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        poll(cancel, i);
        if (!is_sound(mesh.positions[i])) {
            broken.resize(mesh.positions.size());
            broken[i] = true;
            ++count;
        }
    }
    if (count == 0) {
        return broken;
    }
    Vec3 stand_in(0.0f);
    for (std::size_t i = 0; i < broken.size(); ++i) {
        if (!broken[i]) {
            stand_in = mesh.positions[i];
            break;
        }
    }
    for (std::size_t i = 0; i < broken.size(); ++i) {
        if (broken[i]) {
            mesh.positions[i] = stand_in;
        }
    }
    report.add(Severity::Warning,
               mesh.name,
               counted(count, "vertex is", "vertices are") +
                   " not finite or too far away; the faces there are left out.");
    return broken;
}

template <class T>
void keep_corners(std::vector<T>& values, const std::vector<std::uint32_t>& kept) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
            values[3 * i + corner] = values[3 * std::size_t{kept[i]} + corner];
        }
    }
    values.resize(3 * kept.size());
}

// The same for any number of values a triangle.
void keep_values(std::vector<float>& values,
                 std::size_t each,
                 const std::vector<std::uint32_t>& kept) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
        for (std::size_t k = 0; k < each; ++k) {
            values[each * i + k] = values[each * kept[i] + k];
        }
    }
    values.resize(each * kept.size());
}

// Drops all triangles but `kept` (ascending) from every array that follows them.
void keep_triangles(Mesh& mesh, const std::vector<std::uint32_t>& kept) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
        mesh.triangles[i] = mesh.triangles[kept[i]];
        if (!mesh.material_indices.empty()) {
            mesh.material_indices[i] = mesh.material_indices[kept[i]];
        }
    }
    mesh.triangles.resize(kept.size());
    if (!mesh.material_indices.empty()) {
        mesh.material_indices.resize(kept.size());
    }
    if (mesh.normal_domain == NormalDomain::Corner) {
        keep_corners(mesh.normals, kept);
    }
    for (UvMap& map : mesh.uv_maps) {
        keep_corners(map.uv, kept);
    }
    for (MeshAttribute& attribute : mesh.attributes) {
        if (attribute.domain != NormalDomain::Vertex) {
            const bool corners = attribute.domain == NormalDomain::Corner;
            keep_values(attribute.values, attribute.components * (corners ? 3u : 1u), kept);
        }
    }
}

// Arrays that do not have the size of their domain cannot be matched to the triangles.
void drop_misfits(Mesh& mesh, SceneReport& report) {
    const std::size_t corners = 3 * mesh.triangles.size();
    const std::size_t normals =
        mesh.normal_domain == NormalDomain::Vertex ? mesh.positions.size() : corners;
    if (mesh.normal_domain != NormalDomain::Face && mesh.normals.size() != normals) {
        report.add(Severity::Warning, mesh.name, "The normals do not fit the mesh; it is flat.");
        mesh.normal_domain = NormalDomain::Face;
    }
    if (mesh.normal_domain == NormalDomain::Face) {
        mesh.normals.clear();
    }
    if (!mesh.material_indices.empty() && mesh.material_indices.size() != mesh.triangles.size()) {
        report.add(Severity::Warning,
                   mesh.name,
                   "The material indices do not fit the mesh; the first material is used.");
        mesh.material_indices.clear();
    }
    for (UvMap& map : mesh.uv_maps) {
        if (map.uv.size() != corners) {
            report.add(Severity::Warning,
                       mesh.name,
                       "The UV map '" + map.name + "' does not fit the mesh; it is zero.");
            map.uv.assign(corners, Vec2(0.0f));
        }
    }
    std::erase_if(mesh.attributes, [&](const MeshAttribute& attribute) {
        const std::size_t elements = attribute.domain == NormalDomain::Face ? mesh.triangles.size()
                                     : attribute.domain == NormalDomain::Vertex
                                         ? mesh.positions.size()
                                         : corners;
        const bool fits = attribute.components >= 1 && attribute.components <= 4 &&
                          attribute.values.size() == elements * attribute.components;
        if (!fits) {
            report.add(Severity::Warning,
                       mesh.name,
                       "The attribute '" + attribute.name + "' does not fit the mesh; it is zero.");
        }
        return !fits;
    });
}

bool is_finite(const LightDescription& lamp) {
    const std::array values = {lamp.radius,
                               lamp.spot_angle,
                               lamp.spot_blend,
                               lamp.size_u,
                               lamp.size_v,
                               lamp.spread,
                               lamp.angle};
    return is_finite(lamp.to_world) && pharos::is_finite(lamp.strength) &&
           std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

bool is_usable(const CameraDescription& camera) {
    const std::array values = {camera.window_lower.x,
                               camera.window_lower.y,
                               camera.window_upper.x,
                               camera.window_upper.y,
                               camera.near_clip,
                               camera.far_clip,
                               camera.lens_radius,
                               camera.focus_distance,
                               camera.aperture_ratio,
                               camera.aperture_rotation};
    return is_finite(camera.to_world) &&
           std::ranges::none_of(values, [](float value) { return std::isnan(value); });
}

}  // namespace

void mend_mesh(Mesh& mesh, const CancelFlag& cancel, SceneReport& report) {
    drop_misfits(mesh, report);
    const std::vector<bool> broken = mend_positions(mesh, cancel, report);
    const auto is_broken = [&](const UVec3& t) {
        return !broken.empty() && (broken[t.x] || broken[t.y] || broken[t.z]);
    };
    std::size_t out_of_range = 0;
    std::vector<std::uint32_t> kept;
    bool dropping = false;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        poll(cancel, i);
        const UVec3& t = mesh.triangles[i];
        const bool in_range = std::max(t.x, std::max(t.y, t.z)) < mesh.positions.size();
        out_of_range += !in_range;
        const bool keep = in_range && !is_broken(t);
        if (!keep && !dropping) {
            dropping = true;
            kept.resize(i);
            for (std::size_t k = 0; k < i; ++k) {
                kept[k] = static_cast<std::uint32_t>(k);
            }
        } else if (keep && dropping) {
            kept.push_back(static_cast<std::uint32_t>(i));
        }
    }
    if (out_of_range > 0) {
        report.add(Severity::Warning,
                   mesh.name,
                   counted(out_of_range, "face refers", "faces refer") +
                       " to vertices that do not exist and are left out.");
    }
    if (dropping) {
        keep_triangles(mesh, kept);
    }
}

std::optional<Mat4> invert(const Mat4& to_world) {
    if (!is_finite(to_world)) {
        return std::nullopt;
    }
    const glm::dmat4 m(to_world);
    const glm::dmat3 linear(m);
    const double volume = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
    if (!(std::abs(glm::determinant(linear)) > 1e-6 * volume)) {
        return std::nullopt;
    }
    const Mat4 inverse(glm::inverse(m));
    return is_finite(inverse) ? std::optional(inverse) : std::nullopt;
}

std::optional<Instance> mend_instance(const SceneDescription& description,
                                      const InstanceDescription& instance,
                                      std::uint32_t default_material,
                                      SceneReport& report) {
    if (instance.mesh >= description.meshes.size()) {
        report.add(Severity::Warning, instance.name, "The object's mesh does not exist.");
        return std::nullopt;
    }
    const std::optional<Mat4> to_object = invert(instance.to_world);
    if (!to_object) {
        report.add(Severity::Warning,
                   instance.name,
                   "The object is scaled to nothing or has a broken matrix; it is left out.");
        return std::nullopt;
    }
    Instance result;
    result.mesh = instance.mesh;
    result.to_world = instance.to_world;
    result.to_object = *to_object;
    result.mirrored = glm::determinant(glm::dmat3(glm::dmat4(instance.to_world))) < 0.0;
    result.visibility = instance.visibility;
    if (instance.material_set < description.material_sets.size()) {
        result.materials = description.material_sets[instance.material_set];
    } else if (instance.material_set != kNone) {
        report.add(Severity::Warning, instance.name, "The object's materials do not exist.");
    }
    bool missing = false;
    for (std::uint32_t& material : result.materials) {
        if (material >= description.materials.size()) {
            missing = missing || material != kNone;
            material = default_material;
        }
    }
    if (missing) {
        report.add(Severity::Warning, instance.name, "A material of the object does not exist.");
    }
    if (result.materials.empty()) {
        result.materials.assign(1, default_material);
    }
    return result;
}

void mend_lamps(std::vector<LightDescription>& lamps, SceneReport& report) {
    std::erase_if(lamps, [&](const LightDescription& lamp) {
        if (is_finite(lamp)) {
            return false;
        }
        report.add(
            Severity::Warning, lamp.name, "A value of the lamp is no number; it is left out.");
        return true;
    });
}

void mend_camera(SceneDescription& description, SceneReport& report) {
    if (description.has_camera && !is_usable(description.camera)) {
        report.add(Severity::Error, "Camera", "The camera's matrix or window is no number.");
        description.has_camera = false;
    }
}

void mend_film(FilmDescription& film, SceneReport& report) {
    if (!std::isfinite(film.exposure)) {
        report.add(Severity::Warning, "Film", "The exposure is no number; 1 is taken.");
        film.exposure = 1.0f;
    }
}

}  // namespace pharos
