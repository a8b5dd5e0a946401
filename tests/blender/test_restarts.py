"""Viewports switched on and off and final renders (F12) in one Blender, one after the other: each
shows its picture, and no thread is left. A few usually, PHAROS_RESTARTS of each otherwise.
"""
# hosts: window

from __future__ import annotations

import os
from pathlib import Path

import bpy
import harness
import steps

COLOR = (0.2, 0.4, 0.6)
ROUNDS = int(os.environ.get("PHAROS_RESTARTS", "3"))
_threads = []


def area():
    screen = bpy.context.window_manager.windows[0].screen
    return next(a for a in screen.areas if a.type == "VIEW_3D")


def shade(kind: str) -> None:
    area().spaces[0].shading.type = kind
    area().tag_redraw()


def thread_count() -> int:
    return sum(1 for _ in Path("/proc/self/task").iterdir())


def scene() -> None:
    made = harness.new_scene(64, 48, 4)
    bpy.context.preferences.view.render_display_type = "NONE"
    made.pharos.preview_samples = 8
    made.pharos.guiding = "NEURAL"
    bpy.context.view_layer.pharos.use_pass_guide_share = True  # learns, small as it is
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), harness.emission(COLOR))
    area().spaces[0].region_3d.view_perspective = "CAMERA"


def start_a_viewport() -> None:
    shade("RENDERED")


def it_shows_a_picture() -> None:
    from pharos.viewport import viewport_of

    shown = viewport_of(area())
    assert shown is not None
    assert shown.session.progress().has_picture
    shade("SOLID")


def render() -> None:
    """As F12 does it: on a thread of its own."""
    assert not bpy.app.is_job_running("RENDER")
    assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def it_is_right() -> None:
    assert not bpy.app.is_job_running("RENDER")
    path = harness.TEMPORARY / "result.exr"
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    bpy.data.images["Render Result"].save_render(str(path))
    pixels = harness.read_exr(path)
    assert harness.close(pixels[..., :3], COLOR, 1e-5), pixels[24, 32]
    _threads.append(thread_count())


def no_thread_is_left() -> None:
    """Blender itself starts some for the first pictures."""
    assert len(_threads) == ROUNDS
    assert thread_count() <= _threads[0], (_threads, thread_count())


ROUND = (start_a_viewport, it_shows_a_picture, render, it_is_right)
STEPS = {f"step_{i}_{f.__name__}": f for i in range(ROUNDS) for f in ROUND}
steps.main({"step_scene": scene, **STEPS, "step_no_thread_is_left": no_thread_is_left})
