// Random triangles, transforms and rays for the geometry tests; the generator is fixed by its seed.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "geometry/accelerator.h"
#include "geometry/instance_surface.h"

namespace pharos::testing {

class Random {
  public:
    explicit Random(std::uint32_t seed) : engine_(seed) {}

    [[nodiscard]] float uniform(float lower = 0.0f, float upper = 1.0f) {
        return std::uniform_real_distribution<float>(lower, upper)(engine_);
    }

    [[nodiscard]] Vec3 in_box(float half_size) {
        const float x = uniform(-half_size, half_size);
        const float y = uniform(-half_size, half_size);
        return Vec3(x, y, uniform(-half_size, half_size));
    }

    [[nodiscard]] Vec3 direction() {
        while (true) {
            const Vec3 v = in_box(1.0f);
            if (length_squared(v) > 0.01f && length_squared(v) < 1.0f) {
                return glm::normalize(v);
            }
        }
    }

    [[nodiscard]] std::uint32_t index(std::size_t count) {
        return static_cast<std::uint32_t>(
            std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_));
    }

    // Rotation, scale between 0.3 and 3 per axis, a little shear; mirrored half of the time.
    [[nodiscard]] Mat4 affine(float translation) {
        Mat4 m = glm::translate(Mat4(1.0f), in_box(translation));
        m = glm::rotate(m, uniform(0.0f, 6.0f), direction());
        Vec3 scale(uniform(0.3f, 3.0f), uniform(0.3f, 3.0f), uniform(0.3f, 3.0f));
        if (uniform() < 0.5f) {
            scale.x = -scale.x;
        }
        m = glm::scale(m, scale);
        Mat4 shear(1.0f);
        shear[1][0] = uniform(-0.5f, 0.5f);
        shear[2][1] = uniform(-0.5f, 0.5f);
        return m * shear;
    }

  private:
    std::mt19937 engine_;
};

// `count` triangles of size about `size` inside a box of half size `extent`.
[[nodiscard]] inline Mesh random_triangles(Random& random,
                                           std::uint32_t count,
                                           float extent,
                                           float size) {
    Mesh mesh;
    mesh.name = "random";
    for (std::uint32_t i = 0; i < count; ++i) {
        const Vec3 center = random.in_box(extent);
        for (int corner = 0; corner < 3; ++corner) {
            mesh.positions.push_back(center + random.in_box(size));
        }
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
}

[[nodiscard]] inline Instance make_instance(std::uint32_t mesh, const Mat4& to_world) {
    Instance instance;
    instance.mesh = mesh;
    instance.to_world = to_world;
    instance.to_object = glm::inverse(to_world);
    instance.mirrored = glm::determinant(Mat3(to_world)) < 0.0f;
    instance.materials.assign(1, 0);
    return instance;
}

// Everything a test traces, kept in place.
struct TestGeometry {
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::unique_ptr<Accelerator> accelerator;
    std::vector<InstanceSurface> surfaces;

    void build() {
        accelerator = std::make_unique<Accelerator>(meshes, instances, CancelFlag());
        surfaces = make_instance_surfaces(meshes, instances);
    }

    [[nodiscard]] std::vector<Hit> trace(const std::vector<Ray>& rays,
                                         std::uint32_t visibility = kVisibleAll) const {
        std::vector<Hit> hits(rays.size());
        const std::vector<std::uint32_t> masks(rays.size(), visibility);
        accelerator->intersect(rays, masks, hits);
        return hits;
    }

    [[nodiscard]] Hit trace(const Ray& ray, std::uint32_t visibility = kVisibleAll) const {
        return trace(std::vector<Ray>(1, ray), visibility).front();
    }

    [[nodiscard]] SurfaceInteraction interaction(const Ray& ray, const Hit& hit) const {
        return surface_interaction(surfaces[hit.instance], ray, hit);
    }
};

}  // namespace pharos::testing
