"""Live lobes: what the guide believes at the point under a click, drawn into the viewport.

Each lobe is an arrow along the mean direction of the light it stands for, the longer the larger its
share, with kappa and share beside it; a line of text says how far the guide is trusted there, or
why it is off.
"""

from __future__ import annotations

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from .viewport import viewport_of

_COLOR = (1.0, 0.75, 0.1, 1.0)
_TEXT = (1.0, 1.0, 1.0, 1.0)
_LENGTH = 0.25  # of the view's distance: an arrow with all of the light
_LEAST_WEIGHT = 0.01
_LINE = 16  # pixels between lines of text
_HEAD = 0.15  # of an arrow's length


class _Overlay:
    """The last answer, where it is drawn, and the handlers that draw it."""

    def __init__(self):
        self.probe = None
        self.area = 0
        self.scale = 1.0
        self._handlers: list = []

    def show(self, probe, area, scale: float) -> None:
        self.probe, self.area, self.scale = probe, area.as_pointer(), scale
        if not self._handlers:
            add = bpy.types.SpaceView3D.draw_handler_add
            self._handlers = [
                add(_draw_arrows, (self,), "WINDOW", "POST_VIEW"),
                add(_draw_words, (self,), "WINDOW", "POST_PIXEL"),
            ]
        area.tag_redraw()

    def hide(self) -> None:
        for handler in self._handlers:
            bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
        self._handlers, self.probe = [], None

    def is_of(self, context) -> bool:
        return self.probe is not None and context.area.as_pointer() == self.area

    def arrows(self) -> list[tuple[Vector, Vector, object]]:
        """Start, end and lobe of each arrow."""
        start = Vector(self.probe.position)
        return [
            (start, start + Vector(lobe.direction) * self.scale * lobe.weight**0.5, lobe)
            for lobe in self.probe.lobes
            if lobe.weight >= _LEAST_WEIGHT
        ]


overlay = _Overlay()


def words(probe) -> list[str]:
    """What is written beside the point."""
    if not probe.hit:
        return ["No surface there"]
    why = probe.why_unguided
    if why:
        return [f"Guiding {why}"]
    shares = f"{100 * probe.diffuse_share:.0f} % diffuse, {100 * probe.glossy_share:.0f} % glossy"
    if probe.diffuse_share == probe.glossy_share == 0.0:
        return ["Guiding is off here: it has not been proven to gain"]
    return [f"Guided {shares}; light {probe.irradiance:.3g}"]


def _strokes(start: Vector, end: Vector) -> list[Vector]:
    """An arrow as pairs of points."""
    along = end - start
    side = along.orthogonal().normalized() * along.length * 0.5 * _HEAD
    neck = end - along * _HEAD
    return [start, end, end, neck + side, end, neck - side]


def _draw_arrows(shown: _Overlay) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    if not shown.is_of(bpy.context) or not shown.probe.lobes:
        return
    points = [point for start, end, _ in shown.arrows() for point in _strokes(start, end)]
    name = "3D_UNIFORM_COLOR" if bpy.app.version < (4, 0, 0) else "UNIFORM_COLOR"
    shader = gpu.shader.from_builtin(name)
    batch = batch_for_shader(shader, "LINES", {"pos": [tuple(p) for p in points]})
    gpu.state.line_width_set(2.0)
    gpu.state.depth_test_set("NONE")
    shader.bind()
    shader.uniform_float("color", _COLOR)
    batch.draw(shader)
    gpu.state.line_width_set(1.0)


def _draw_words(shown: _Overlay) -> None:
    if not shown.is_of(bpy.context):
        return
    region, data = bpy.context.region, bpy.context.region_data
    if shown.probe.hit:
        for _, end, lobe in shown.arrows():
            _write(
                location_3d_to_region_2d(region, data, end),
                f"κ {lobe.kappa:.3g}, {100 * lobe.weight:.0f} %",
            )
        place = location_3d_to_region_2d(region, data, Vector(shown.probe.position))
    else:
        place = Vector((0.5 * region.width, 0.5 * region.height))
    for row, text in enumerate(words(shown.probe)):
        _write(place, text, -_LINE * (row + 1))


def _write(place, text: str, down: float = 0.0) -> None:
    import blf

    if place is None:
        return
    font = 0
    if bpy.app.version < (4, 0, 0):
        blf.size(font, 12, 72)
    else:
        blf.size(font, 12)
    blf.color(font, *_TEXT)
    blf.position(font, place[0] + 6, place[1] + down, 0)
    blf.draw(font, text)


class PHAROS_OT_show_lobes(bpy.types.Operator):
    """Click on a surface to see what the guide has learned there; Esc takes it away"""

    bl_idname = "pharos.show_lobes"
    bl_label = "Show Learned Light"

    @classmethod
    def poll(cls, context):
        return context.area is not None and viewport_of(context.area) is not None

    def invoke(self, context, event):
        self._question = 0
        self._timer = context.window_manager.event_timer_add(0.05, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Click: learned light at a point   Esc: end")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        viewport = viewport_of(context.area) if context.area is not None else None
        if viewport is None or event.type in {"ESC", "RIGHTMOUSE"}:
            self.end(context)
            return {"FINISHED"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            self._question = ask(viewport, event.mouse_region_x, event.mouse_region_y)
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and self._question:
            if show_answer(viewport, context, self._question):
                self._question = 0
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def end(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        overlay.hide()
        if context.area is not None:
            context.area.tag_redraw()

    def cancel(self, context) -> None:
        self.end(context)


def ask(viewport, x: float, y: float) -> int:
    """Ask about a pixel of the region; the number of the question, 0 outside of the picture."""
    crop = viewport.crop
    place = ((x - crop.x + 0.5) / crop.width, (y - crop.y + 0.5) / crop.height)
    if not all(0.0 <= value <= 1.0 for value in place):
        return 0
    return viewport.session.ask_lobes(*place)


def show_answer(viewport, context, question: int) -> bool:
    """Draw the answer to a question, if it is there."""
    probe = viewport.session.lobes()
    if probe.question < question:
        return False
    overlay.show(probe, context.area, _LENGTH * context.region_data.view_distance)
    return True


def _menu(self, context):
    if context.scene.render.engine == "PHAROS":
        self.layout.separator()
        self.layout.operator(PHAROS_OT_show_lobes.bl_idname)


def register():
    bpy.utils.register_class(PHAROS_OT_show_lobes)
    bpy.types.VIEW3D_MT_view.append(_menu)


def unregister():
    overlay.hide()
    bpy.types.VIEW3D_MT_view.remove(_menu)
    bpy.utils.unregister_class(PHAROS_OT_show_lobes)
