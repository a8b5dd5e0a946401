// Bump mapping (Blinn 1978; Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU"):
// heights at a hit and a pixel's footprint beside it, and the normal that follows.
#include <algorithm>

#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

// Two steps in the surface, as long as a pixel is wide there.
struct Footprint {
    Vec3 x;
    Vec3 y;
};

// Half the sum of a pixel's sides, seen at p straight on. Where a path has come from another
// surface its pixel is taken to spread as if it had come from the camera itself.
[[nodiscard]] float pixel_radius(const ShadingContext& context, const Vec3& p) {
    const Vec2& pixel = context.pixel;
    if (!context.perspective) {
        return 0.5f * (pixel.x + pixel.y);
    }
    const Vec3 c = transform_point(context.world_to_camera, p);
    const float distance = glm::length(c);
    const float depth = std::abs(c.z);
    if (!(distance > 0.0f)) {
        return 0.0f;
    }
    // How fast a direction turns as its point in the window at distance 1 moves.
    const float turn_x = safe_sqrt(1.0f - sqr(c.x / distance));
    const float turn_y = safe_sqrt(1.0f - sqr(c.y / distance));
    return 0.5f * (pixel.x * turn_x + pixel.y * turn_y) * depth;
}

[[nodiscard]] Footprint footprint(const ShadingContext& context, const SurfaceInteraction& hit) {
    const float radius = pixel_radius(context, hit.p);
    const Vec3& n = hit.ng;
    const bool diagonal = n.x == n.y && n.x == n.z;
    const Vec3 across =
        diagonal ? Vec3(n.z - n.y, n.x + n.z, -n.y - n.x) : Vec3(n.z - n.y, n.x - n.z, n.y - n.x);
    const Vec3 x = normalize_or(across, Vec3(1.0f, 0.0f, 0.0f));
    return {x * radius, glm::cross(n, x) * radius};
}

// Barycentric coordinates follow a small step in the triangle's plane.
void move_in_triangle(const Evaluation& e, const Vec3& step, SurfaceInteraction& hit) {
    const Mesh* mesh = e.mesh(hit);
    if (mesh == nullptr || hit.triangle >= mesh->triangles.size()) {
        return;
    }
    const UVec3& t = mesh->triangles[hit.triangle];
    const Mat3 linear(e.instance(hit)->to_world);
    const Vec3 e1 = linear * (mesh->positions[t.y] - mesh->positions[t.x]);
    const Vec3 e2 = linear * (mesh->positions[t.z] - mesh->positions[t.x]);
    const float a = glm::dot(e1, e1);
    const float b = glm::dot(e1, e2);
    const float c = glm::dot(e2, e2);
    const float det = a * c - b * b;
    if (det > 0.0f) {
        const float d1 = glm::dot(step, e1);
        const float d2 = glm::dot(step, e2);
        hit.u += (c * d1 - b * d2) / det;
        hit.v += (a * d2 - b * d1) / det;
    }
}

}  // namespace

void shift_hits(const Evaluation& e, const Vec2& step) {
    std::vector<SurfaceInteraction>& shifted = e.scratch.shifted;
    shifted.resize(std::max(shifted.size(), e.lanes));
    for (std::size_t i = 0; i < e.lanes; ++i) {
        shifted[i] = e.hit(i);
        const Footprint print = footprint(e.context, shifted[i]);
        const Vec3 along = print.x * step.x + print.y * step.y;
        shifted[i].p += along;
        move_in_triangle(e, along, shifted[i]);
    }
}

void run_bump(const Evaluation& e, const NodeOp& op) {
    const Operand strength = e.operand(op, 0);
    const Operand distance = e.operand(op, 1);
    const Operand filter_width = e.operand(op, 2);
    const Operand here = e.operand(op, 3);
    const Operand beside_x = e.operand(op, 4);
    const Operand beside_y = e.operand(op, 5);
    const Operand normal = e.operand(op, 6);
    const float sign = (op.mode & kInvertBit) != 0 ? -1.0f : 1.0f;
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const SurfaceInteraction& hit = e.hit(i);
        const Vec3 n = normal.is_default() ? hit.ns : normalize_or(normal.vector(i), hit.ns);
        const Footprint print = footprint(e.context, hit);
        // The surface's gradient times the area that the footprint spans.
        const Vec3 rise_x = glm::cross(print.y, n);
        const Vec3 rise_y = glm::cross(n, print.x);
        const float area = glm::dot(print.x, rise_x);
        const float h = here.scalar(i);
        const Vec3 gradient = rise_x * (beside_x.scalar(i) - h) + rise_y * (beside_y.scalar(i) - h);
        const float scale = sign * distance.scalar(i) * (area < 0.0f ? -1.0f : 1.0f);
        const Vec3 raw = n * (filter_width.scalar(i) * std::abs(area)) - gradient * scale;
        // Areas are tiny squares: lengths are taken in double.
        const double length = std::sqrt(glm::dot(glm::dvec3(raw), glm::dvec3(raw)));
        const Vec3 bumped = length > 0.0 && length < 1e30 ? Vec3(glm::dvec3(raw) / length) : n;
        const float s = std::fmax(strength.scalar(i), 0.0f);
        e.store(op, i, normalize_or(bumped * s + n * (1.0f - s), n));
    }
}

}  // namespace pharos::detail
