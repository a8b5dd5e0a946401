#include "geometry/gather_mesh.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>

#include <sys/mman.h>

#include "core/parallel.h"

namespace pharos {

namespace {

constexpr std::size_t kWorthThreads = 50'000;       // triangles
constexpr std::size_t kWorthLargePages = 4u << 20;  // bytes; such a page has 2 MiB
constexpr std::size_t kPage = 4096;

void require(bool condition, const std::string& name, const std::string& what) {
    if (!condition) {
        throw std::invalid_argument(name + ": " + what);
    }
}

// An empty vector with room for so many, in large pages where that is much memory: the first touch
// of each page costs more than what is written into it. Without such pages nothing changes.
template <class T>
std::vector<T> with_room(std::size_t count) {
    std::vector<T> out;
    out.reserve(count);
    const std::size_t size = count * sizeof(T);
    if (size >= kWorthLargePages) {
        auto* begin = reinterpret_cast<std::byte*>(out.data());
        const std::size_t before =
            (kPage - reinterpret_cast<std::uintptr_t>(begin) % kPage) % kPage;
        madvise(begin + before, (size - before) / kPage * kPage, MADV_HUGEPAGE);
    }
    return out;
}

// function(0), function(1), ...
template <class Function>
auto generate(std::size_t count, const Function& function) {
    auto out = with_room<std::invoke_result_t<Function, std::size_t>>(count);
    for (std::size_t i = 0; i < count; ++i) {
        out.push_back(function(i));
    }
    return out;
}

template <class T>
std::vector<T> copy(const Column<T>& column) {
    return generate(column.count, [&](std::size_t i) { return column[i]; });
}

// The three values of each triangle's corners, which are a row of so many of T in memory.
template <class T>
struct Three {
    T a, b, c;
};

// A vector of values, written three at a time.
template <class T, class Function>
std::vector<T> generate_threes(std::size_t triangles, const Function& function) {
    static_assert(sizeof(Three<T>) == 3 * sizeof(T));
    auto out = with_room<T>(3 * triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
        const Three<T> three = function(i);
        out.push_back(three.a);
        out.push_back(three.b);
        out.push_back(three.c);
    }
    return out;
}

std::uint32_t largest(const Column<UVec3>& column) {
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < column.count; ++i) {
        const UVec3 value = column[i];
        found = std::max({found, value.x, value.y, value.z});
    }
    return found;
}

std::uint32_t largest(const Column<std::uint32_t>& column) {
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < column.count; ++i) {
        found = std::max(found, column[i]);
    }
    return found;
}

// One mesh on its way.
class Gatherer {
  public:
    Gatherer(const std::string& name, const PolygonMesh& source) : name_(name), source_(source) {}

    Mesh run() {
        check_corners();
        check_normals();
        check_polygons();
        mesh_.name = name_;
        mesh_.normal_domain = source_.normal_domain;
        plan();
        work();
        return std::move(mesh_);
    }

  private:
    void check_corners() const;
    void check_normals() const;
    void check_polygons() const;
    void check_by_polygon(std::size_t count, const std::string& what) const;
    void plan();
    void work();
    [[nodiscard]] std::vector<UVec3> triangles() const;
    [[nodiscard]] std::vector<Vec3> corner_normals() const;
    [[nodiscard]] Vec3 flat_normal(const UVec3& corners) const;
    [[nodiscard]] std::vector<float> attribute(const PolygonAttribute& from) const;

    const std::string& name_;
    const PolygonMesh& source_;
    Mesh mesh_;
    std::vector<std::function<void()>> tasks_;  // each fills one array; the largest first
};

void Gatherer::check_corners() const {
    const std::size_t corners = source_.corner_vertices.count;
    require(source_.triangle_corners.empty() || largest(source_.triangle_corners) < corners,
            name_,
            "a triangle's corner is beyond the end");
    for (const CornerUvMap& map : source_.uv_maps) {
        require(map.uv.count == corners, name_, "uv map " + map.name + " is not one per corner");
    }
}

void Gatherer::check_normals() const {
    const std::size_t wanted = source_.normal_domain == NormalDomain::Face ? 0
                               : source_.normal_domain == NormalDomain::Vertex
                                   ? source_.positions.count
                                   : source_.corner_vertices.count;
    require(
        source_.normals.count == wanted, name_, "the number of normals does not fit their domain");
    require(source_.smooth.empty() || source_.normal_domain == NormalDomain::Corner,
            name_,
            "flat polygons need normals of corners");
}

void Gatherer::check_by_polygon(std::size_t count, const std::string& what) const {
    require(source_.triangle_polygons.count == source_.triangle_corners.count,
            name_,
            what + " needs the polygon of each triangle");
    require(source_.triangle_polygons.empty() || largest(source_.triangle_polygons) < count,
            name_,
            what + " of a triangle's polygon is beyond the end");
}

void Gatherer::check_polygons() const {
    if (!source_.smooth.empty()) {
        check_by_polygon(source_.smooth.count, "the smoothness");
    }
    if (!source_.material_slot.empty()) {
        check_by_polygon(source_.material_slot.count, "the material");
    }
    for (const PolygonAttribute& from : source_.attributes) {
        const std::string what = "attribute " + from.name;
        require(from.components >= 1 && from.components <= 4,
                name_,
                what + " does not have 1 to 4 components");
        if (from.domain == NormalDomain::Face) {
            check_by_polygon(from.rows.count, what);
            continue;
        }
        const bool by_vertex = from.domain == NormalDomain::Vertex;
        require(from.rows.count ==
                    (by_vertex ? source_.positions.count : source_.corner_vertices.count),
                name_,
                what + " does not fit its domain");
    }
}

std::vector<UVec3> Gatherer::triangles() const {
    const Column<std::uint32_t>& vertices = source_.corner_vertices;
    return generate(source_.triangle_corners.count, [&](std::size_t i) {
        const UVec3 corners = source_.triangle_corners[i];
        return UVec3(vertices[corners.x], vertices[corners.y], vertices[corners.z]);
    });
}

Vec3 Gatherer::flat_normal(const UVec3& corners) const {
    const UVec3 v(source_.corner_vertices[corners.x],
                  source_.corner_vertices[corners.y],
                  source_.corner_vertices[corners.z]);
    if (std::max({v.x, v.y, v.z}) >= source_.positions.count) {
        return Vec3(0.0f);
    }
    return face_normal(source_.positions[v.x], source_.positions[v.y], source_.positions[v.z]);
}

// Flat triangles have their own plane's normal, as these are not interpolated.
std::vector<Vec3> Gatherer::corner_normals() const {
    const Column<Vec3>& normals = source_.normals;
    return generate_threes<Vec3>(source_.triangle_corners.count, [&](std::size_t i) {
        const UVec3 corners = source_.triangle_corners[i];
        if (!source_.smooth.empty() && source_.smooth[source_.triangle_polygons[i]] == 0) {
            const Vec3 flat = flat_normal(corners);
            return Three<Vec3>{flat, flat, flat};
        }
        return Three<Vec3>{normals[corners.x], normals[corners.y], normals[corners.z]};
    });
}

std::vector<float> Gatherer::attribute(const PolygonAttribute& from) const {
    const std::size_t size = from.components * sizeof(float);
    std::vector<float> out;
    const auto take = [&](std::size_t count, const auto& row_of) {
        out.resize(count * from.components);
        for (std::size_t i = 0; i < count; ++i) {
            const std::byte* row = from.rows.data + row_of(i) * from.rows.stride;
            std::memcpy(out.data() + i * from.components, row, size);
        }
    };
    if (from.domain == NormalDomain::Vertex) {
        take(from.rows.count, [](std::size_t i) { return i; });
    } else if (from.domain == NormalDomain::Face) {
        take(source_.triangle_polygons.count,
             [&](std::size_t i) { return source_.triangle_polygons[i]; });
    } else {
        take(3 * source_.triangle_corners.count, [&](std::size_t i) {
            return source_.triangle_corners[i / 3][static_cast<int>(i % 3)];
        });
    }
    return out;
}

void Gatherer::plan() {
    const auto task = [&](auto&& body) { tasks_.emplace_back(std::forward<decltype(body)>(body)); };
    mesh_.uv_maps.resize(source_.uv_maps.size());
    mesh_.attributes.resize(source_.attributes.size());
    if (source_.normal_domain == NormalDomain::Corner) {
        task([&] { mesh_.normals = corner_normals(); });
    }
    for (std::size_t k = 0; k < source_.uv_maps.size(); ++k) {
        task([&, k] {
            const Column<Vec2>& uv = source_.uv_maps[k].uv;
            const auto threes = [&](std::size_t i) {
                const UVec3 corners = source_.triangle_corners[i];
                return Three<Vec2>{uv[corners.x], uv[corners.y], uv[corners.z]};
            };
            const std::size_t count = source_.triangle_corners.count;
            mesh_.uv_maps[k] = {source_.uv_maps[k].name, generate_threes<Vec2>(count, threes)};
        });
    }
    for (std::size_t k = 0; k < source_.attributes.size(); ++k) {
        task([&, k] {
            const PolygonAttribute& from = source_.attributes[k];
            mesh_.attributes[k] = {from.name, from.domain, from.components, attribute(from)};
        });
    }
    task([&] { mesh_.triangles = triangles(); });
    task([&] { mesh_.positions = copy(source_.positions); });
    if (source_.normal_domain == NormalDomain::Vertex) {
        task([&] { mesh_.normals = copy(source_.normals); });
    }
    if (!source_.material_slot.empty()) {
        task([&] {
            mesh_.material_indices = generate(source_.triangle_polygons.count, [&](std::size_t i) {
                const std::int32_t slot = source_.material_slot[source_.triangle_polygons[i]];
                return static_cast<std::uint16_t>(
                    std::clamp<std::int32_t>(slot, 0, source_.last_slot));
            });
        });
    }
}

void Gatherer::work() {
    if (source_.triangle_corners.count < kWorthThreads) {
        for (const auto& task : tasks_) {
            task();
        }
        return;
    }
    const auto tasks = static_cast<unsigned>(tasks_.size());
    ThreadPool pool(std::clamp(std::thread::hardware_concurrency(), 1u, tasks));
    pool.parallel_for(tasks_.size(), [&](std::size_t i, unsigned) { tasks_[i](); });
}

}  // namespace

Mesh gather_mesh(const std::string& name, const PolygonMesh& source) {
    return Gatherer(name, source).run();
}

}  // namespace pharos
