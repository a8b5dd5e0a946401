"""What people do in Blender's window while a render runs: undo, remove objects, open another file,
switch the add-on off. It ends or goes on as it should, and the next render is right.
"""
# hosts: window

from __future__ import annotations

import time

import addon_utils
import bpy
import harness
import steps

COLOR = (0.2, 0.4, 0.6)
FILE = harness.TEMPORARY / "other.blend"
OTHER_COLOR = (0.5, 0.3, 0.1)
_began = {}


def window_context():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def is_rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def start(samples: int = 1 << 24) -> None:
    """As F12 does it: on a thread of its own."""
    scene = bpy.context.scene
    scene.pharos.samples = samples
    with window_context():
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def set_scene(color) -> None:
    scene = harness.new_scene(96, 64, 4)
    bpy.context.preferences.view.render_display_type = "NONE"
    scene.pharos.guiding = "NEURAL"
    bpy.context.view_layer.pharos.use_pass_guide_share = True  # learns, small as it is
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), harness.emission(color))
    with window_context():
        bpy.ops.ed.undo_push(message="scene")


def expect_picture(color) -> None:
    """In the result of the last render."""
    path = harness.TEMPORARY / "result.exr"
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    bpy.data.images["Render Result"].save_render(str(path))
    pixels = harness.read_exr(path)
    assert pixels.shape[:2] == (64, 96), pixels.shape
    assert harness.close(pixels[..., :3], color, 1e-5), pixels[30, 40]


def ended_within(seconds: float) -> None:
    assert not is_rendering()
    assert time.monotonic() - _began["end"] < seconds, time.monotonic() - _began["end"]


def step_scenes():
    set_scene(OTHER_COLOR)
    bpy.ops.wm.save_as_mainfile(filepath=str(FILE), copy=True)
    set_scene(COLOR)


def step_start_before_undo():
    start()


def step_undo_ends_the_render():
    assert is_rendering()
    name = harness.add_object(harness.cube_mesh(), location=(50.0, 0.0, 0.0)).name
    with window_context():
        bpy.ops.ed.undo_push(message="cube")
        _began["end"] = time.monotonic()
        bpy.ops.ed.undo()
        ended_within(2.0)
        assert name not in bpy.data.objects
        bpy.ops.ed.redo()
        assert name in bpy.data.objects
        bpy.ops.ed.undo()


def step_render_after_undo():
    start(4)


def step_undo_did_no_harm():
    assert not is_rendering()
    expect_picture(COLOR)


def step_start_before_objects_go():
    start()


def step_objects_go_while_rendering():
    """What is rendered has been exported: Blender's data may change."""
    assert is_rendering()
    bpy.data.objects.remove(bpy.context.scene.objects["Plane"])
    assert is_rendering()


def step_open_a_file_while_rendering():
    assert is_rendering()
    _began["end"] = time.monotonic()
    bpy.ops.wm.open_mainfile(filepath=str(FILE), load_ui=False)


def step_the_render_has_ended_with_its_file():
    ended_within(10.0)
    assert bpy.data.filepath == str(FILE)


def step_render_the_opened_file():
    start(4)


def step_it_is_right():
    assert not is_rendering()
    expect_picture(OTHER_COLOR)


def step_start_before_the_addon_goes():
    start()


def step_disable_the_addon_while_rendering():
    assert is_rendering()
    _began["end"] = time.monotonic()
    addon_utils.disable("pharos")
    assert not hasattr(bpy.types.Scene, "pharos")


def step_the_render_has_ended_with_the_addon():
    ended_within(10.0)


def step_enable_it_again():
    harness.enable_addon()
    bpy.context.scene.render.engine = "PHAROS"
    scene = bpy.context.scene
    scene.pharos.follow_cycles, scene.pharos.pixel_filter = False, "BOX"


def step_render_again():
    start(4)


def step_that_is_right_too():
    assert not is_rendering()
    expect_picture(OTHER_COLOR)


def step_disable_it_under_a_viewport():
    """Its sessions end with their engine objects."""
    with window_context():
        bpy.context.area.spaces[0].shading.type = "RENDERED"


def step_while_it_renders():
    addon_utils.disable("pharos")


def step_and_enable_it():
    harness.enable_addon()
    bpy.context.scene.render.engine = "PHAROS"


def step_shade_it_plainly():
    """Blender notes in one place for all threads whether Python may write: a render that starts in
    the midst of a viewport's drawing leaves timers, as this one, without that right for ever.
    """
    with window_context():
        bpy.context.area.spaces[0].shading.type = "SOLID"


def step_render_after_that():
    start(4)


def step_and_render():
    assert not is_rendering()
    expect_picture(OTHER_COLOR)
    harness.say("STRESS undo, file load, add-on off while rendering: wrong|5|0|0")


steps.main(globals())
