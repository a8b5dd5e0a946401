"""Camera and film against Cycles of the same host: lens blur, clipping, exposure, alpha."""
# hosts: blender bpy

import bpy
import harness
import numpy as np


def _scene(samples: int, **camera):
    scene = harness.new_scene(24, 24, samples)
    made = harness.add_camera(location=(0.0, 0.0, 4.0), **camera)
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", samples, "BOX"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.film_exposure, cycles.seed = 1.0, 0
    scene.pharos.follow_cycles = True
    return scene, made


def _both() -> tuple[np.ndarray, np.ndarray]:
    pictures = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures.append(harness.render(engine))
    return pictures[0], pictures[1]


def _error(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference of blocks of 3 x 3 pixels, relative to the brightest block."""
    blocks = [a.reshape(8, 3, 8, 3, 4).mean(axis=(1, 3)) for a in (ours, theirs)]
    return np.abs(blocks[0] - blocks[1]).max() / blocks[1].max()


def _assert_alike(tolerance: float) -> np.ndarray:
    theirs, ours = _both()
    error = _error(ours, theirs)
    assert error < tolerance, error
    mean = np.abs(ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1)) - 1.0)
    assert np.nanmax(mean) < 0.02, mean
    return ours


def _blurred(blades: int, ratio: float, rotation: float, **camera) -> np.ndarray:
    scene, made = _scene(2048, **camera)
    dof = made.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 1.0, 0.1
    dof.aperture_blades, dof.aperture_ratio, dof.aperture_rotation = blades, ratio, rotation
    if made.data.type == "ORTHO":
        dof.aperture_fstop = 1.2
    harness.add_object(harness.plane_mesh(half=0.15), harness.emission((1.0, 0.6, 0.3), 2.0))
    picture = _assert_alike(0.04)
    scene.pharos.follow_cycles = False
    return picture


def test_round_aperture():
    _blurred(0, 1.0, 0.0)


def test_blades_ratio_and_rotation():
    turned = _blurred(3, 1.0, 0.4)
    other = _error(_blurred(3, 1.0, -0.4), turned)
    assert other > 0.07, other  # the measure sees the shape
    _blurred(5, 1.6, -0.7)


def test_orthographic_blur():
    _blurred(6, 1.0, 0.2, type="ORTHO", ortho_scale=3.0)


def test_clipping():
    """A slope that begins before the near plane and ends behind the far one."""
    for kind in ({}, {"type": "ORTHO", "ortho_scale": 4.0}):
        scene, _ = _scene(256, clip_start=3.0, clip_end=4.5, **kind)
        slope = harness.add_object(harness.plane_mesh(half=2.0), harness.emission())
        slope.rotation_euler = (1.0, 0.0, 0.0)
        harness.set_world((0.2, 0.3, 0.4))
        _assert_alike(0.06)
    scene.pharos.follow_cycles = False


def test_exposure_and_transparent_film():
    scene, _ = _scene(256)
    scene.cycles.film_exposure = 2.5
    scene.render.film_transparent = True
    harness.set_world((0.2, 0.3, 0.4))
    card = harness.add_object(harness.plane_mesh(half=0.8), harness.emission((0.2, 0.5, 0.1)))
    card.rotation_euler = (0.2, 0.3, 0.5)
    pane = harness.material("Pane")
    clear = harness.node(pane, "ShaderNodeBsdfTransparent", Color=(0.5, 0.5, 0.5, 1.0))
    harness.connect(pane, clear.outputs[0], harness.surface(pane))
    harness.add_object(harness.plane_mesh("Pane", half=0.7), pane, location=(0.5, 0.2, 1.0))
    try:
        _assert_alike(0.06)
    finally:
        scene.render.film_transparent, scene.cycles.film_exposure = False, 1.0
        scene.pharos.follow_cycles = False


harness.main(globals())
