"""Scenes of sizes nobody builds on purpose, through Blender: few of each usually, all of them with
PHAROS_LONG_TESTS=1 (tests/stress). Every one of them becomes a picture.
"""
# hosts: blender bpy

import os
import random
import shutil
import time

import bpy
import harness
import numpy as np

_LONG = os.environ.get("PHAROS_LONG_TESTS") == "1"
_BAR = 120.0  # seconds


def _count(usual: int, long_form: int) -> int:
    return long_form if _LONG else usual


def _renders(what: str, count: int) -> np.ndarray:
    began, worked = time.monotonic(), time.process_time()
    pixels = harness.render("sizes")
    # What other programs took does not count.
    seconds = min(time.monotonic() - began, time.process_time() - worked)
    harness.say(f"STRESS in Blender, {what}: seconds to a picture|{count}|{seconds:.3g}|{_BAR:g}")
    assert np.isfinite(pixels).all()
    assert pixels[..., :3].any()
    return pixels


def _floor(width: int = 16, height: int = 12) -> None:
    harness.new_scene(width, height, 1)
    harness.add_camera(location=(0.0, 0.0, 30.0))
    harness.set_world((0.5, 0.6, 0.7))
    harness.add_object(harness.plane_mesh(half=10.0))


def _scattered(count: int, child) -> None:
    """Instances of an object at so many places."""
    places = np.random.default_rng(1).uniform(-9.0, 9.0, (count, 3)).astype(np.float32)
    mesh = bpy.data.meshes.new("Places")
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    parent = harness.link(bpy.data.objects.new("Places", mesh))
    parent.instance_type = "VERTS"
    child.parent = parent


def test_instances():
    _floor()
    count = _count(2000, 100_000)
    _scattered(count, harness.add_object(harness.cube_mesh()))
    assert len(harness.exported().instances) >= count
    _renders("instances", count)


def test_lamps():
    _floor()
    count = _count(1000, 1_000_000)
    light = bpy.data.lights.new("Tiny", "POINT")
    light.energy, light.shadow_soft_size = 1e-3, 1e-4
    _scattered(count, harness.link(bpy.data.objects.new("Tiny", light)))
    _renders("lamps", count)


def test_materials():
    _floor()
    count = _count(100, 10_000)
    mesh, place = harness.cube_mesh(), random.Random(2)
    mesh.materials.append(None)
    for i in range(count):
        material = bpy.data.materials.new(f"Material{i}")
        material.use_nodes = True
        material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = (
            place.random())
        obj = harness.link(bpy.data.objects.new(f"Cube{i}", mesh))
        obj.location = (place.uniform(-9, 9), place.uniform(-9, 9), place.uniform(0, 5))
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = material
    assert len(harness.exported().materials) >= count
    _renders("materials", count)


def test_image_files():
    _floor()
    count = _count(20, 1000)
    first = bpy.data.images.new("First", 64, 64)
    first.filepath_raw, first.file_format = str(harness.TEMPORARY / "image0.png"), "PNG"
    first.save()
    mesh = harness.plane_mesh(half=0.2)
    mesh.materials.append(None)
    for i in range(count):
        path = harness.TEMPORARY / f"image{i}.png"
        if i > 0:
            shutil.copy(harness.TEMPORARY / "image0.png", path)
        material = harness.material(f"Image{i}")
        texture = harness.node(material, "ShaderNodeTexImage")
        texture.image = bpy.data.images.load(str(path))
        emission = harness.node(material, "ShaderNodeEmission")
        harness.connect(material, texture.outputs[0], emission.inputs["Color"])
        harness.connect(material, emission.outputs[0], harness.surface(material))
        obj = harness.link(bpy.data.objects.new(f"Card{i}", mesh))
        obj.location = (i % 40 - 20.0, i // 40 - 12.0, 1.0)
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = material
    assert len(harness.exported().images) >= count
    _renders("image files", count)


def test_sixteen_thousand_pixels_wide():
    _floor(16384, _count(4, 64))
    assert _renders("pixels wide", 16384).shape[1] == 16384


def test_borders_of_a_pixel():
    _floor(64, 48)
    scene, place = bpy.context.scene, random.Random(3)
    scene.render.use_border = scene.render.use_crop_to_border = True
    count = _count(5, 100)
    for _ in range(count):
        x, y = place.randrange(64), place.randrange(48)
        scene.render.border_min_x, scene.render.border_max_x = x / 64, (x + 1) / 64
        scene.render.border_min_y, scene.render.border_max_y = y / 48, (y + 1) / 48
        scene.pharos.guiding = place.choice(("OFF", "NEURAL", "SLIDES"))
        pixels = harness.render("border")
        assert np.isfinite(pixels).all()
        assert pixels.shape[0] * pixels.shape[1] <= 4, pixels.shape
    scene.render.use_border = scene.render.use_crop_to_border = False
    harness.say(f"STRESS in Blender, borders of a pixel: no picture|{count}|0|0")


harness.main(globals())
