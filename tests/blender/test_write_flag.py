"""After a final render (F12) that began while a panel was being drawn, timers may write to
Blender's data.
"""
# hosts: window

from __future__ import annotations

import threading
import time

import bpy
import harness
import steps

ROUNDS = 4
_drawing = threading.Event()
_entered = threading.Event()  # the render's callback has begun: panels are quick from then on
_overlaps = []  # of each render's callback: it came in while a panel was drawn


def slow_draw(_panel, _context) -> None:
    """Gives up Python's lock, as a long panel does on a busy machine."""
    if bpy.app.is_job_running("RENDER") and not _entered.is_set():
        _drawing.set()
        time.sleep(0.05)
        _drawing.clear()


def redraw() -> float:
    for area in bpy.context.window_manager.windows[0].screen.areas:
        area.tag_redraw()
    return 0.02


def watch_renders() -> None:
    from pharos import final

    render = final.render

    def watched(engine, depsgraph, module):
        _overlaps.append(_drawing.is_set())
        _entered.set()
        render(engine, depsgraph, module)

    final.render = watched


def scene() -> None:
    made = harness.new_scene(64, 48, 4)
    bpy.context.preferences.view.render_display_type = "NONE"
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), harness.emission((0.2, 0.4, 0.6)))
    made.frame_end = 100
    watch_renders()
    bpy.types.VIEW3D_HT_header.prepend(slow_draw)
    bpy.types.TOPBAR_HT_upper_bar.prepend(slow_draw)
    bpy.app.timers.register(redraw)


def render() -> None:
    """As F12 does it: on a thread of its own."""
    assert not bpy.app.is_job_running("RENDER")
    bpy.context.scene.pharos.samples = 1500  # long enough that most end outside of a draw
    _entered.clear()
    assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def a_timer_may_write() -> None:
    assert not bpy.app.is_job_running("RENDER")
    bpy.context.scene.frame_end += 1


def renders_began_while_drawing() -> None:
    """Else this test showed nothing."""
    assert len(_overlaps) == ROUNDS
    assert any(_overlaps), _overlaps
    assert bpy.context.scene.frame_end == 100 + ROUNDS


ROUND = (render, a_timer_may_write)
STEPS = {f"step_{i}_{f.__name__}": f for i in range(ROUNDS) for f in ROUND}
steps.main({"step_scene": scene, **STEPS, "step_overlaps": renders_began_while_drawing})
