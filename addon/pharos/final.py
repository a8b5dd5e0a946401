"""A final render: export, session, polling, results. No picture is ever lost on the way out."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import contextmanager
from typing import NamedTuple

import bpy

from . import checkpoints, compat, handlers, operators, output, running
from .export.camera import Crop, View, camera_fields, render_crop, render_frame
from .export.instances import Cancelled
from .export.report import Report
from .export.scene import export_scene, set_view
from .guide_memory import GuideMemory
from .passes import PassRequest, film_passes, name_unsupported_passes, wanted_passes

_POLL = 0.05  # seconds between looks at the session and at Blender's Esc
_FIRST_RESULT = 0.1
_RESULT_INTERVAL = 0.4
_PREVIEW_SAMPLES = 16
_TERMINATED = 143


class Termination:
    """SIGTERM during a render in background mode."""

    def __init__(self):
        self.asked = False

    def _remember(self, *_) -> None:
        self.asked = True

    @contextmanager
    def caught(self):
        if not bpy.app.background:
            yield self
            return
        before = signal.signal(signal.SIGTERM, self._remember)
        try:
            yield self
        finally:
            signal.signal(signal.SIGTERM, before)


class Ends(NamedTuple):
    """Who may end a render beside Blender itself."""

    termination: Termination
    switched_off: threading.Event  # the add-on is

    @property
    def asked(self) -> bool:
        return self.termination.asked or self.switched_off.is_set()


class FinalRender:
    """One view layer (and stereo view) of one frame."""

    def __init__(self, engine, depsgraph, native, ends: Ends):
        self._engine = engine
        self._depsgraph = depsgraph
        self._native = native
        self._ends = ends
        self._scene = depsgraph.scene_eval
        self._layer = depsgraph.view_layer_eval
        self._report = Report()
        self._line = output.ProgressLine(bpy.app.background)
        self._cancelled = False
        self._next_result = time.monotonic() + _FIRST_RESULT
        self._drawn_serial = 0

    def run(self, view_name: str) -> None:
        """Render and leave the result with Blender."""
        engine = self._engine
        frame = render_frame(self._scene.render)
        result = engine.begin_result(
            0, 0, frame.width, frame.height, layer=self._layer.name, view=view_name
        )
        try:
            if result is None:
                return
            crop = render_crop(self._scene.render, frame)
            # Blender has rounded the border already: its size is the one that counts.
            crop = Crop(crop.x, crop.y, result.resolution_x, result.resolution_y)
            description = self._export(frame, crop)
            if description is not None and not operators.take_dump(
                self._native, description, self._scene, self._layer
            ):
                self._render(description, result, view_name)
        except Cancelled:
            self._cancelled = True
        finally:
            engine.end_result(result)
            self._post_report()

    def _should_stop(self) -> bool:
        return self._ends.asked or self._engine.test_break()

    def _export(self, frame, crop):
        engine, scene = self._engine, self._scene
        engine.update_stats("", "Exporting scene")
        name_unsupported_passes(self._layer, self._report)
        camera = scene.camera
        if camera is None or camera.type != "CAMERA":
            engine.report({"ERROR"}, "Pharos: the scene has no camera.")
            return None
        description = export_scene(
            self._native,
            self._depsgraph,
            self._report,
            self._should_stop,
            lambda name: engine.update_stats("", f"Exporting {name}"),
            PassRequest(wanted_passes(self._layer)),
        )
        override = (engine.camera_model_matrix(camera), engine.camera_shift_x(camera))
        fields = camera_fields(self._native, camera, frame, self._report, override)
        set_view(self._native, description, scene, View(fields, frame, crop))
        if engine.is_preview:
            description.set_settings(samples=_PREVIEW_SAMPLES)
        return description

    def _threads(self) -> int:
        render = self._scene.render
        return render.threads if render.threads_mode == "FIXED" else 0

    def _checkpoint(self, view_name: str) -> str:
        if self._engine.is_preview:
            return ""
        return checkpoints.path_for(self._scene, self._layer.name, view_name)

    def _render(self, description, result, view_name: str) -> None:
        memory = GuideMemory(self._engine, self._scene, self._layer.name, view_name)
        checkpoint = self._checkpoint(view_name)
        session = self._native.RenderSession(
            description,
            self._threads(),
            checkpoint,
            60.0 * self._scene.pharos.checkpoint_interval,
            memory.earlier(checkpoint),
            memory.keeps,
        )
        try:
            self._poll(session, result)
            if session.progress().state != self._native.SessionState.Failed:
                self._show_result(session, result)
            self._report.add_native(session.report())
            self._finish(session)
            if session.progress().state == self._native.SessionState.Finished:
                self._remember(memory, session)
        finally:
            session.cancel()
            session.wait(60.0)

    def _poll(self, session, result) -> None:
        while not session.wait(_POLL):
            progress = session.progress()
            self._show_progress(progress)
            if self._should_stop():
                self._cancelled = True
                session.cancel()
                session.wait(60.0)
                return
            now = time.monotonic()
            if progress.serial != self._drawn_serial and now >= self._next_result:
                self._show_result(session, result)
                self._drawn_serial = progress.serial
                self._next_result = time.monotonic() + _RESULT_INTERVAL

    def _show_progress(self, progress) -> None:
        engine = self._engine
        building = progress.state == self._native.SessionState.Building
        engine.update_stats("", "Building scene" if building else stats_line(progress))
        engine.update_progress(min(max(progress.fraction, 0.0), 1.0))
        megabytes = progress.memory_bytes / 2**20
        engine.update_memory_stats(memory_used=megabytes, memory_peak=megabytes)
        self._line.show(progress)

    def _show_result(self, session, result) -> None:
        passes = result.layers[0].passes
        for entry in film_passes(self._layer):
            render_pass = passes.get(entry.blender_name)
            if render_pass is None:
                continue
            pixels = output.read_pass(self._native, session, entry)
            if pixels is not None:
                compat.set_pass_pixels(render_pass, pixels)
        self._engine.update_result(result)

    def _finish(self, session) -> None:
        progress = session.progress()
        self._line.show(progress, last=True)
        if progress.state == self._native.SessionState.Failed:
            self._engine.report({"ERROR"}, f"Pharos: {progress.error}")
        elif progress.nonfinite_samples:
            self._report.warn(
                self._scene.name, f"{progress.nonfinite_samples} samples were not finite numbers."
            )
        if self._layer.pharos.use_pass_effort and not self._engine.is_preview:
            handlers.post_slow(self._scene.name, session.effort())
        if self._cancelled:
            self._keep_partial(session)

    def _remember(self, memory, session) -> None:
        problem = memory.remember(session)
        if problem:
            self._report.warn(self._scene.name, problem)

    def _keep_partial(self, session) -> None:
        """Blender writes nothing when it is interrupted in background mode; a watcher may ask."""
        path = os.environ.get("PHAROS_PARTIAL", "")
        if bpy.app.background and path:
            output.write_partial(self._native, session, film_passes(self._layer), path)

    def _post_report(self) -> None:
        if not self._engine.is_preview:
            handlers.post_report(self._scene.name, self._report.entries)


def guide_words(guide) -> str:
    """What the guide does: its share and loss, or why it is off; empty where nobody asked."""
    if not guide.enabled:
        return ""
    why = guide.why_unguided
    doing = f"Guiding {why}" if why else f"Guiding {100 * guide.guided_share:.0f} % of vertices"
    if guide.snapshots:
        doing = f"{doing}, loss {guide.held_out_loss:.3f}"
    if not why and guide.fitting < 1.0:
        doing = f"{doing}, {100 * guide.fitting:.0f} % of its work fits into a frame"
    return doing


def stats_line(progress) -> str:
    parts = [f"Sample {progress.samples}/{progress.total_samples}"]
    if progress.remaining > 0.0:
        parts.append(f"{progress.remaining:.1f} s left")
    parts.append(f"Noise {progress.noise:.3g}")
    parts.append(guide_words(progress.guiding))
    if progress.nonfinite_samples:
        parts.append(f"{progress.nonfinite_samples} samples dropped")
    return " | ".join(part for part in parts if part)


def render(engine, depsgraph, native) -> None:
    """Every view of the current view layer."""
    termination = Termination()
    settings = depsgraph.scene.render
    views = [view.name for view in settings.views if view.use] if settings.use_multiview else [""]
    with termination.caught(), running.announced() as switched_off:
        ends = Ends(termination, switched_off)
        for view in views:
            if view:
                engine.active_view_set(view)
            FinalRender(engine, depsgraph, native, ends).run(view)
            if ends.asked or engine.test_break():
                break
        if termination.asked:
            # Blender itself would go on and end with 0.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(_TERMINATED)
