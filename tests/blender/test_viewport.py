"""The rendered viewport in a real window: exact colours, upright, edits, resizes, no crash.

Steps run from a timer, one at a time, so that Blender draws between them; screenshots are of the
whole window and cut here (only those show what an engine draws).
"""
# hosts: window

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import bpy
import harness
import numpy as np
import steps

SHOT = harness.TEMPORARY / "shot.png"
_escape = {"pressed": 0.0, "looks": 0}


def area():
    screen = bpy.context.window_manager.windows[0].screen
    return next(a for a in screen.areas if a.type == "VIEW_3D")


def window_region():
    return next(r for r in area().regions if r.type == "WINDOW")


def shade(kind: str) -> None:
    area().spaces[0].shading.type = kind


def screenshot() -> np.ndarray:
    """Bytes of the viewport's window region, bottom row first."""
    window = bpy.context.window_manager.windows[0]
    region = window_region()
    with bpy.context.temp_override(window=window, area=area(), region=region):
        bpy.ops.screen.screenshot(filepath=str(SHOT))
    # An image in Blender's own data would be an edit, and start the viewport anew.
    done = subprocess.run(
        ["convert", str(SHOT), "-depth", "8", "rgb:-"], capture_output=True, check=True
    )
    shot = np.frombuffer(done.stdout, np.uint8).reshape(window.height, window.width, 3)[::-1]
    cut = shot[region.y : region.y + region.height, region.x : region.x + region.width]
    return cut.astype(np.float64)


def encoded(linear) -> np.ndarray:
    """What the Standard view shows of scene-linear values, in bytes."""
    v = np.asarray(linear, float)
    return 255 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.power(v, 1 / 2.4) - 0.055)


def expect(shot, fractions, linear) -> None:
    """The colour at a place (fractions of width and height, from the bottom left)."""
    x, y = (int(f * n) for f, n in zip(fractions, (shot.shape[1], shot.shape[0])))
    seen = shot[y, x]
    assert np.abs(seen - encoded(linear)).max() <= 2.5, (fractions, seen, encoded(linear))


def viewport():
    """Ours, that the first area shows."""
    from pharos.viewport import viewport_of

    return viewport_of(area())


def step_prepare():
    scene = harness.new_scene(64, 64, 16)
    scene.pharos.preview_samples = 8
    scene.view_settings.view_transform = "Standard"
    harness.set_world((0.2, 0.5, 0.1))
    space = area().spaces[0]
    space.overlay.show_overlays = space.show_gizmo = False
    space.show_region_toolbar = space.show_region_ui = space.show_region_header = False
    shade("RENDERED")


def step_colour_is_exact():
    shot = screenshot()
    for place in ((0.1, 0.1), (0.5, 0.5), (0.9, 0.8)):
        expect(shot, place, (0.2, 0.5, 0.1))


def step_upright_scene():
    camera = harness.add_camera(type="ORTHO", ortho_scale=2.0)
    camera.data.sensor_fit = "VERTICAL"
    upper = [(-9, 0, 0), (9, 0, 0), (9, 9, 0), (-9, 9, 0)]
    left = [(-9, -9, 0), (0, -9, 0), (0, 0, 0), (-9, 0, 0)]
    face = [(0, 1, 2, 3)]
    red = harness.emission((0.8, 0.0, 0.0), name="Red")
    harness.add_object(harness.make_mesh("Upper", upper, face), red)
    harness.add_object(
        harness.make_mesh("Left", left, face), harness.emission((0.0, 0.0, 0.7), name="Blue")
    )
    area().spaces[0].region_3d.view_perspective = "CAMERA"


def step_upright():
    shot = screenshot()
    expect(shot, (0.5, 0.6), (0.8, 0.0, 0.0))
    expect(shot, (0.45, 0.4), (0.0, 0.0, 0.7))
    expect(shot, (0.55, 0.4), (0.2, 0.5, 0.1))


def step_edit_material():
    tree = bpy.data.materials["Red"].node_tree
    emitter = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
    emitter.inputs["Color"].default_value = (0.0, 0.9, 0.9, 1.0)


def step_material_edit_shows():
    expect(screenshot(), (0.5, 0.6), (0.0, 0.9, 0.9))


def step_move_object():
    bpy.data.objects["Upper"].location.y += 20.0


def step_move_shows():
    expect(screenshot(), (0.5, 0.6), (0.2, 0.5, 0.1))


def step_delete_and_undo():
    bpy.data.objects.remove(bpy.data.objects["Left"])


def step_delete_shows():
    expect(screenshot(), (0.45, 0.4), (0.2, 0.5, 0.1))


def step_border():
    space = area().spaces[0]
    space.region_3d.view_perspective = "PERSP"
    space.use_render_border = True
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.75
    space.render_border_min_y, space.render_border_max_y = 0.5, 0.9
    area().tag_redraw()


def step_border_shows_a_part():
    session = viewport().session
    assert session.wait(0.0), "still rendering"
    pixels = session.picture()[0]
    region = window_region()
    assert abs(pixels.shape[1] - 0.5 * region.width) <= 1, pixels.shape
    assert abs(pixels.shape[0] - 0.4 * region.height) <= 1, pixels.shape
    shot = screenshot()
    expect(shot, (0.3, 0.55), (0.2, 0.5, 0.1))
    outside = shot[int(0.2 * shot.shape[0]), int(0.1 * shot.shape[1])]
    assert np.abs(outside - encoded((0.2, 0.5, 0.1))).max() > 10, outside
    area().spaces[0].use_render_border = False


def step_settings_by_script():
    """Nothing but a setting changes, and nobody asks for a redraw."""
    bpy.context.scene.pharos.exposure = 0.5
    bpy.context.scene.pharos.preview_samples = 3


def step_settings_are_followed():
    assert viewport().session.progress().render.total_samples == 3
    expect(screenshot(), (0.9, 0.9), (0.1, 0.25, 0.05))
    bpy.context.scene.pharos.exposure = 1.0


def step_learn_lobes():
    scene = bpy.context.scene
    scene.pharos.guiding = "NEURAL"
    scene.pharos.preview_samples = 16
    plain = harness.material("Plain")
    diffuse = harness.node(plain, "ShaderNodeBsdfDiffuse")
    harness.connect(plain, diffuse.outputs[0], harness.surface(plain))
    harness.add_object(harness.plane_mesh("Floor", 4.0), plain)
    area().spaces[0].region_3d.view_rotation = (1.0, 0.0, 0.0, 0.0)
    area().spaces[0].region_3d.view_location = (0.0, 0.0, 0.0)


_asked: dict = {}  # the question, and what was shown before its answer


def step_ask_lobes():
    from pharos import lobes

    session = viewport().session
    assert session.wait(0.0) and session.progress().render.guiding.snapshots > 0
    region = window_region()
    _asked["question"] = lobes.ask(viewport(), 0.5 * region.width, 0.5 * region.height)
    assert _asked["question"] > 0
    _asked["before"] = screenshot()


def step_lobes_are_drawn():
    from pharos import lobes

    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=window_region()):
        assert lobes.show_answer(viewport(), bpy.context, _asked["question"])
    probe = lobes.overlay.probe
    assert probe.hit and probe.lobes, lobes.words(probe)
    changed = np.abs(screenshot() - _asked["before"]).max(-1) > 40
    assert changed.sum() > 30, f"{changed.sum()} pixels changed"


def step_lobes_go():
    from pharos import lobes

    lobes.overlay.hide()
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    bpy.context.scene.pharos.guiding = "OFF"


def step_navigate():
    data = area().spaces[0].region_3d
    data.view_perspective = "PERSP"
    for _ in range(5):
        data.view_rotation.rotate(__import__("mathutils").Euler((0.0, 0.1, 0.3)))
        data.view_distance *= 1.05
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)


def step_resize():
    space = area().spaces[0]
    for flag in (True, False, True, False):
        space.show_region_ui = space.show_region_toolbar = flag
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=2)


def step_after_resize():
    shot = screenshot()
    assert shot.shape[0] > 100 and shot.shape[1] > 100
    expect(shot, (0.02, 0.02), (0.2, 0.5, 0.1))


def step_split_area():
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=window_region()):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.4)


def views() -> list:
    window = bpy.context.window_manager.windows[0]
    return [a for a in window.screen.areas if a.type == "VIEW_3D"]


def step_several_views():
    assert len(views()) == 2
    for view in views():
        view.spaces[0].shading.type = "RENDERED"
    views()[0].spaces[0].region_3d.view_perspective = "ORTHO"
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)


def step_several_views_show_theirs():
    from pharos.viewport import viewport_of

    shown = [viewport_of(view) for view in views()]
    assert all(shown) and shown[0].session is not shown[1].session
    for view, own in zip(views(), shown):
        assert own.session.wait(0.0), "still rendering"
        pixels = own.session.picture()[0]
        region = next(r for r in view.regions if r.type == "WINDOW")
        assert pixels.shape[:2] == (region.height, region.width), pixels.shape
        assert np.abs(pixels[:, :, :3] - (0.2, 0.5, 0.1)).max() < 1e-3


def step_close_area():
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=views()[-1]):
        bpy.ops.screen.area_close()


def step_material_preview():
    window = bpy.context.window_manager.windows[0]
    red = bpy.data.materials["Red"]
    with bpy.context.temp_override(window=window, area=area(), id=red):
        assert bpy.ops.ed.lib_id_generate_preview() == {"FINISHED"}


def step_material_preview_shows():
    """Its emission is (0, 0.9, 0.9); the host's own icon would not know a frame of ours."""
    preview = bpy.data.materials["Red"].preview
    width, height = preview.image_size
    assert width > 0 and height > 0, (width, height)
    pixels = np.array(preview.image_pixels_float).reshape(height, width, 4)
    middle = pixels[height // 2, width // 2]
    assert middle[0] < 0.1 and middle[1] > 0.8 and middle[2] > 0.8, middle


def thread_count() -> int:
    return sum(1 for _ in Path("/proc/self/task").iterdir())


def step_toggle_shading():
    shade("SOLID")
    _asked["threads"] = thread_count()
    for _ in range(15):
        for kind in ("RENDERED", "SOLID"):
            shade(kind)
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)


def step_no_thread_is_left():
    assert thread_count() <= _asked["threads"], (thread_count(), _asked["threads"])
    shade("RENDERED")


def step_switch_engine():
    render = bpy.context.scene.render
    for engine in ("BLENDER_WORKBENCH", "PHAROS", "CYCLES", "PHAROS"):
        render.engine = engine
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=2)


def step_still_right():
    expect(screenshot(), (0.02, 0.02), (0.2, 0.5, 0.1))


def step_render_beside():
    harness.add_camera()
    bpy.context.scene.pharos.samples = 1 << 20
    bpy.context.preferences.view.render_display_type = "NONE"
    assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def step_cancel_render():
    """Esc as a user presses it."""
    assert bpy.app.is_job_running("RENDER"), "the render is not under way"
    os.system("xdotool key Escape")
    _escape["pressed"] = time.monotonic()


def step_render_has_stopped():
    _escape["looks"] += 1
    if _escape["looks"] % 15 == 0:
        os.system("xdotool key Escape")  # a busy X server may have lost the first
    assert not bpy.app.is_job_running("RENDER"), "Esc did not stop the render"
    harness.say(f"MEASURED Esc to end: under {time.monotonic() - _escape['pressed']:.2f} s")


def step_report_arrives():
    bpy.context.scene.camera.data.type = "PANO"
    bpy.data.objects["Camera"].data.update_tag()
    harness.add_object(harness.plane_mesh("Strange"), harness.material("Empty"))
    harness.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))


def step_report_is_there():
    assert any("Fog" in line for line in harness.report()), harness.report()


def step_load_file():
    path = harness.TEMPORARY / "viewport.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))


def step_after_load():
    assert bpy.context.scene.render.engine == "PHAROS"
    shade("RENDERED")


def step_new_file():
    bpy.ops.wm.read_homefile(use_factory_startup=False)


steps.main(globals())
