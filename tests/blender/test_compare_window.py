"""Compare with Cycles from the interface: it stays free meanwhile, Esc ends it, an image editor
shows both pictures."""
# hosts: window

from __future__ import annotations

import importlib
import os
import time

import bpy
import harness
import steps

NAME = "Compare with Cycles"


def is_at_work() -> bool:
    return importlib.import_module("pharos.compare").is_at_work()


def press(seconds: float) -> set[str]:
    """What a click on the button does."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        return bpy.ops.pharos.compare(
            "INVOKE_DEFAULT", seconds=seconds, folder=str(harness.TEMPORARY / "shown")
        )


def children() -> list[str]:
    """Background Blenders at work on a copy of the scene."""
    found = os.popen(f"ps --ppid {os.getpid()} -o args=").read()
    return [line for line in found.splitlines() if "pharos_compare_" in line]


def step_scene():
    scene = bpy.context.scene
    scene.render.engine = "PHAROS"
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.render.threads_mode, scene.render.threads = "FIXED", 2


def step_press_returns_at_once():
    began = time.monotonic()
    assert press(60.0) == {"RUNNING_MODAL"}
    assert time.monotonic() - began < 5.0
    assert children()
    assert not bpy.ops.pharos.compare.poll()


def step_interface_is_free_meanwhile():
    assert is_at_work()
    bpy.context.scene.frame_current += 1


def step_escape_ends_it():
    os.system("xdotool key Escape")
    time.sleep(0.2)


def step_nothing_is_left():
    if is_at_work():
        os.system("xdotool key Escape")  # a busy X server may have lost the first
    assert not is_at_work()
    assert not children()
    assert NAME not in bpy.data.images


def step_press_again():
    assert press(0.4) == {"RUNNING_MODAL"}


def step_both_are_shown():
    assert not is_at_work()
    image = bpy.data.images[NAME]
    assert tuple(image.size) == (2 * 48 + 4, 32)
    editors = [
        area.spaces.active
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR"
    ]
    assert [space for space in editors if space.image == image]
    assert (harness.TEMPORARY / "shown" / "compare.png").exists()
    assert importlib.import_module("pharos.compare").last_lines()


def step_the_panel_can_be_drawn():
    panel = bpy.types.PHAROS_RENDER_PT_compare
    assert panel.poll(bpy.context)


steps.main(globals(), most_tries=300)
