"""A ball under a sun and a sky in both engines: a fast look at a shader, block by block."""

from __future__ import annotations

import math

import bpy
import harness
import numpy as np
from node_sheet import settings


def ball_mesh():
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


def prepared(samples: int = 400):
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
    harness.add_object(ball_mesh(), owner)
    harness.add_camera((0.0, 0.0, 6.0), type="ORTHO", ortho_scale=1.7)
    return owner


def compare(name: str, tolerance: float = 0.03) -> None:
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


def look(name: str, kind: str, fields=None, tolerance: float = 0.03, link=None, **inputs):
    owner = prepared()
    shader = harness.node(owner, kind)
    for field, value in (fields or {}).items():
        setattr(shader, field, value)
    for socket, value in inputs.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    if link is not None:
        link(owner, shader)
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    harness.covers(kind)
    compare(name, tolerance)
