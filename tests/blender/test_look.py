"""Against Cycles of the same host: lamps and worlds alone and together, over several bounces.

Means of whole pictures, which at these sample counts are certain to a few parts in a thousand.
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np

_ENERGY = {"SUN": 3.0, "POINT": 50.0, "AREA": 50.0, "SPOT": 100.0}
_TOLERANCE = 0.01


def _follow(bounces: int, samples: int = 256) -> None:
    scene = bpy.context.scene
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", samples, "BOX"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.film_exposure, cycles.seed = 1.0, 0
    # 3.4 picks lights at random below this threshold; that is noise, not look.
    cycles.light_sampling_threshold = 0.0
    for name in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{name}_bounces", bounces)
    scene.pharos.follow_cycles = True


def _yard(lights) -> None:
    """A block on a floor, lit as asked; 'WORLD' stands for a blue sky."""
    harness.new_scene(16, 16)
    harness.add_camera(location=(0, -2, 1.5), rotation=(1.0, 0, 0))
    owner = harness.material()
    diffuse = harness.node(owner, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1.0))
    harness.connect(owner, diffuse.outputs[0], harness.surface(owner))
    harness.add_object(harness.plane_mesh(half=3.0), owner)
    block = harness.add_object(harness.cube_mesh(), owner, location=(0.0, 1.0, 0.5))
    block.scale, block.rotation_euler = (0.3, 0.3, 0.5), (0.0, 0.0, 0.3)
    for kind in lights:
        if kind == "WORLD":
            harness.set_world((0.35, 0.55, 1.0))
            continue
        light = bpy.data.lights.new(kind, kind)
        light.energy = _ENERGY[kind]
        obj = harness.link(bpy.data.objects.new(kind, light))
        obj.location, obj.rotation_euler = (0.3, 0.0, 3.0), (0.1, 0.2, 0.0)


def _compare(lights, bounces: int) -> None:
    _yard(lights)
    _follow(bounces)
    pictures = {}
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures[engine] = harness.render(engine)[..., :3]
    means = [pictures[engine].mean(axis=(0, 1)) for engine in ("CYCLES", "PHAROS")]
    error = np.abs(means[1] / means[0] - 1.0).max()
    assert error < _TOLERANCE, (lights, bounces, means)


def test_each_light_alone():
    for kind in ("WORLD", "SUN", "POINT", "SPOT", "AREA"):
        _compare([kind], 0)


def test_world_and_lamp_together():
    for kind in ("SUN", "POINT", "AREA"):
        _compare(["WORLD", kind], 1)


def test_everything_with_bounces():
    _compare(["WORLD", "SUN", "POINT", "AREA"], 4)


harness.main(globals())
