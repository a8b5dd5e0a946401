"""Many renders in one process: memory stays flat, cancelling never hangs.

PHAROS_SOAK=1 is the long form of tests/stress: 200 renders, 1 000 cancelled ones.
"""
# hosts: blender bpy

import mmap
import os
import random
import time
from pathlib import Path

import bpy
import harness

_LONG = os.environ.get("PHAROS_SOAK") == "1"
_RENDERS, _CANCELS = (200, 1000) if _LONG else (30, 60)


def _say(what: str, cases: int, worst: float, bar: float) -> None:
    harness.say(f"STRESS {what}|{cases}|{worst:.3g}|{bar:.3g}")


def _room(samples: int = 2):
    scene = harness.new_scene(64, 48, samples)
    harness.add_camera(location=(0, -6, 1), rotation=(1.4, 0.0, 0.0))
    shader = harness.material("Shiny")
    principled = harness.node(shader, "ShaderNodeBsdfPrincipled", Roughness=0.3)
    harness.connect(shader, principled.outputs[0], harness.surface(shader))
    obj = harness.add_object(harness.cube_mesh(), shader)
    obj.modifiers.new("Subdivision", "SUBSURF").render_levels = 5
    harness.set_world((0.5, 0.6, 0.7))
    scene.pharos.guiding = "NEURAL"
    bpy.context.view_layer.pharos.use_pass_guide_share = True  # learns, small as it is
    return scene


def _resident() -> float:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE


def test_memory_stays_flat():
    _room()
    for _ in range(_RENDERS // 4):
        bpy.ops.render.render()
    before = _resident()
    for _ in range(_RENDERS - _RENDERS // 4):
        bpy.ops.render.render()
    growth = 100.0 * (_resident() / before - 1.0)
    _say("renders in one Blender: growth of memory, %", _RENDERS, growth, 2.0)
    assert growth < (2.0 if _LONG else 5.0), growth


def test_start_and_cancel():
    _room(1 << 20)
    description = harness.exported()
    module = harness.native()
    rng = random.Random(7)
    worst = 0.0
    for _ in range(_CANCELS):
        session = module.RenderSession(description.copy(), 2)
        session.wait(rng.choice((0.0, 0.002, 0.02)))
        began = time.monotonic()
        session.cancel()
        assert session.wait(60.0), "deadlock"
        worst = max(worst, time.monotonic() - began)
        del session
    _say("start and cancel: worst seconds to the end", _CANCELS, worst, 1.0)


harness.main(globals())
