"""Blender's threads keep their floating-point state: whatever mode a thread is in, a call of the
native module leaves it there, with an exception and after a cancel too. Every function and method
of the module is called.
"""
# hosts: blender bpy

from __future__ import annotations

import contextlib
import ctypes
import mmap

import bpy
import harness
import numpy as np

_ODD = 0x1F80 | 0x6000 | 0x8040  # rounds towards zero, flushes denormals, reads them as zero
_STICKY = 0x3F
_METHODS = ("builtin_function_or_method", "instancemethod", "method")


class FloatState:
    """This thread's MXCSR, by the bytes of code `stmxcsr [rdi]; ret` and `ldmxcsr [rdi]; ret`."""

    def __init__(self):
        access = mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC
        self._page = mmap.mmap(-1, mmap.PAGESIZE, prot=access)
        self._page.write(bytes((0x0F, 0xAE, 0x1F, 0xC3, 0x0F, 0xAE, 0x17, 0xC3)))
        address = ctypes.addressof(ctypes.c_char.from_buffer(self._page))
        kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
        self._store, self._load = kind(address), kind(address + 4)
        self._value = ctypes.c_uint32()

    def get(self) -> int:
        self._store(ctypes.addressof(self._value))
        return self._value.value & ~_STICKY

    def set(self, mode: int) -> None:
        self._value.value = mode
        self._load(ctypes.addressof(self._value))


class Watch:
    """Stands before every function and method of the module: they are called in the odd mode."""

    def __init__(self, module):
        self.state = FloatState()
        self.changed, self.called, self.all = [], set(), set()
        self._before = []
        for name, thing in vars(module).items():
            if type(thing).__name__ in _METHODS:
                self._stand_before(module, name, name)
            elif isinstance(thing, type) and name in (
                    "RenderSession", "LiveSession", "SceneDescription", "NodeProgram"):
                for method, value in list(vars(thing).items()):
                    if method == "__init__" or (
                            not method.startswith("_") and type(value).__name__ in _METHODS):
                        self._stand_before(thing, method, f"{name}.{method}")

    def _stand_before(self, owner, name: str, title: str) -> None:
        original = getattr(owner, name)
        self.all.add(title)
        self._before.append((owner, name, original))

        def watched(*arguments, **words):
            self.called.add(title)
            with self.odd(title):
                return original(*arguments, **words)

        setattr(owner, name, watched)

    def end(self) -> None:
        for owner, name, original in self._before:
            setattr(owner, name, original)

    @contextlib.contextmanager
    def odd(self, title: str):
        before = self.state.get()
        self.state.set(_ODD)
        try:
            yield
        finally:
            mode = self.state.get()
            self.state.set(before)
            if mode != _ODD:
                self.changed.append(f"{title}: {mode:x}")


def _raises(function, *arguments, **words) -> None:
    try:
        function(*arguments, **words)
    except Exception:
        return
    raise AssertionError("no exception")


def _room() -> None:
    scene = harness.new_scene(48, 32, 1)
    harness.add_camera(location=(0, -6, 1), rotation=(1.4, 0.0, 0.0))
    shader = harness.material("Textured")
    principled = harness.node(shader, "ShaderNodeBsdfPrincipled", Roughness=0.3)
    image = harness.node(shader, "ShaderNodeTexImage")
    image.image = bpy.data.images.new("Pixels", 4, 4)
    harness.connect(shader, image.outputs[0], principled.inputs["Base Color"])
    harness.connect(shader, principled.outputs[0], harness.surface(shader))
    harness.add_object(harness.cube_mesh(), shader)
    harness.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    harness.set_world((0.5, 0.6, 0.7))
    scene.pharos.guiding = "NEURAL"
    bpy.context.view_layer.pharos.use_pass_guide_share = True  # learns, small as it is


def _descriptions(module) -> None:
    own = module.SceneDescription(304)
    own.add_kept_mesh("Kept", 7)
    own.add_kept_image("Kept", 7)
    own.add_instance_attribute("Any", np.zeros((1, 4), np.float32))
    own.add_light_program(module.NodeProgram())
    own.set_passes(wanted=module.pass_bit(module.FilmPass.Depth))
    module.mean_emission(module.NodeProgram())
    module.random_of_name("Any")
    module.self_test()
    module.film_pass_channels(module.FilmPass.Combined)
    _raises(own.add_instance_attribute, "Any", np.zeros((1, 3), np.float32))
    _raises(own.set_film, no_such_field=1)
    _raises(own.add_image, "Broken", pixels=np.zeros(3, np.float32))
    _raises(module.gather_mesh, "Broken", no_such_field=1)
    _raises(module.read_dump, "/nowhere/at/all")
    _raises(module.write_dump, own, "/nowhere/at/all")
    path = harness.TEMPORARY / "state.exr"
    pixels = np.zeros((4, 4, 4), np.float32)
    module.write_exr(str(path), 4, 4, [("Combined", "RGBA", pixels)])
    _raises(module.write_exr, "/nowhere/at/all.exr", 4, 4, [("", "R", pixels[:1, :1].copy())])
    _raises(module.read_dump, str(path))


def _sessions(module, watch: Watch) -> None:
    description = harness.exported()
    description.mesh(0)
    description.set_settings(samples=1 << 20)
    for delay in (0.0, 0.01, 0.3):  # cancelled while it builds, and while it renders
        session = module.RenderSession(description.copy(), 2)
        session.wait(delay)
        for name in ("progress", "statistics", "report"):
            getattr(session, name)()
        session.cancel()
        assert session.wait(60.0)
        pixels = np.empty((session.width * session.height, 4), np.float32)
        session.read(module.FilmPass.Combined, pixels)
        _raises(session.read, module.FilmPass.Combined, pixels[:1].copy())
        assert not session.read_aov(99, pixels)
        assert session.effort() == []
        assert isinstance(session.field(), bytes)
        with watch.odd("the end of a session"):
            del session
    with watch.odd("the end of a session that renders"):
        module.RenderSession(description.copy(), 2)
    live = module.LiveSession(2)
    live.set_scene(description.copy())
    live.wait(0.2)
    live.wait_picture(0.1)
    live.set_view(description)
    live.ask_lobes(0.5, 0.5)
    for name in ("lobes", "picture", "progress", "statistics", "report", "forget_guide"):
        getattr(live, name)()
    live.set_paused(True)
    with watch.odd("the end of a live session"):
        del live


def test_every_call_leaves_the_floating_point_state_alone():
    _room()
    module = harness.native()
    watch = Watch(module)
    try:
        bpy.ops.render.render()
        _descriptions(module)
        _sessions(module, watch)
    finally:
        watch.end()
    missed = sorted(watch.all - watch.called)
    assert len(watch.all) > 40, watch.all
    assert not missed, missed
    harness.say(f"STRESS calls that change MXCSR of Blender's thread|{len(watch.all)}|"
                f"{len(watch.changed)}|0")
    assert not watch.changed, watch.changed


def test_a_change_is_seen():
    """The test above can fail."""
    state = FloatState()
    before = state.get()
    state.set(_ODD)
    seen, flushed = state.get(), np.float32(1e-40) * np.float32(1.0)
    state.set(before)
    assert seen == _ODD
    assert flushed == 0.0
    assert np.float32(1e-40) * np.float32(1.0) != 0.0


harness.main(globals())
