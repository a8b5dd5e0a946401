"""Cameras: Blender's lens, sensor fit and shift resolved into an image window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Window(NamedTuple):
    """At distance 1 for a perspective camera, in metres for an orthographic one."""

    lower: tuple[float, float]
    upper: tuple[float, float]


class Frame(NamedTuple):
    """Pixels of the full frame and the shape of one pixel."""

    width: int
    height: int
    aspect_x: float = 1.0
    aspect_y: float = 1.0


class Crop(NamedTuple):
    """The rendered part of the frame in pixels, origin bottom left."""

    x: int
    y: int
    width: int
    height: int


class View(NamedTuple):
    """Where a picture is taken from: arguments of set_camera, or None without a camera."""

    fields: dict | None
    frame: Frame
    crop: Crop


def fits_horizontally(sensor_fit: str, frame: Frame) -> bool:
    if sensor_fit == "AUTO":
        return frame.width * frame.aspect_x > frame.height * frame.aspect_y
    return sensor_fit == "HORIZONTAL"


def image_window(half: float, horizontal: bool, frame: Frame, shift) -> Window:
    """`half`: half of the window along the fitted axis; shift is in units of that axis."""
    ratio = (frame.width * frame.aspect_x) / (frame.height * frame.aspect_y)
    half_x = half if horizontal else half * ratio
    half_y = half / ratio if horizontal else half
    dx, dy = (2.0 * half * value for value in shift)
    return Window((dx - half_x, dy - half_y), (dx + half_x, dy + half_y))


def half_extent(camera) -> float:
    """Half of the image window along the fitted axis."""
    if camera.type == "ORTHO":
        return 0.5 * camera.ortho_scale
    vertical = camera.sensor_fit == "VERTICAL"
    sensor = camera.sensor_height if vertical else camera.sensor_width
    return 0.5 * sensor / camera.lens


def rigid(matrix) -> np.ndarray:
    """The matrix without scale: columns of unit length, as Blender looks through a camera."""
    out = np.array(matrix, np.float64)
    for column in range(3):
        length = np.linalg.norm(out[:3, column])
        out[:3, column] = out[:3, column] / length if length > 0 else np.eye(3)[column]
    return out


def focus_distance(camera, matrix: np.ndarray) -> float:
    """Distance of the focus plane along the camera's axis."""
    target = camera.dof.focus_object
    if target is None:
        return camera.dof.focus_distance
    offset = np.array(target.matrix_world.translation) - matrix[:3, 3]
    return abs(float(np.dot(matrix[:3, 2], offset)))


def depth_of_field(camera, matrix: np.ndarray) -> dict:
    """Fields of a thin lens; empty for a pinhole."""
    dof = camera.dof
    if not dof.use_dof:
        return {}
    fstop = max(dof.aperture_fstop, 1e-5)
    lens = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return {
        "lens_radius": lens / (2.0 * fstop),
        "focus_distance": max(focus_distance(camera, matrix), 1e-6),
        "aperture_ratio": max(dof.aperture_ratio, 1e-5),
        "aperture_blades": dof.aperture_blades if dof.aperture_blades >= 3 else 0,
        "aperture_rotation": dof.aperture_rotation,
    }


def camera_fields(native, camera_object, frame: Frame, report, override=None) -> dict:
    """Arguments of set_camera; `override`: (matrix, shift_x) of a stereo view."""
    camera = camera_object.data
    if camera.type not in {"PERSP", "ORTHO"}:
        message = "Panoramic cameras are rendered as perspective ones."
        report.warn(camera_object.name, message, "OBJECT")
    matrix, shift_x = override or (camera_object.matrix_world, camera.shift_x)
    matrix = rigid(matrix)
    horizontal = fits_horizontally(camera.sensor_fit, frame)
    window = image_window(half_extent(camera), horizontal, frame, (shift_x, camera.shift_y))
    kinds = native.CameraType
    return {
        "type": kinds.Orthographic if camera.type == "ORTHO" else kinds.Perspective,
        "to_world": matrix.tolist(),
        "window_lower": window.lower,
        "window_upper": window.upper,
        "near_clip": camera.clip_start,
        "far_clip": camera.clip_end,
        **depth_of_field(camera, matrix),
    }


def projected_window(window_matrix: np.ndarray) -> Window:
    """The image window behind a projection matrix of a viewport."""
    p = np.array(window_matrix, np.float64)
    perspective = p[3, 3] == 0.0
    offset = p[:2, 2] if perspective else -p[:2, 3]
    scale = np.array([p[0, 0], p[1, 1]])
    lower = (offset - 1.0) / scale
    upper = (offset + 1.0) / scale
    return Window(tuple(lower.tolist()), tuple(upper.tolist()))


def border_crop(frame: Frame, border: tuple[float, float, float, float]) -> Crop:
    """Pixels inside a border (min x, max x, min y, max y), truncated as Blender truncates them."""
    width, height = np.float32(frame.width), np.float32(frame.height)
    x0, x1 = (int(np.float32(value) * width) for value in border[:2])
    y0, y1 = (int(np.float32(value) * height) for value in border[2:])
    return Crop(x0, y0, max(x1 - x0, 1), max(y1 - y0, 1))


def render_frame(render) -> Frame:
    scale = render.resolution_percentage
    return Frame(
        max(render.resolution_x * scale // 100, 1),
        max(render.resolution_y * scale // 100, 1),
        render.pixel_aspect_x,
        render.pixel_aspect_y,
    )


def render_crop(render, frame: Frame) -> Crop:
    if not render.use_border:
        return Crop(0, 0, frame.width, frame.height)
    return border_crop(
        frame,
        (render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y),
    )
