#include "geometry/gather_mesh.h"

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace pharos {
namespace {

template <class T>
Column<T> column(const std::vector<T>& values) {
    return {reinterpret_cast<const std::byte*>(values.data()), values.size(), sizeof(T)};
}

// A quad and a triangle: two polygons, three triangles, seven corners.
struct Source {
    std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 2}};
    std::vector<std::uint32_t> corner_vertices{0, 1, 2, 3, 0, 3, 4};
    std::vector<UVec3> triangle_corners{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
    std::vector<std::uint32_t> triangle_polygons{0, 0, 1};
    std::vector<Vec3> normals;
    std::vector<std::uint8_t> smooth;
    std::vector<std::int32_t> slots;
    std::vector<Vec2> uv;
    std::vector<float> values;

    [[nodiscard]] PolygonMesh mesh() const {
        PolygonMesh out;
        out.positions = column(positions);
        out.corner_vertices = column(corner_vertices);
        out.triangle_corners = column(triangle_corners);
        out.triangle_polygons = column(triangle_polygons);
        out.normals = column(normals);
        out.smooth = column(smooth);
        out.material_slot = column(slots);
        return out;
    }
};

std::vector<Vec3> normals_of_corners() {
    std::vector<Vec3> out;
    for (int i = 0; i < 7; ++i) {
        out.emplace_back(static_cast<float>(i), 0.0f, 1.0f);
    }
    return out;
}

std::string error_of(const PolygonMesh& mesh) {
    try {
        static_cast<void>(gather_mesh("Vase", mesh));
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(GatherMesh, TrianglesReferToVerticesOfTheirCorners) {
    const Source source;
    const Mesh mesh = gather_mesh("Vase", source.mesh());
    EXPECT_EQ(mesh.name, "Vase");
    EXPECT_EQ(mesh.positions, source.positions);
    EXPECT_EQ(mesh.triangles, (std::vector<UVec3>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
    EXPECT_EQ(mesh.normal_domain, NormalDomain::Face);
    EXPECT_TRUE(mesh.normals.empty() && mesh.material_indices.empty() && mesh.uv_maps.empty());
}

TEST(GatherMesh, ElementsMayLieApart) {
    // As with a flag behind each position, and the polygon behind each triangle's corners.
    struct Vertex {
        Vec3 position;
        int flag;
    };

    const Source source;
    std::vector<Vertex> vertices;
    for (const Vec3& p : source.positions) {
        vertices.push_back({p, -1});
    }
    std::vector<std::array<std::uint32_t, 4>> triangles;
    for (std::size_t i = 0; i < 3; ++i) {
        const UVec3 corners = source.triangle_corners[i];
        triangles.push_back({corners.x, corners.y, corners.z, source.triangle_polygons[i]});
    }
    PolygonMesh apart = source.mesh();
    apart.positions = {
        reinterpret_cast<const std::byte*>(vertices.data()), vertices.size(), sizeof(Vertex)};
    const auto* first = reinterpret_cast<const std::byte*>(triangles.data());
    apart.triangle_corners = {first, 3, 16};
    apart.triangle_polygons = {first + 12, 3, 16};
    const std::vector<std::int32_t> slots{1, 2};
    apart.material_slot = column(slots);
    apart.last_slot = 9;
    const Mesh mesh = gather_mesh("Vase", apart);
    EXPECT_EQ(mesh.positions, source.positions);
    EXPECT_EQ(mesh.triangles, gather_mesh("Vase", source.mesh()).triangles);
    EXPECT_EQ(mesh.material_indices, (std::vector<std::uint16_t>{1, 1, 2}));
}

TEST(GatherMesh, FlatPolygonsHaveTheirPlanesNormal) {
    Source source;
    source.normals = normals_of_corners();
    source.smooth = {1, 0};
    PolygonMesh from = source.mesh();
    from.normal_domain = NormalDomain::Corner;
    const Mesh mesh = gather_mesh("Vase", from);
    ASSERT_EQ(mesh.normals.size(), 9u);
    EXPECT_EQ(mesh.normals[5], source.normals[3]);
    for (std::size_t i = 6; i < 9; ++i) {
        EXPECT_EQ(mesh.normals[i], Vec3(1, 0, 0));
    }
}

TEST(GatherMesh, NormalsOfVerticesAreCopied) {
    Source source;
    source.normals.assign(5, Vec3(0, 0, 1));
    PolygonMesh from = source.mesh();
    from.normal_domain = NormalDomain::Vertex;
    EXPECT_EQ(gather_mesh("Vase", from).normals, source.normals);
}

TEST(GatherMesh, SlotsAreClamped) {
    Source source;
    source.slots = {-3, 70'000};
    PolygonMesh from = source.mesh();
    from.last_slot = 2;
    EXPECT_EQ(gather_mesh("Vase", from).material_indices, (std::vector<std::uint16_t>{0, 0, 2}));
}

TEST(GatherMesh, UvAndAttributesFollowTheirDomains) {
    Source source;
    for (int i = 0; i < 7; ++i) {
        source.uv.emplace_back(static_cast<float>(i), 0.5f);
        source.values.push_back(static_cast<float>(10 * i));
    }
    const std::vector<float> pairs{1, 2, 3, 4};  // of two polygons
    PolygonMesh from = source.mesh();
    from.uv_maps = {{"a", column(source.uv)}};
    from.attributes = {{"corner", NormalDomain::Corner, 1, column(source.values)},
                       {"face", NormalDomain::Face, 2, {column(pairs).data, 2, 8}}};
    const Mesh mesh = gather_mesh("Vase", from);
    ASSERT_EQ(mesh.uv_maps[0].uv.size(), 9u);
    EXPECT_EQ(mesh.uv_maps[0].uv[5], Vec2(3.0f, 0.5f));
    EXPECT_EQ(mesh.attributes[0].values, (std::vector<float>{0, 10, 20, 0, 20, 30, 40, 50, 60}));
    EXPECT_EQ(mesh.attributes[1].values, (std::vector<float>{1, 2, 1, 2, 3, 4}));
    EXPECT_EQ(mesh.attributes[1].components, 2u);
}

TEST(GatherMesh, IndicesBeyondTheEndNameTheMesh) {
    Source source;
    source.triangle_corners[2].y = 7;
    EXPECT_EQ(error_of(source.mesh()), "Vase: a triangle's corner is beyond the end");
    source = Source();
    source.slots = {0, 1};
    source.triangle_polygons[2] = 2;
    EXPECT_EQ(error_of(source.mesh()),
              "Vase: the material of a triangle's polygon is beyond the end");
    source.triangle_polygons.clear();
    EXPECT_EQ(error_of(source.mesh()), "Vase: the material needs the polygon of each triangle");
}

TEST(GatherMesh, VerticesBeyondTheEndAreLeftToBeMended) {
    Source source;
    source.corner_vertices[6] = 1000;
    source.normals = normals_of_corners();
    source.smooth = {0, 0};
    PolygonMesh from = source.mesh();
    from.normal_domain = NormalDomain::Corner;
    const Mesh mesh = gather_mesh("Vase", from);
    EXPECT_EQ(mesh.triangles[2], UVec3(0, 3, 1000));
    EXPECT_EQ(mesh.normals[8], Vec3(0.0f));
}

TEST(GatherMesh, SizesThatDoNotFitNameTheMesh) {
    Source source;
    source.normals.assign(4, Vec3(0, 0, 1));
    EXPECT_EQ(error_of(source.mesh()), "Vase: the number of normals does not fit their domain");
    source = Source();
    source.uv.resize(6);
    PolygonMesh from = source.mesh();
    from.uv_maps = {{"a", column(source.uv)}};
    EXPECT_EQ(error_of(from), "Vase: uv map a is not one per corner");
    from = source.mesh();
    source.values.resize(6);
    from.attributes = {{"b", NormalDomain::Vertex, 1, column(source.values)}};
    EXPECT_EQ(error_of(from), "Vase: attribute b does not fit its domain");
    from.attributes[0].components = 5;
    EXPECT_EQ(error_of(from), "Vase: attribute b does not have 1 to 4 components");
}

TEST(GatherMesh, NothingMayBeGathered) {
    EXPECT_TRUE(gather_mesh("Empty", PolygonMesh()).triangles.empty());
}

TEST(GatherMesh, ThreadsGatherWhatOneDoes) {
    constexpr std::uint32_t kTriangles = 60'000;
    Source source;
    source.positions.resize(kTriangles + 2);
    source.corner_vertices.clear();
    source.triangle_corners.clear();
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
        source.triangle_corners.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        for (std::uint32_t k = 0; k < 3; ++k) {
            source.corner_vertices.push_back(i + k);
            source.uv.emplace_back(static_cast<float>(i), static_cast<float>(k));
        }
    }
    source.triangle_polygons.clear();
    source.normals = source.positions;
    PolygonMesh from = source.mesh();
    from.normal_domain = NormalDomain::Vertex;
    from.uv_maps = {{"a", column(source.uv)}, {"b", column(source.uv)}};
    const Mesh mesh = gather_mesh("Vase", from);
    EXPECT_EQ(mesh.normals, source.normals);
    EXPECT_EQ(mesh.uv_maps[0].uv, source.uv);
    EXPECT_EQ(mesh.uv_maps[1].uv, source.uv);
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
        ASSERT_EQ(mesh.triangles[i], UVec3(i, i + 1, i + 2));
    }
}

TEST(GatherMesh, NormalsWithoutAreaAreZero) {
    EXPECT_EQ(face_normal(Vec3(1, 2, 3), Vec3(1, 2, 3), Vec3(4, 5, 6)), Vec3(0.0f));
    EXPECT_EQ(face_normal(Vec3(NAN, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)), Vec3(0.0f));
    EXPECT_EQ(face_normal(Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 3, 0)), Vec3(0, 0, 1));
}

}  // namespace
}  // namespace pharos
