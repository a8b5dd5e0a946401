"""From where a viewport looks: its camera, its border, and what of that a native session needs."""

from __future__ import annotations

import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from .export.camera import (
    Crop,
    Frame,
    View,
    border_crop,
    depth_of_field,
    projected_window,
    rigid,
)


def _camera_rectangle(context, camera) -> tuple[float, float, float, float] | None:
    """The camera's frame in the region, in fractions: min x, max x, min y, max y."""
    region, data = context.region, context.region_data
    corners = [
        location_3d_to_region_2d(region, data, camera.matrix_world @ corner)
        for corner in camera.data.view_frame(scene=context.scene)
    ]
    if any(corner is None for corner in corners):
        return None
    x = [corner[0] / max(region.width, 1) for corner in corners]
    y = [corner[1] / max(region.height, 1) for corner in corners]
    return min(x), max(x), min(y), max(y)


def _border(context, camera) -> tuple[float, float, float, float] | None:
    """The part of the region that is rendered, in fractions; None: all of it."""
    if camera is None:
        space = context.space_data
        if not space.use_render_border:
            return None
        left, right = space.render_border_min_x, space.render_border_max_x
        bottom, top = space.render_border_min_y, space.render_border_max_y
    else:
        render = context.scene.render
        frame = _camera_rectangle(context, camera) if render.use_border else None
        if frame is None:
            return None
        x0, x1, y0, y1 = frame
        left, right = (x0 + f * (x1 - x0) for f in (render.border_min_x, render.border_max_x))
        bottom, top = (y0 + f * (y1 - y0) for f in (render.border_min_y, render.border_max_y))
    limited = np.clip([left, right, bottom, top], 0.0, 1.0).tolist()
    inside = limited[0] < limited[1] and limited[2] < limited[3]
    return tuple(limited) if inside else None


class ViewState:
    """All that the picture depends on beside the scene."""

    def __init__(self, native, context):
        region, data, space = context.region, context.region_data, context.space_data
        self._native = native
        self._frame = Frame(max(region.width, 1), max(region.height, 1))
        self._projection = np.array(data.window_matrix, np.float64)
        self._matrix = rigid(data.view_matrix.inverted())
        self._clip = (space.clip_start, space.clip_end)
        self._lens: dict = {}
        camera = space.camera if data.view_perspective == "CAMERA" else None
        if camera is not None and camera.type == "CAMERA":
            self._clip = (camera.data.clip_start, camera.data.clip_end)
            self._lens = depth_of_field(camera.data, self._matrix)
        else:
            camera = None
        border = _border(context, camera)
        self.crop = Crop(0, 0, *self._frame[:2])
        if border is not None:
            self.crop = border_crop(self._frame, border)

    def view(self) -> View:
        window = projected_window(self._projection)
        perspective = self._projection[3, 3] == 0.0
        kinds = self._native.CameraType
        fields = {
            "type": kinds.Perspective if perspective else kinds.Orthographic,
            "to_world": self._matrix.tolist(),
            "window_lower": window.lower,
            "window_upper": window.upper,
            # An orthographic viewport also shows what lies behind the point it turns about.
            "near_clip": self._clip[0] if perspective else -self._clip[1],
            "far_clip": self._clip[1],
            **self._lens,
        }
        return View(fields, self._frame, self.crop)
