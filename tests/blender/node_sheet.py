"""Node outputs as pictures: a sheet of small quads, each with inputs of its own, in both engines.

A quad's corners carry equal texture coordinates, so that an output is the same over the whole quad
and each pixel shows it for exactly known inputs: (x, y, z, w), the same bits in both engines. A
sheet has 64 x 64 quads: 16 cases of 16 x 16.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy
import harness
import numpy as np

SIDE = 64
TILE = 16
STEP = 1.0 / 64.0
TILES = (SIDE // TILE) ** 2


class Case(NamedTuple):
    """`build(owner)` makes nodes and returns the output to look at."""

    name: str
    build: object
    inputs: str = "NEAR"


def _inputs(kind: str, seed: int) -> np.ndarray:
    """TILE * TILE rows of (x, y, z, w)."""
    random = np.random.default_rng(seed)
    count = TILE * TILE
    if kind == "FAR":
        values = random.uniform(-1.0, 1.0, (count, 4)) * 10.0 ** random.uniform(1, 4, (count, 1))
    elif kind == "UNIT":
        values = random.uniform(-0.25, 1.25, (count, 4))
    else:
        values = random.uniform(-4.0, 4.0, (count, 4))
    values[:4] = np.array([[0.0], [1.0], [-1.0], [0.5]])
    return ((np.round(values / STEP) + 0.5) * STEP).astype(np.float32)


def place(owner):
    """The inputs of a pixel: a vector output and a value output (w).

    They are rounded down to whole steps, because interpolation may change their last bit.
    """
    maps = []
    for name in ("xy", "zw"):
        uv = harness.node(owner, "ShaderNodeUVMap")
        uv.uv_map = name
        snap = harness.node(owner, "ShaderNodeVectorMath")
        snap.operation = "SNAP"
        snap.inputs[1].default_value = (STEP, STEP, STEP)
        split = harness.node(owner, "ShaderNodeSeparateXYZ")
        harness.connect(owner, uv.outputs[0], snap.inputs[0])
        harness.connect(owner, snap.outputs[0], split.inputs[0])
        maps.append(split)
    join = harness.node(owner, "ShaderNodeCombineXYZ")
    for i, source in enumerate((maps[0].outputs[0], maps[0].outputs[1], maps[1].outputs[0])):
        harness.connect(owner, source, join.inputs[i])
    return join.outputs[0], maps[1].outputs[1]


def _mesh(materials, values: np.ndarray):
    """`values`: (SIDE, SIDE, 4), by row and column."""
    rows, columns = np.mgrid[0:SIDE, 0:SIDE]
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    vertices = np.stack(
        [np.stack([columns + x, rows + y, 0 * rows], axis=-1) for x, y in corners], axis=2
    )
    faces = np.arange(SIDE * SIDE * 4).reshape(-1, 4)
    mesh = harness.make_mesh("Sheet", vertices.reshape(-1, 3).tolist(), faces.tolist())
    for first, name in ((0, "xy"), (2, "zw")):
        layer = mesh.uv_layers.new(name=name)
        flat = np.repeat(values[..., first : first + 2].reshape(-1, 2), 4, axis=0)
        layer.data.foreach_set("uv", flat.astype(np.float32).ravel())
    for owner in materials:
        mesh.materials.append(owner)
    slots = (rows // TILE) * (SIDE // TILE) + columns // TILE
    mesh.polygons.foreach_set("material_index", slots.ravel().astype(np.int32))
    mesh.update()
    return mesh


def _material(case: Case):
    owner = harness.material(case.name)
    emitter = harness.node(owner, "ShaderNodeEmission", Strength=1.0)
    output = case.build(owner)
    harness.covers(output.node.bl_idname)
    harness.connect(owner, output, emitter.inputs[0])
    harness.connect(owner, emitter.outputs[0], harness.surface(owner))
    return owner


def settings(samples: int = 1) -> None:
    """Cycles without anything that changes pictures beside the paths."""
    scene = bpy.context.scene
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", samples, "BOX"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.film_exposure, cycles.seed = 1.0, 0


def pictures_of(cases) -> dict[str, np.ndarray]:
    harness.new_scene(SIDE, SIDE, samples=1)
    settings()
    values = np.zeros((SIDE, SIDE, 4), np.float32)
    for i, case in enumerate(cases):
        row, column = divmod(i, SIDE // TILE)
        tile = _inputs(case.inputs, i).reshape(TILE, TILE, 4)
        values[row * TILE :, column * TILE :][:TILE, :TILE] = tile
    materials = [_material(case) for case in cases]
    harness.add_object(_mesh(materials, values))
    harness.add_camera((SIDE / 2, SIDE / 2, 10.0), type="ORTHO", ortho_scale=SIDE)
    pictures = {}
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures[engine] = harness.render(engine)[..., :3]
    return pictures


def differences(cases) -> dict[str, float]:
    """By case the largest difference, relative to values above one; infinite where one engine alone
    has no number.
    """
    found = {}
    for first in range(0, len(cases), TILES):
        part = cases[first : first + TILES]
        pictures = pictures_of(part)
        for i, case in enumerate(part):
            row, column = divmod(i, SIDE // TILE)
            a, b = (
                pictures[engine][row * TILE :, column * TILE :][:TILE, :TILE]
                for engine in ("CYCLES", "PHAROS")
            )
            with np.errstate(all="ignore"):
                error = np.abs(a - b) / np.maximum(np.abs(a), 1.0)
            error = np.where(np.isfinite(error), error, np.inf)
            found[case.name] = float(error.max())
    return found


def check(cases, tolerance: float = 1e-3) -> None:
    """Every case within the tolerance; the report names nothing."""
    found = differences(cases)
    harness.say(f"MEASURED {len(cases)} cases, largest difference {max(found.values()):.2e}")
    wrong = {name: error for name, error in found.items() if not error < tolerance}
    assert not wrong, wrong
