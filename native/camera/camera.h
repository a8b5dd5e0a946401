// Camera rays: thin lens with a focus plane and a round or bladed aperture, perspective or
// orthographic (Kolb, Mitchell, Hanrahan 1995, thin lens). Rays start on the near clip plane and
// end on the far one.
//
// Any description gives finite rays: bad matrices, windows and distances fall back to sane ones.
#pragma once

#include <cstdint>

#include "camera/camera_description.h"
#include "core/math.h"

namespace pharos {

class Camera {
  public:
    // width x height: the full frame in pixels.
    Camera(const CameraDescription& description, std::uint32_t width, std::uint32_t height);

    // `pixel`: full-frame raster coordinates, fractional, origin bottom left; `lens` in [0, 1)^2.
    [[nodiscard]] Ray generate_ray(const Vec2& pixel, const Vec2& lens) const;

    // Distance of p from the camera's plane along its axis.
    [[nodiscard]] float depth(const Vec3& p) const { return glm::dot(p - origin_, forward_); }

    // Distance of p from the camera: from its centre, of an orthographic one from its plane.
    [[nodiscard]] float distance(const Vec3& p) const {
        return type_ == CameraType::Perspective ? glm::distance(p, origin_) : std::abs(depth(p));
    }

    [[nodiscard]] Mat4 world_to_camera() const;  // x right, y up, looking along -z

  private:
    [[nodiscard]] Vec2 sample_aperture(const Vec2& u) const;

    CameraType type_;
    Vec3 origin_;
    Vec3 right_;
    Vec3 up_;
    Vec3 forward_;
    Vec2 window_lower_;
    Vec2 window_per_pixel_;
    float near_;
    float far_;
    float lens_radius_;
    float focus_distance_;
    float inverse_ratio_;
    std::uint32_t blades_;
    float rotation_;
};

}  // namespace pharos
