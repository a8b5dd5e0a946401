"""Shader nodes against Cycles of the same host: a ball under a lamp and a sky, block by block.

A fast look at every node and mode; the bound leaves room for noise and for what is approximated.
"""
# hosts: blender bpy

import math

import bpy
import harness
import numpy as np
from node_sheet import settings

_NEW = harness.VERSION >= (4, 0, 0)
_TINT = (0.8, 0.5, 0.3, 1.0)


def _ball():
    """A smooth sphere of quads with a UV map."""
    rings, segments = 16, 32
    vertices, faces = [], []
    for i in range(rings + 1):
        polar = math.pi * i / rings
        for k in range(segments):
            around = 2.0 * math.pi * k / segments
            x, y = math.sin(polar) * math.cos(around), math.sin(polar) * math.sin(around)
            vertices.append((x, y, math.cos(polar)))
    for i in range(rings):
        for k in range(segments):
            after = (k + 1) % segments
            row = i * segments
            faces.append((row + k, row + segments + k, row + segments + after, row + after))
    mesh = harness.make_mesh("Ball", vertices, faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    layer = mesh.uv_layers.new(name="UVMap")
    uv = [
        (k / segments + (corner in (2, 3)) / segments, (i + (corner in (1, 2))) / rings)
        for i in range(rings)
        for k in range(segments)
        for corner in range(4)
    ]
    layer.data.foreach_set("uv", np.array(uv, np.float32).ravel())
    return mesh


def _prepared(samples: int = 400):
    scene = harness.new_scene(16, 16, samples)
    settings(samples)
    scene.cycles.light_sampling_threshold = 0.0
    scene.pharos.follow_cycles = True
    scene.world.color = (0.3, 0.4, 0.5)
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 2.0, 0.3
    sun = harness.link(bpy.data.objects.new("Sun", light))
    sun.rotation_euler = (0.7, 0.4, 0.0)
    owner = harness.material()
    harness.add_object(_ball(), owner)
    harness.add_camera((0.0, 0.0, 6.0), type="ORTHO", ortho_scale=1.7)
    return owner


def _compare(name: str, tolerance: float = 0.03) -> None:
    pictures = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures.append(harness.render(engine)[..., :3])
    a, b = (p.reshape(4, 4, 4, 4, 3).mean(axis=(1, 3)) for p in pictures)
    error = np.abs(a - b).max() / a.mean()
    mean = abs(b.mean() / a.mean() - 1.0)
    harness.say(f"MEASURED {name}: blocks {error:.4f}, mean {mean:.4f}")
    assert a.mean() > 1e-3, "the picture is black"
    # Peaks are noisy and thin; the whole is not.
    assert mean < tolerance / 3.0, (name, mean, a[..., 0], b[..., 0])
    assert error < 3.0 * tolerance, (name, error, a[..., 0], b[..., 0])
    assert harness.report() == [], harness.report()


def _look(name: str, kind: str, fields=None, tolerance: float = 0.03, link=None, **inputs):
    owner = _prepared()
    shader = harness.node(owner, kind)
    for field, value in (fields or {}).items():
        setattr(shader, field, value)
    for socket, value in inputs.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    if link is not None:
        link(owner, shader)
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    _compare(name, tolerance)


def test_toon():
    for component in ("DIFFUSE", "GLOSSY"):
        for size, smooth in ((0.5, 0.0), (0.3, 0.4), (0.9, 0.5)):
            if smooth > 0.0 and not _NEW:
                continue  # 3.x takes the wrong angle for sampled directions
            fields = {"component": component}
            name = f"toon {component} {size} {smooth}"
            _look(name, "ShaderNodeBsdfToon", fields, Color=_TINT, Size=size, Smooth=smooth)


def test_velvet_and_sheen():
    if not _NEW:
        for sigma in (0.3, 0.8, 1.0):
            _look(f"velvet {sigma}", "ShaderNodeBsdfVelvet", Color=_TINT, Sigma=sigma)
        return
    for distribution in ("ASHIKHMIN", "MICROFIBER"):
        for roughness in (0.3, 0.8):
            fields = {"distribution": distribution}
            name = f"sheen {distribution} {roughness}"
            # The transformed cosine is a fit of our own.
            inputs = {"Color": _TINT, "Roughness": roughness}
            _look(name, "ShaderNodeBsdfSheen", fields, 0.06, **inputs)


def _tangent(direction: str, axis: str = "Z"):
    def link(owner, shader):
        node = harness.node(owner, "ShaderNodeTangent")
        node.direction_type, node.axis = direction, axis
        harness.connect(owner, node.outputs[0], shader.inputs["Tangent"])

    return link


def test_anisotropic():
    kind = "ShaderNodeBsdfGlossy" if _NEW else "ShaderNodeBsdfAnisotropic"
    links = {"default": None, "uv": _tangent("UV_MAP")}
    links |= {axis: _tangent("RADIAL", axis) for axis in "XYZ"}
    for title, link in links.items():
        for amount, rotation in ((0.7, 0.0), (-0.5, 0.2)):
            inputs = {"Color": _TINT, "Roughness": 0.4}
            inputs |= {"Anisotropy": amount, "Rotation": rotation}
            fields = {"distribution": "GGX"}
            _look(f"glossy {title} {amount}", kind, fields, 0.05, link, **inputs)


def test_metallic():
    if harness.VERSION < (4, 3, 0):
        raise harness.Skip("no Metallic BSDF in this version")
    kind = "ShaderNodeBsdfMetallic"
    for anisotropy in (0.0, 0.6):
        inputs = {"Base_Color": _TINT, "Edge_Tint": (0.9, 0.7, 0.6, 1.0), "Roughness": 0.4}
        inputs["Anisotropy"] = anisotropy
        _look(f"metallic F82 {anisotropy}", kind, {"fresnel_type": "F82"}, **inputs)
    fields = {"fresnel_type": "PHYSICAL_CONDUCTOR"}
    _look("metallic physical", kind, fields, Roughness=0.4)


harness.main(globals())
