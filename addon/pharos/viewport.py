"""The rendered viewport: a live session that follows scene and view, its picture as a texture.

An edit walks over the scene again, but hands over only what the session does not hold; a moved view
exports nothing. Native threads never touch Blender: a timer on the main thread looks for new
pictures and asks for a redraw.
"""

from __future__ import annotations

import contextlib
import time
import weakref

import bpy

from . import compat, denoise, handlers
from .export.library import Library
from .export.report import Report
from .export.scene import export_scene, set_view
from .export.settings import viewport_samples
from .final import stats_line
from .view_state import ViewState

_SHORTEST_INTERVAL = 1.0 / 30.0  # seconds between redraws
_LONGEST_INTERVAL = 0.5
_DRAWING_SHARE = 0.33  # most of the time goes into rendering, not into showing it
_PENDING_INTERVAL = 0.005  # seconds between looks for the first picture of a change
# Seconds that a redraw may wait for the first picture of a change, which it would miss otherwise:
# drawing the window once more takes the host longer. The first of all is worth more.
_PATIENCE = 0.03
_FIRST_PATIENCE = 0.3

_open: weakref.WeakSet = weakref.WeakSet()  # viewports that may be found by their area


class Viewport:
    """One viewport of one engine object; close() may be called at any time, also twice."""

    def __init__(self, native, threads: int):
        self._native = native
        self._session = native.LiveSession(threads)
        self._library = Library()
        self._epoch = handlers.edit_epoch()
        self._engine = lambda: None  # of the last redraw, while it lives
        self._area = None  # pointer of the area that shows it
        self._has_scene = False
        self._sent_full = True  # the last scene came with all its content
        self._crop = None  # of the picture last asked for
        self._drawn = None  # serial and crop of the texture
        self._picture = None
        self._texture = None
        self._denoiser = None
        self._denoised = 0  # number of the picture that was shown without noise
        self._paused = False  # a final render has the processor
        self._draw_began = 0.0  # of the last redraw, until its cost is known
        self._next_draw = 0.0  # of more samples of the same picture
        self._drawn_pictures = 0
        self._changed = True  # since the last redraw
        _open.add(self)
        self._start_timer()

    @property
    def area(self) -> int | None:
        return self._area

    @property
    def crop(self):
        """The part of the region that is rendered."""
        return self._crop

    @property
    def session(self):
        return self._session

    def close(self) -> None:
        self._session = self._texture = self._picture = None

    def scene_changed(self, context, depsgraph) -> None:
        """Hand over the scene as it is now."""
        library = self._library
        if self._session.progress().lost_scene:
            library.clear()
        self._sent_full = library.is_empty
        self._changed = True
        if handlers.edit_epoch() != self._epoch:
            self._epoch = handlers.edit_epoch()
            library.forget_places()
        library.tag(depsgraph.updates)
        report = Report()
        complete = False
        library.begin()
        try:
            description = export_scene(self._native, depsgraph, report, library=library)
            self._set_view(description, ViewState(self._native, context), depsgraph)
            self._session.set_scene(description)
            library.end()
            self._has_scene = complete = True
        finally:
            if not complete:
                library.clear()
            handlers.post_report(depsgraph.scene.name, report.entries)

    def has_news(self) -> bool:
        if self._session is None:
            return False
        if self._denoiser is not None and self._denoiser.is_ready:
            return True
        progress = self._session.progress()
        if not progress.has_picture:
            return progress.render.state == self._native.SessionState.Failed
        return self._drawn is None or progress.render.serial != self._drawn[0]

    @property
    def is_pending(self) -> bool:
        """Whether the first picture of a change is still to come."""
        progress = self._session.progress()
        return not progress.has_picture or progress.pictures != self._drawn_pictures

    def is_due(self) -> bool:
        """A new picture is shown at once, more samples of one when drawing has had its share."""
        return self.is_pending or time.monotonic() >= self._next_draw

    def count_redraw(self) -> None:
        """All of the last redraw counts, the host's part of it too."""
        if self._draw_began:
            now = time.monotonic()
            wait = (now - self._draw_began) * (1.0 / _DRAWING_SHARE - 1.0)
            self._next_draw = now + min(wait, _LONGEST_INTERVAL)
            self._draw_began = 0.0

    def yield_to_render(self) -> None:
        """Stop while a final render is under way; go on from the start afterwards."""
        rendering = bpy.app.is_job_running("RENDER")
        if rendering != self._paused and self._session is not None:
            self._session.set_paused(rendering)
            self._paused = rendering

    def draw(self, engine, context, depsgraph) -> None:
        if self._session is None:
            return
        self._draw_began = time.monotonic()
        self._engine = weakref.ref(engine)
        self._area = context.area.as_pointer()
        lost = self._session.progress().lost_scene and not self._sent_full
        if lost or not self._has_scene:
            self.scene_changed(context, depsgraph)
        state = ViewState(self._native, context)
        view = self._native.SceneDescription(compat.version_number())
        self._set_view(view, state, depsgraph)
        changed = self._session.set_view(view) or self._changed
        self._changed = False
        self._crop = state.crop
        self._choose_denoiser(depsgraph.scene)
        if changed:
            self._session.wait_picture(_FIRST_PATIENCE if self._texture is None else _PATIENCE)
        self._update_texture()
        self._draw_texture(engine, context, depsgraph)
        progress = self._session.progress()
        failed = progress.render.state == self._native.SessionState.Failed
        engine.update_stats("", progress.render.error if failed else live_line(progress))

    def _set_view(self, description, state: ViewState, depsgraph) -> None:
        scene = depsgraph.scene_eval
        set_view(self._native, description, scene, state.view())
        description.set_settings(samples=viewport_samples(scene), time_limit=0.0)

    def _choose_denoiser(self, scene) -> None:
        oidn = denoise.load().oidn if scene.pharos.use_preview_denoising else None
        if oidn is None:
            self._denoiser, self._denoised = None, 0
        elif self._denoiser is None:
            self._denoiser = denoise.Denoiser(oidn)
            self._drawn = None

    def _update_texture(self) -> None:
        if not self.has_news():
            return
        progress = self._session.progress()
        if self._denoiser is not None and (done := self._denoiser.take()) is not None:
            pixels, picture = done
            if picture == progress.pictures:
                self._show(pixels)
                self._denoised = picture
        found = self._session.picture()
        if found is None:
            return  # the last picture looks better than nothing
        pixels, serial = found
        if self._denoiser is not None and progress.render.samples > 0:
            if self._denoiser.busy:
                return  # this one, or what it has become, is taken when the thread is free
            self._denoiser.start(pixels, progress.pictures)
        self._drawn = serial, self._crop
        self._drawn_pictures = progress.pictures
        if self._denoised != progress.pictures:
            self._show(pixels)

    def _show(self, pixels) -> None:
        import gpu  # not there in background mode of newer versions

        height, width = pixels.shape[:2]
        # The buffer refers to the array: both live as long as the texture.
        self._picture = pixels
        buffer = gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel())
        self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)

    def _draw_texture(self, engine, context, depsgraph) -> None:
        """The last picture there is, stretched while a new size has none yet."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if self._texture is None:
            return
        crop = self._crop
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(depsgraph.scene)
        draw_texture_2d(self._texture, (crop.x, crop.y), crop.width, crop.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def _start_timer(self) -> None:
        reference = weakref.ref(self)

        def look() -> float | None:
            viewport = reference()
            if viewport is None or viewport.session is None:
                return None
            viewport.yield_to_render()
            viewport.count_redraw()
            if viewport.has_news() and viewport.is_due():
                viewport.redraw()
            return _PENDING_INTERVAL if viewport.is_pending else _SHORTEST_INTERVAL

        bpy.app.timers.register(look, first_interval=_SHORTEST_INTERVAL)

    def redraw(self) -> None:
        """Asks for a redraw with a new picture; through the engine, where it has drawn before: the
        host then keeps its depths, for which it would draw all triangles.
        """
        engine = self._engine()
        if engine is not None:
            with contextlib.suppress(ReferenceError):  # freed by the host: nothing to draw for
                engine.tag_redraw()
            return
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D" and self._area in (None, area.as_pointer()):
                    area.tag_redraw()


def viewport_of(area) -> Viewport | None:
    """The viewport that an area shows, if it is one of ours."""
    pointer = area.as_pointer()
    return next((v for v in _open if v.session is not None and v.area == pointer), None)


def live_line(progress) -> str:
    """The statistics of a viewport: those of a render, and where the guide comes from."""
    line = stats_line(progress.render)
    if not progress.render.guiding.enabled:
        return line
    return f"{line} | {'Guide kept' if progress.guide_kept else 'Guide new'}"
