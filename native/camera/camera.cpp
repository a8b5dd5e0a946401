#include "camera/camera.h"

#include "sampling/warps.h"

namespace pharos {

namespace {

// A ray this close to the image plane lies in it; its square is still a number.
constexpr float kMaxSlope = 1e15f;

float finite_or(float value, float fallback) {
    return std::isfinite(value) ? value : fallback;
}

// Unit vector of the part of v at right angles to `axis`; zero where there is none.
Vec3 across(const Vec3& axis, const Vec3& v) {
    const Vec3 unit = normalize_or(v, Vec3(0.0f));
    return normalize_or(unit - axis * glm::dot(unit, axis), Vec3(0.0f));
}

bool usable_window(const CameraDescription& d) {
    const Vec2 size = d.window_upper - d.window_lower;
    const float sum = d.window_lower.x + d.window_lower.y + size.x + size.y;
    return std::isfinite(sum) && size.x != 0.0f && size.y != 0.0f;
}

}  // namespace

Camera::Camera(const CameraDescription& d, std::uint32_t width, std::uint32_t height)
    : type_(d.type),
      origin_(d.to_world[3]),
      forward_(-normalize_or(Vec3(d.to_world[2]), Vec3(0, 0, 1))),
      window_lower_(-1.0f),
      lens_radius_(std::max(finite_or(d.lens_radius, 0.0f), 0.0f)),
      inverse_ratio_(1.0f / std::max(finite_or(d.aperture_ratio, 1.0f), 1e-5f)),
      blades_(d.aperture_blades),
      rotation_(finite_or(d.aperture_rotation, 0.0f)) {
    if (!is_finite(origin_)) {
        origin_ = Vec3(0.0f);
    }
    right_ = across(forward_, Vec3(d.to_world[0]));
    up_ = across(forward_, Vec3(d.to_world[1]));
    up_ = across(right_, up_);
    if (is_zero(right_) || is_zero(up_)) {
        const Frame frame = Frame::from_z(-forward_);
        right_ = frame.x;
        up_ = frame.y;
    }
    Vec2 upper(1.0f);
    if (usable_window(d)) {
        window_lower_ = d.window_lower;
        upper = d.window_upper;
    }
    window_per_pixel_ = (upper - window_lower_) / Vec2(static_cast<float>(std::max(width, 1u)),
                                                       static_cast<float>(std::max(height, 1u)));
    near_ = finite_or(d.near_clip, 0.0f);
    if (type_ == CameraType::Perspective) {
        near_ = std::max(near_, 0.0f);
    }
    far_ = d.far_clip > near_ ? d.far_clip : kInfinity;
    focus_distance_ = finite_or(d.focus_distance, 10.0f);
    if (!(focus_distance_ > 0.0f)) {
        focus_distance_ = 1e-5f;
    }
}

Ray Camera::generate_ray(const Vec2& pixel, const Vec2& lens) const {
    const Vec2 window = window_lower_ + pixel * window_per_pixel_;
    const bool perspective = type_ == CameraType::Perspective;
    // In camera space with z forwards: from (start, 0) through a point of the plane z = 1.
    Vec2 start = perspective ? Vec2(0.0f) : window;
    Vec2 slope = perspective ? window : Vec2(0.0f);
    if (lens_radius_ > 0.0f) {
        // All rays of a pixel meet on the focus plane.
        const Vec2 offset = sample_aperture(lens) * lens_radius_;
        start += offset;
        slope -= offset / focus_distance_;
    }
    slope = glm::clamp(slope, -kMaxSlope, kMaxSlope);
    const float stretch = std::sqrt(1.0f + slope.x * slope.x + slope.y * slope.y);
    Ray ray;
    ray.direction = (right_ * slope.x + up_ * slope.y + forward_) * (1.0f / stretch);
    ray.origin = origin_ + right_ * start.x + up_ * start.y;
    if (near_ >= 0.0f) {
        ray.t_min = near_ * stretch;
        ray.t_max = far_ * stretch;
    } else {
        // An orthographic view may begin behind the camera; rays have no negative distances.
        ray.origin += ray.direction * (near_ * stretch);
        ray.t_max = (far_ - near_) * stretch;
    }
    return ray;
}

Vec2 Camera::sample_aperture(const Vec2& u) const {
    Vec2 point;
    if (blades_ < 3) {
        point = sample_uniform_disk(u);
    } else {
        // One of the polygon's triangles around the centre, then uniform within it.
        const auto blades = static_cast<float>(blades_);
        const float scaled = u.x * blades;
        const float sector = std::min(std::floor(scaled), blades - 1.0f);
        const Vec2 b =
            sample_uniform_triangle(Vec2(std::min(scaled - sector, kOneMinusEpsilon), u.y));
        const float half = kPi / blades;
        const float along = (b.x + b.y) * std::cos(half);
        const float across = (b.x - b.y) * std::sin(half);
        const float angle = rotation_ + 2.0f * half * sector;
        const float c = std::cos(angle);
        const float s = std::sin(angle);
        point = Vec2(along * c - across * s, along * s + across * c);
    }
    point.x *= inverse_ratio_;
    return point;
}

Mat4 Camera::world_to_camera() const {
    Mat4 m(1.0f);
    const Vec3 rows[3] = {right_, up_, -forward_};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            m[c][r] = rows[r][c];
        }
        m[3][r] = -glm::dot(rows[r], origin_);
    }
    return m;
}

}  // namespace pharos
