// Textures: images in every projection, checker, gradient.
#include <algorithm>

#include "core/visibility.h"
#include "materials/program_vm.h"

namespace pharos::detail {

namespace {

constexpr float kInvTwoPi = 0.5f * kInvPi;

// A texture by its number, or null: magenta.
[[nodiscard]] const Texture* find_texture(const Evaluation& e, std::uint32_t image) {
    return image < e.context.textures.size() ? &e.context.textures[image] : nullptr;
}

// The tile that holds a point, or none; its corner is taken from the coordinates.
[[nodiscard]] std::uint32_t take_tile(const ImageUse& use, float& u, float& v) {
    constexpr float kAcross = 10.0f;
    constexpr float kUp = 1000.0f;
    const float column = std::trunc(u);  // the first tiles reach below zero, as in Cycles
    const float row = std::trunc(v);
    if (!(column >= 0.0f && column < kAcross && row >= 0.0f && row < kUp)) {
        return kNone;
    }
    u -= column;
    v -= row;
    const auto number = static_cast<std::uint32_t>(kAcross * row + column);
    const auto tile = std::ranges::find(use.tiles, number, &ImageTile::number);
    return tile != use.tiles.end() ? tile->image : kNone;
}

// Where an unconnected vector socket points: one rule for each operation that has one.
[[nodiscard]] Vec3 vector_or(const Operand& vector, std::size_t lane, const Vec3& fallback) {
    return vector.is_default() ? fallback : vector.vector(lane);
}

[[nodiscard]] Vec2 sphere_uv(const Vec3& v) {
    const float length = glm::length(v);
    if (!(length > 0.0f)) {
        return Vec2(0.0f);
    }
    const float u = v.x == 0.0f && v.y == 0.0f ? 0.0f : 0.5f - std::atan2(v.x, v.y) * kInvTwoPi;
    return Vec2(u, 1.0f - std::acos(std::clamp(v.z / length, -1.0f, 1.0f)) * kInvPi);
}

[[nodiscard]] Vec2 tube_uv(const Vec3& v) {
    if (!(v.x != 0.0f || v.y != 0.0f)) {
        return Vec2(0.0f);
    }
    return Vec2(0.5f - std::atan2(v.x, v.y) * kInvTwoPi, 0.5f * (v.z + 1.0f));
}

[[nodiscard]] Vec2 equirectangular_uv(const Vec3& d) {
    if (is_zero(d)) {
        return Vec2(0.0f);
    }
    return Vec2(0.5f - std::atan2(d.y, d.x) * kInvTwoPi,
                0.5f + std::atan2(d.z, std::hypot(d.x, d.y)) * kInvPi);
}

// A mirrored ball photographed from far along +y.
[[nodiscard]] Vec2 mirror_ball_uv(const Vec3& d) {
    Vec3 half(d.x, d.y - 1.0f, d.z);
    const float scale = 2.0f * safe_sqrt(-0.5f * half.y);
    half = scale > 0.0f ? half / scale : half;
    return Vec2(0.5f * (half.x + 1.0f), 0.5f * (half.z + 1.0f));
}

[[nodiscard]] Vec2 project(ImageProjection projection, const Vec3& v) {
    switch (projection) {
        case ImageProjection::Sphere:
            return sphere_uv((v - Vec3(0.5f)) * 2.0f);
        case ImageProjection::Tube:
            return tube_uv((v - Vec3(0.5f)) * 2.0f);
        case ImageProjection::Equirectangular:
            return equirectangular_uv(normalize_or(v, Vec3(0.0f)));
        case ImageProjection::MirrorBall:
            return mirror_ball_uv(normalize_or(v, Vec3(0.0f)));
        default:
            return Vec2(v);
    }
}

// All lanes of one image look-up into four arrays of `lanes` values.
void lookup(const Evaluation& e,
            std::uint16_t use_index,
            std::span<const float> u,
            std::span<const float> v,
            std::span<float> rgba) {
    const ImageUse& use = e.material.program.images[use_index];
    const Texture* texture = find_texture(e, use.image);
    if (texture == nullptr || e.estimate) {
        const Vec4 value = texture != nullptr ? texture->mean() : Texture().mean();
        for (std::size_t i = 0; i < rgba.size(); ++i) {
            rgba[i] = value[static_cast<int>(i / u.size())];
        }
        return;
    }
    const bool straight = e.material.straight_alpha[use_index] != 0;
    count_work(e.scratch.textures, [&] {
        texture->lookup(u, v, {use.interpolation, use.extension, straight}, rgba);
        return u.size();
    });
}

// The same of a tiled image, lane by lane.
void lookup_tiled(const Evaluation& e,
                  std::uint16_t use_index,
                  std::span<const float> uv,
                  std::span<float> rgba) {
    const ImageUse& use = e.material.program.images[use_index];
    const bool straight = e.material.straight_alpha[use_index] != 0;
    const Texture missing;
    count_work(e.scratch.textures, [&] {
        for (std::size_t i = 0; i < e.lanes; ++i) {
            float u = uv[i];
            float v = uv[e.lanes + i];
            const Texture* texture = find_texture(e, take_tile(use, u, v));
            float texel[4];
            (texture != nullptr ? *texture : missing)
                .lookup({&u, 1}, {&v, 1}, {use.interpolation, use.extension, straight}, texel);
            for (std::size_t k = 0; k < 4; ++k) {
                rgba[k * e.lanes + i] = texel[k];
            }
        }
        return e.lanes;
    });
}

// Writes coordinates of every lane into the scratch; u first, then v.
template <class Function>
[[nodiscard]] std::span<const float> fill_coordinates(const Evaluation& e,
                                                      const Function& function) {
    std::vector<float>& uv = e.scratch.coordinates;
    uv.resize(std::max(uv.size(), 2 * e.lanes));
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec2 c = function(i);
        uv[i] = c.x;
        uv[e.lanes + i] = c.y;
    }
    return std::span<const float>(uv).first(2 * e.lanes);
}

void lookup_projected(const Evaluation& e, const NodeOp& op, std::span<const float> uv) {
    if (!e.material.program.images[op.mode].tiles.empty() && !e.estimate) {
        lookup_tiled(e, op.mode, uv, std::span<float>(e.output(op), 4 * e.lanes));
        return;
    }
    lookup(e,
           op.mode,
           uv.first(e.lanes),
           uv.subspan(e.lanes, e.lanes),
           std::span<float>(e.output(op), 4 * e.lanes));
}

// Shares of the three axis projections: one alone near its axis, two along the edges between, three
// around the corners of a triangle whose corners are the axes.
[[nodiscard]] Vec3 box_weights(const Vec3& normal, float blend) {
    Vec3 n = glm::abs(normal);
    const float sum = n.x + n.y + n.z;
    if (!(sum > 0.0f)) {
        return Vec3(1.0f, 0.0f, 0.0f);
    }
    n *= 1.0f / sum;
    const float limit = 0.5f * (1.0f + blend);
    for (int k = 0; k < 3; ++k) {
        const float a = n[(k + 1) % 3];
        const float b = n[(k + 2) % 3];
        if (n[k] > limit * (n[k] + a) && n[k] > limit * (n[k] + b)) {
            Vec3 alone(0.0f);
            alone[k] = 1.0f;
            return alone;
        }
    }
    if (!(blend > 0.0f)) {
        return Vec3(1.0f, 0.0f, 0.0f);
    }
    // Two axes: the third is too small to matter. Asked in the order z, x, y.
    constexpr int kSmallest[3] = {2, 0, 1};
    constexpr int kFirst[3] = {0, 1, 0};
    constexpr int kSecond[3] = {1, 2, 2};
    for (int k = 0; k < 3; ++k) {
        const float a = n[kFirst[k]];
        const float b = n[kSecond[k]];
        if (n[kSmallest[k]] < (1.0f - limit) * (a + b)) {
            Vec3 pair(0.0f);
            pair[kFirst[k]] = saturate((a / (a + b) - 0.5f * (1.0f - blend)) / blend);
            pair[kSecond[k]] = 1.0f - pair[kFirst[k]];
            return pair;
        }
    }
    return (n * (2.0f - limit) + Vec3(limit - 1.0f)) / (2.0f * limit - 1.0f);
}

// Where axis `axis` sees the point; the sign of the normal keeps pictures from being mirrored.
[[nodiscard]] Vec2 box_uv(int axis, const Vec3& v, const Vec3& normal) {
    switch (axis) {
        case 0:
            return Vec2(normal.x < 0.0f ? 1.0f - v.y : v.y, v.z);
        case 1:
            return Vec2(normal.y > 0.0f ? 1.0f - v.x : v.x, v.z);
        default:
            return Vec2(normal.z > 0.0f ? 1.0f - v.y : v.y, v.x);
    }
}

void lookup_box(const Evaluation& e, const NodeOp& op, const Operand& vector) {
    const float blend = saturate(e.material.program.images[op.mode].projection_blend);
    UvLookup uv_map(e, nullptr);
    std::fill_n(e.output(op), 4 * e.lanes, 0.0f);
    std::vector<float>& texels = e.scratch.texels;
    texels.resize(std::max(texels.size(), 4 * e.lanes));
    const std::span<float> rgba = std::span<float>(texels).first(4 * e.lanes);
    for (int axis = 0; axis < 3; ++axis) {
        bool any = false;
        const std::span<const float> uv = fill_coordinates(e, [&](std::size_t i) {
            const Vec3 n = object_normal(e, e.hit(i));
            any = any || box_weights(n, blend)[axis] > 0.0f;
            return box_uv(axis, vector_or(vector, i, Vec3(uv_map.at(e.hit(i)), 0.0f)), n);
        });
        if (!any) {
            continue;
        }
        lookup(e, op.mode, uv.first(e.lanes), uv.subspan(e.lanes, e.lanes), rgba);
        for (std::size_t i = 0; i < e.lanes; ++i) {
            const float weight = box_weights(object_normal(e, e.hit(i)), blend)[axis];
            for (std::size_t k = 0; k < 4; ++k) {
                e.output(op, k)[i] += weight * rgba[k * e.lanes + i];
            }
        }
    }
}

}  // namespace

void run_image(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const ImageProjection projection = e.material.program.images[op.mode].projection;
    if (projection == ImageProjection::Box) {
        lookup_box(e, op, vector);
        return;
    }
    if (projection == ImageProjection::Flat && !vector.is_default() && !vector.is_constant()) {
        // Registers already hold u and v as two arrays.
        lookup_projected(e, op, std::span<const float>(vector.data, 2 * e.lanes));
        return;
    }
    UvLookup uv_map(e, nullptr);
    lookup_projected(e, op, fill_coordinates(e, [&](std::size_t i) {
                         const Vec3 v = vector.is_default() ? Vec3(uv_map.at(e.hit(i)), 0.0f)
                                                            : vector.vector(i);
                         return project(projection, v);
                     }));
}

void run_environment_image(const Evaluation& e, const NodeOp& op) {
    const Operand direction = e.operand(op, 0);
    const bool ball = e.material.program.images[op.mode].projection == ImageProjection::MirrorBall;
    const ImageProjection projection =
        ball ? ImageProjection::MirrorBall : ImageProjection::Equirectangular;
    lookup_projected(e, op, fill_coordinates(e, [&](std::size_t i) {
                         return project(projection,
                                        vector_or(direction, i, world_point(e, e.hit(i))));
                     }));
}

void run_checker(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    const Operand color1 = e.operand(op, 1);
    const Operand color2 = e.operand(op, 2);
    const Operand scale = e.operand(op, 3);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 v = vector.is_default() ? generated_coordinate(e, e.hit(i)) : vector.vector(i);
        // A hair to the side, so that faces at whole numbers do not flicker.
        const Vec3 p = (v * scale.scalar(i) + Vec3(0.000001f)) * 0.999999f;
        int odd = 0;
        for (int k = 0; k < 3; ++k) {
            odd += std::fmod(std::abs(std::floor(p[k])), 2.0f) == 1.0f ? 1 : 0;
        }
        const bool first = odd % 2 == 1;
        e.store(op, i, first ? color1.vector(i) : color2.vector(i));
        e.output(op, 3)[i] = first ? 1.0f : 0.0f;
    }
}

namespace {

[[nodiscard]] float gradient(GradientMode mode, const Vec3& p) {
    switch (mode) {
        case GradientMode::Linear:
            return p.x;
        case GradientMode::Quadratic:
            return sqr(std::max(p.x, 0.0f));
        case GradientMode::Easing: {
            const float r = saturate(p.x);
            return r * r * (3.0f - 2.0f * r);
        }
        case GradientMode::Diagonal:
            return 0.5f * (p.x + p.y);
        case GradientMode::Radial:
            return std::atan2(p.y, p.x) * kInvTwoPi + 0.5f;
        case GradientMode::QuadraticSphere:
            return sqr(std::max(0.999999f - glm::length(p), 0.0f));
        case GradientMode::Spherical:
            return std::max(0.999999f - glm::length(p), 0.0f);
    }
    return 0.0f;
}

}  // namespace

void run_gradient(const Evaluation& e, const NodeOp& op) {
    const Operand vector = e.operand(op, 0);
    float* out = e.output(op);
    for (std::size_t i = 0; i < e.lanes; ++i) {
        const Vec3 v = vector.is_default() ? generated_coordinate(e, e.hit(i)) : vector.vector(i);
        out[i] = saturate(gradient(static_cast<GradientMode>(op.mode), v));
    }
}

SkyParameters read_sky(std::span<const float> table) {
    const auto number = [&](std::size_t i, float lower, float upper) {
        return table[i] > lower ? std::min(table[i], upper) : lower;  // NaN: the lower one
    };
    SkyParameters in;
    in.type = table[0] < 0.5f ? SkyType::Preetham : SkyType::SingleScattering;
    in.turbidity = number(1, 1.0f, 30.0f);
    in.elevation = number(2, -0.5f * kPi, 0.5f * kPi);
    in.rotation = number(3, -1e3f, 1e3f);
    in.altitude = number(4, 0.0f, 60000.0f);
    in.air = number(5, 0.0f, 100.0f);
    in.dust = number(6, 0.0f, 100.0f);
    in.ozone = number(7, 0.0f, 100.0f);
    in.sun_disc = table[8] > 0.5f;
    in.sun_size = number(9, 0.0f, kPi);
    in.sun_intensity = number(10, 0.0f, 1e6f);
    in.sun_direction = Vec3(table[12], table[13], table[14]);
    return in;
}

void run_sky(const Evaluation& e, const NodeOp& op) {
    const Operand direction = e.operand(op, 0);
    const SkyModel& sky = *e.material.skies[op.mode];
    for (std::size_t i = 0; i < e.lanes; ++i) {
        e.store(op, i, sky.radiance(normalize_or(direction.vector(i), Vec3(0.0f, 0.0f, 1.0f))));
    }
}

}  // namespace pharos::detail
