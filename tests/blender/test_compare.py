"""Compare with Cycles in background mode: pictures, figures, files; failures and cancelling."""
# hosts: blender

from __future__ import annotations

import importlib
import os
import time

import bpy
import harness
import numpy as np

SECONDS = 0.6
FOLDER = harness.TEMPORARY / "compared"


def room():
    """A lit floor and a cube, in a frame of which a part is rendered."""
    scene = harness.new_scene(32, 24, 4)
    white = harness.material("White")
    diffuse = harness.node(white, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.6, 0.4, 1.0))
    harness.connect(white, diffuse.outputs[0], harness.surface(white))
    harness.add_object(harness.plane_mesh(half=4.0), white)
    harness.add_object(harness.cube_mesh(), white, location=(0.0, 0.0, 0.3))
    lamp = bpy.data.lights.new("Lamp", "AREA")
    lamp.energy, lamp.size = 200.0, 1.0
    harness.link(bpy.data.objects.new("Lamp", lamp)).location = (1.0, 0.5, 4.0)
    harness.add_camera((0.0, 0.0, 9.0))
    harness.set_world((0.05, 0.05, 0.05))
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.0, 0.5
    return scene


def compare(**words):
    return bpy.ops.pharos.compare("EXEC_DEFAULT", seconds=SECONDS, folder=str(FOLDER), **words)


def comparison_module():
    return importlib.import_module("pharos.compare.comparison")


def is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_both_pictures_come_back_with_figures():
    scene = room()
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = True
    scene.render.use_motion_blur = True
    before = scene.render.image_settings.file_format
    try:
        assert compare() == {"FINISHED"}
    finally:
        scene.render.use_motion_blur = False
    pharos = harness.read_exr(FOLDER / "pharos.exr")
    cycles = harness.read_exr(FOLDER / "cycles.exr")
    assert pharos.shape == cycles.shape == (12, 16, 4)
    ratio = pharos[..., :3].mean() / cycles[..., :3].mean()
    assert abs(ratio - 1.0) < 0.02, ratio
    image = bpy.data.images["Compare with Cycles"]
    assert tuple(image.size) == (2 * 16 + 4, 12)
    shown = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(shown)
    shown = shown.reshape(12, 36, 4)
    assert np.array_equal(shown[:, :16], pharos)
    assert np.array_equal(shown[:, 20:], cycles)
    assert (FOLDER / "compare.png").read_bytes().startswith(b"\x89PNG")
    words = (FOLDER / "compare.txt").read_text()
    assert words.rstrip("\n") == bpy.data.texts["Compare with Cycles"].as_string().rstrip("\n")
    assert words.startswith("Pharos: ")
    assert "\nCycles: " in words
    assert "times less error at equal time" in words
    assert "Cycles: use_adaptive_sampling was switched off." in words
    assert "Motion blur is not supported." in words
    assert scene.render.image_settings.file_format == before
    assert scene.cycles.use_adaptive_sampling
    assert scene.render.engine == "PHAROS"


def test_both_take_the_same_cpu_time():
    module = comparison_module()
    room()
    comparison = module.Comparison(bpy.context.scene, 1.5, bpy.app.binary_path)
    try:
        while not comparison.poll():
            time.sleep(0.1)
        ours, theirs = comparison.results
        assert all(path.exists() for result in (ours, theirs) for path in result.pictures)
        ratio = sum(theirs.seconds) / sum(ours.seconds)
        harness.say(f"MEASURED CPU seconds {ours.seconds} {theirs.seconds}, ratio {ratio:.3f}")
        assert 0.6 < ratio < 1.6, ratio
        assert 0.5 < sum(ours.seconds) / 3.0 < 2.0
    finally:
        comparison.close()
    assert not ours.pictures[0].exists()


def test_error_estimate_is_that_of_known_noise():
    verdict = importlib.import_module("pharos.compare.verdict")
    random = np.random.default_rng(3)
    truth = np.full((96, 96, 3), 0.7)
    pictures = [truth + 0.05 * random.standard_normal(truth.shape) for _ in range(4)]
    mean = sum(pictures) / 4
    expected = 0.05**2 / (0.7**2 + 0.01)
    assert abs(verdict.noise(*pictures[:2], mean) / expected - 1.0) < 0.03


def test_cancelling_ends_the_other_blender_and_leaves_nothing():
    module = comparison_module()
    room()
    comparison = module.Comparison(bpy.context.scene, 60.0, bpy.app.binary_path)
    pid, folder = comparison.pid, comparison._folder
    assert is_running(pid)
    assert folder.exists()
    assert not comparison.poll()
    comparison.close()
    assert not is_running(pid)
    assert not folder.exists()
    comparison.close()


def test_a_blender_that_fails_is_reported():
    room()
    camera = bpy.context.scene.camera
    bpy.context.scene.camera = None
    try:
        compare()
    except RuntimeError as error:
        assert "no camera" in str(error)
    else:
        raise AssertionError("an error was expected")
    bpy.context.scene.camera = camera
    module = comparison_module()
    comparison = module.Comparison(bpy.context.scene, 1.0, "/bin/false")
    try:
        while not comparison.poll():
            time.sleep(0.05)
    except module.ComparisonError as error:
        assert "PHAROS gave no picture (exit code 1)" in str(error)
    else:
        raise AssertionError("an error was expected")
    finally:
        comparison.close()


harness.main(globals())
