#!/usr/bin/env python3
"""What the add-on's export costs in each host: wall and CPU milliseconds of handing over a million
triangles and 90 000 instances, and the time from F12 to the first pixels and to the end of the
first whole pass. The bytes of a triangle are those of the test LargeScenes.BytesOfATriangle.

  /usr/bin/python3 tests/benchmark/export_bench.py            # Blender and bpy, as in tests/blender

Each figure is the least of several attempts: machines stall. CPU time is of all threads.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests" / "blender"
ATTEMPTS = 7


def _least(measure) -> tuple[float, float]:
    """Milliseconds of wall and CPU time."""
    walls, cpus = [], []
    for _ in range(ATTEMPTS):
        wall, cpu = time.perf_counter(), time.process_time()
        measure()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return 1e3 * min(walls), 1e3 * min(cpus)


def _grid(harness, side: int):
    """Two triangles a cell, smooth, with texture coordinates; quads, as artists have them."""
    import bpy
    import numpy as np

    rows, columns = np.mgrid[0 : side + 1, 0 : side + 1]
    height = 0.3 * np.sin(rows * 0.1) * np.cos(columns * 0.1)
    places = np.stack([columns, rows, height], axis=-1).reshape(-1, 3) / side
    first = (rows[:-1, :-1] * (side + 1) + columns[:-1, :-1]).ravel()
    quads = np.stack([first, first + 1, first + side + 2, first + side + 1], axis=-1)
    mesh = bpy.data.meshes.new("Grid")
    mesh.vertices.add(len(places))
    mesh.vertices.foreach_set("co", places.astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.astype(np.int32).ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    if harness.VERSION < (4, 0, 0):
        mesh.polygons.foreach_set("loop_total", np.full(len(quads), 4, np.int32))
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", places[quads.ravel(), :2].astype(np.float32).ravel())
    mesh.update(calc_edges=True)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(quads), np.bool_))
    mesh.update()
    return mesh


def _checkered(harness):
    """A material that reads texture coordinates."""
    owner = harness.material("Checkered")
    shader = harness.node(owner, "ShaderNodeBsdfDiffuse")
    checks = harness.node(owner, "ShaderNodeTexChecker")
    place = harness.node(owner, "ShaderNodeTexCoord")
    harness.connect(owner, place.outputs["UV"], checks.inputs[0])
    harness.connect(owner, checks.outputs[0], shader.inputs[0])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    return owner


def _export():
    import bpy
    import harness
    from pharos.export.report import Report
    from pharos.export.scene import export_scene

    return export_scene(harness.native(), bpy.context.evaluated_depsgraph_get(), Report())


def _million_triangles(harness) -> None:
    harness.new_scene(16, 16, 1)
    harness.add_camera()
    harness.add_object(_grid(harness, 707), _checkered(harness))
    _export()
    wall, cpu = _least(_export)
    harness.say(f"1 M triangles with UV: {wall:.0f} ms wall, {cpu:.0f} ms CPU")


def _instances(harness) -> None:
    import bpy

    harness.new_scene(16, 16, 1)
    harness.add_camera()
    child = harness.add_object(harness.cube_mesh(), harness.emission())
    parent = harness.add_object(_grid(harness, 299), name="Parent")
    parent.instance_type = "VERTS"
    child.parent = parent
    bpy.context.view_layer.update()
    _export()
    count = sum(1 for _ in bpy.context.evaluated_depsgraph_get().object_instances)
    wall, cpu = _least(_export)
    harness.say(f"{count} instances: {wall:.0f} ms wall, {cpu:.0f} ms CPU")


def _first_pixels(harness) -> None:
    import bpy

    harness.new_scene(960, 540, 1)
    harness.add_camera((0.5, 0.5, 2.0))
    harness.add_object(_grid(harness, 224), _checkered(harness))
    harness.set_world((1.0, 1.0, 1.0))
    wall, cpu = _least(lambda: bpy.ops.render.render())
    title = "F12 of 0.1 M triangles, one whole pass of 960 x 540"
    harness.say(f"{title}: {wall:.0f} ms wall, {cpu:.0f} ms CPU")
    first = min(_milliseconds_to_pixels() for _ in range(ATTEMPTS))
    harness.say(f"F12 of 0.1 M triangles, first pixels: {first:.0f} ms wall")


def _milliseconds_to_pixels() -> float:
    """From the call to the first time that Blender is given pixels."""
    import bpy
    from pharos.final import FinalRender

    shown: list[float] = []
    show = FinalRender._show_result

    def noted(self, session, result):
        show(self, session, result)
        shown.append(time.perf_counter())

    FinalRender._show_result = noted
    try:
        begin = time.perf_counter()
        bpy.ops.render.render()
    finally:
        FinalRender._show_result = show
    return 1e3 * (shown[0] - begin)


def measure() -> None:
    sys.path.insert(0, str(TESTS))
    import bpy
    import harness

    harness.enable_addon()
    harness.say(f"Blender {bpy.app.version_string}")
    _million_triangles(harness)
    _instances(harness)
    _first_pixels(harness)
    sys.stdout.flush()
    os._exit(0)


def main() -> int:
    env = dict(os.environ)
    env.setdefault("BLENDER_USER_SCRIPTS", str(ROOT / "build" / "blender"))
    env["PHAROS_EXPORT_BENCH"] = "1"
    python = ROOT / "build" / "bpy" / "bin" / "python"
    script = str(Path(__file__).resolve())
    blender = [env.get("BLENDER", "blender"), "-b", "--factory-startup", "-Y", "-P", script]
    for command in (blender, [str(python), script]):
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        words = ("Blender ", "1 M", "F12")
        for line in done.stdout.splitlines() + done.stderr.splitlines():
            if line.startswith(words) or " instances: " in line or "Error" in line:
                sys.stdout.write(line + "\n")
    return 0


if __name__ == "__main__":
    if os.environ.get("PHAROS_EXPORT_BENCH"):
        measure()
    sys.exit(main())
