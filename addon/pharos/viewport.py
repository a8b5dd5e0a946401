"""The rendered viewport: a session per state of scene and view, its newest picture as a texture.

Any edit exports the scene anew; a moved view reuses the export. Native threads never touch Blender:
a timer on the main thread looks for new pictures and asks for a redraw.
"""

from __future__ import annotations

import time
import weakref

import bpy
import numpy as np

from . import handlers, output
from .export.camera import Crop, Frame, View, depth_of_field, projected_window, rigid
from .export.report import Report
from .export.scene import export_scene, set_view
from .export.settings import viewport_samples
from .final import stats_line
from .passes import PASSES

_SHORTEST_INTERVAL = 1.0 / 30.0  # seconds between redraws
_LONGEST_INTERVAL = 0.5
_PATIENCE = 0.5  # seconds that the last picture stands in for an unfinished one
_DRAWING_SHARE = 0.25  # most of the time may go into rendering, not into showing it


class ViewState:
    """All that the picture depends on beside the scene; compared as a tuple."""

    def __init__(self, native, context):
        region, data, space = context.region, context.region_data, context.space_data
        self.width, self.height = max(region.width, 1), max(region.height, 1)
        self._projection = np.array(data.window_matrix, np.float64)
        self._matrix = rigid(data.view_matrix.inverted())
        self._native = native
        self._clip = (space.clip_start, space.clip_end)
        self._lens: dict = {}
        camera = space.camera if data.view_perspective == "CAMERA" else None
        if camera is not None and camera.type == "CAMERA":
            self._clip = (camera.data.clip_start, camera.data.clip_end)
            self._lens = depth_of_field(camera.data, self._matrix)

    @property
    def key(self) -> tuple:
        return (
            self.width,
            self.height,
            self._projection.tobytes(),
            self._matrix.tobytes(),
            self._clip,
            tuple(self._lens.items()),
        )

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
        frame = Frame(self.width, self.height)
        return View(fields, frame, Crop(0, 0, self.width, self.height))


class Viewport:
    """One viewport of one engine object; close() may be called at any time, also twice."""

    def __init__(self, native):
        self._native = native
        self._description = None
        self._session = None
        self._view_key = None
        self._drawn_serial = 0
        self._picture = None
        self._texture = None
        self._report = Report()
        self._paused = False  # a final render has the processor
        self._interval = _SHORTEST_INTERVAL
        self._start_timer()

    def close(self) -> None:
        self._session = self._description = self._texture = self._picture = None

    def scene_changed(self, depsgraph) -> None:
        self._session = self._description = None
        self._report = Report()
        try:
            self._description = export_scene(self._native, depsgraph, self._report)
        finally:
            handlers.post_report(depsgraph.scene.name, self._report.entries)

    def has_news(self) -> bool:
        return self._session is not None and self._session.progress().serial != self._drawn_serial

    def yield_to_render(self) -> None:
        """Stop while a final render is under way; go on from the start afterwards."""
        rendering = bpy.app.is_job_running("RENDER")
        if rendering and not self._paused:
            self._session = None
        elif self._paused and not rendering:
            redraw_viewports()
        self._paused = rendering

    def draw(self, engine, context, depsgraph) -> None:
        if self._paused:
            self._draw_texture(engine, context, depsgraph)
            return
        began = time.monotonic()
        if self._description is None:
            self.scene_changed(depsgraph)
        state = ViewState(self._native, context)
        if self._session is None or state.key != self._view_key:
            self._restart(state, depsgraph)
        self._update_texture()
        self._draw_texture(engine, context, depsgraph)
        progress = self._session.progress()
        failed = progress.state == self._native.SessionState.Failed
        engine.update_stats("", progress.error if failed else stats_line(progress))
        wished = (time.monotonic() - began) / _DRAWING_SHARE
        self._interval = min(max(wished, _SHORTEST_INTERVAL), _LONGEST_INTERVAL)

    def _restart(self, state: ViewState, depsgraph) -> None:
        self._session = None  # its threads have ended when this returns
        scene = depsgraph.scene_eval
        description = self._description.copy()
        set_view(self._native, description, scene, state.view())
        description.set_settings(samples=viewport_samples(scene), time_limit=0.0)
        render = scene.render
        threads = render.threads if render.threads_mode == "FIXED" else 0
        self._session = self._native.RenderSession(description, threads)
        self._view_key = state.key
        self._drawn_serial = 0

    def _update_texture(self) -> None:
        import gpu  # not there in background mode of newer versions

        session = self._session
        progress = session.progress()
        if progress.serial == self._drawn_serial:
            return
        # Until each pixel has a sample the last picture looks better, but not for long.
        if progress.samples == 0 and progress.elapsed < _PATIENCE:
            return
        pixels = output.read_pass(self._native, session, PASSES[0])
        if pixels is None:
            return
        size = (session.width, session.height)
        # The buffer refers to the array: both live as long as the texture.
        self._picture = pixels
        buffer = gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel())
        self._texture = gpu.types.GPUTexture(size, format="RGBA16F", data=buffer)
        self._drawn_serial = progress.serial

    def _draw_texture(self, engine, context, depsgraph) -> None:
        """The last picture there is, stretched while a new size has none yet."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if self._texture is None:
            return
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(depsgraph.scene)
        draw_texture_2d(self._texture, (0, 0), context.region.width, context.region.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def _start_timer(self) -> None:
        reference = weakref.ref(self)

        def look() -> float | None:
            viewport = reference()
            if viewport is None:
                return None
            viewport.yield_to_render()
            if viewport.has_news():
                redraw_viewports()
            return viewport._interval

        bpy.app.timers.register(look, first_interval=_SHORTEST_INTERVAL)


def redraw_viewports() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
