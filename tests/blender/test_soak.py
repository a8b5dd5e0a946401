"""Many renders in one process: memory stays flat, cancelling never hangs, threads keep their state.

PHAROS_SOAK=1 is the long form of tests/stress: 200 renders, 1 000 cancelled ones.
"""
# hosts: blender bpy

import ctypes
import mmap
import os
import random
import time
from pathlib import Path

import bpy
import harness
import numpy as np

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


class _FloatState:
    """Reads this thread's MXCSR: the few bytes of code `stmxcsr [rdi]; ret`."""

    def __init__(self):
        self._page = mmap.mmap(
            -1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC
        )
        self._page.write(bytes((0x0F, 0xAE, 0x1F, 0xC3)))
        address = ctypes.addressof(ctypes.c_char.from_buffer(self._page))
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address)

    def mode(self) -> int:
        value = ctypes.c_uint32()
        self._call(ctypes.addressof(value))
        return value.value & ~0x3F  # without the sticky flags


def _raises(function, *arguments) -> None:
    try:
        function(*arguments)
    except Exception:
        return
    raise AssertionError("no exception")


def test_floating_point_state_is_left_alone():
    _room(1 << 20)
    description = harness.exported()
    module, state = harness.native(), _FloatState()
    before = state.mode()
    changed = []

    def look(what: str) -> None:
        if state.mode() != before:
            changed.append(what)

    session = module.RenderSession(description.copy(), 2)
    look("RenderSession")
    session.wait(0.2)
    calls = ("progress", "statistics", "report", "cancel")
    for name in calls:
        getattr(session, name)()
        look(name)
    session.wait(60.0)
    look("wait")
    pixels = np.empty((session.width * session.height, 4), np.float32)
    session.read(module.FilmPass.Combined, pixels)
    look("read")
    _raises(session.read, module.FilmPass.Combined, pixels[:1].copy())
    look("an exception of read")
    path = harness.TEMPORARY / "state.exr"
    module.write_exr(str(path), session.width, session.height, [("Combined", "RGBA", pixels)])
    look("write_exr")
    _raises(module.write_exr, "/nowhere/at/all.exr", 1, 1, [("", "R", pixels[:1, :1].copy())])
    look("an exception of write_exr")
    _raises(module.read_dump, str(path))
    look("an exception of read_dump")
    del session
    look("the end of a session")
    bpy.context.scene.pharos.samples = 1
    bpy.ops.render.render()
    look("a render")
    _say("calls that change MXCSR of Blender's thread", len(calls) + 9, len(changed), 0)
    assert not changed, changed


harness.main(globals())
