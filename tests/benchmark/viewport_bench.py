"""Times of the rendered viewport, printed: inside Blender with a window (tests/benchmark/viewport).

Steps run from a timer, so that Blender draws between them. Times are wall times, from the moment a
script changes something to the moment the new picture lies in a texture, Blender's own part
included. "On the screen" is when Blender has drawn its whole window with it: with software OpenGL
that takes long whatever the engine does, which an engine that draws nothing shows beside it.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
import time
import traceback
from pathlib import Path

import bpy
import numpy as np
from pharos import viewport as viewport_module

ROOT = Path(__file__).resolve().parents[2]
_PATIENCE = 60.0


class Clock:
    """When pictures reached a texture, and when edits reached the viewport."""

    def __init__(self):
        self.drawn = 0.0
        self.changed = 0.0
        self.pictures = 0
        update, changed = (
            viewport_module.Viewport._update_texture,
            viewport_module.Viewport.scene_changed,
        )

        def timed_update(viewport):
            before = viewport._texture
            update(viewport)
            if viewport._texture is not before:
                self.drawn = time.perf_counter()
                self.pictures = viewport.session.progress().pictures

        def timed_change(viewport, *arguments):
            self.changed = time.perf_counter()
            changed(viewport, *arguments)

        viewport_module.Viewport._update_texture = timed_update
        viewport_module.Viewport.scene_changed = timed_change


clock = Clock()


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def area():
    screen = bpy.context.window_manager.windows[0].screen
    return next(a for a in screen.areas if a.type == "VIEW_3D")


def shade(kind: str) -> None:
    area().spaces[0].shading.type = kind


def shown():
    return viewport_module.viewport_of(area())


def until(condition):
    """Waits, letting Blender run; raises where nothing comes."""
    began = time.perf_counter()
    while not condition():
        if time.perf_counter() - began > _PATIENCE:
            raise TimeoutError("the viewport did not answer")
        yield 0.002


class EmptyEngine(bpy.types.RenderEngine):
    """Draws nothing: what is left is the host's own time."""

    bl_idname, bl_label = "PHAROS_EMPTY", "Empty"
    bl_use_eevee_viewport = True
    drawn = 0.0

    def view_update(self, context, depsgraph):
        """Nothing."""

    def view_draw(self, context, depsgraph):
        EmptyEngine.drawn = time.perf_counter()


def first_pixels(name: str):
    began = time.perf_counter()
    shade("RENDERED")
    yield from until(lambda: clock.drawn > began)
    # Steps come between redraws: this one has been swapped to the window.
    shown_after = 1e3 * (time.perf_counter() - began)
    say(
        f"{name}: first pixels after {1e3 * (clock.drawn - began):.0f} ms, "
        f"on the screen after {shown_after:.0f} ms"
    )


def empty_engine(name: str):
    """The same switch with an engine that does nothing."""
    bpy.context.scene.render.engine = "PHAROS_EMPTY"
    yield 0.5
    began = time.perf_counter()
    shade("RENDERED")
    yield from until(lambda: EmptyEngine.drawn > began)
    say(
        f"{name}, an engine that draws nothing: drawn after "
        f"{1e3 * (EmptyEngine.drawn - began):.0f} ms, on the screen after "
        f"{1e3 * (time.perf_counter() - began):.0f} ms"
    )
    shade("SOLID")
    bpy.context.scene.render.engine = "PHAROS"
    yield 0.5


def after_edit(name: str, edit):
    """The best and the median of nine: the machine may stall."""
    times = []
    for i in range(9):
        yield 0.5
        before = clock.pictures
        began = time.perf_counter()
        edit(i)
        yield from until(lambda before=before: clock.pictures > before)
        times.append(1e3 * (clock.drawn - began))
    say(f"{name}: new picture after {min(times):.0f} ms (median {np.median(times):.0f})")


def prepare(path: str = ""):
    if path:
        bpy.ops.wm.open_mainfile(filepath=path)
    else:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.5
    bpy.context.scene.render.engine = "PHAROS"
    yield 0.5


def scenes():
    yield "default scene", ""
    bathroom = Path(os.environ.get("PHAROS_SCENES", "")) / "contemporary_bathroom.blend"
    if bathroom.is_file():
        yield "contemporary_bathroom", str(bathroom)


def bench_start():
    for name, path in scenes():
        yield from prepare(path)
        yield from first_pixels(name)
        shade("SOLID")
        yield 0.3
        yield from first_pixels(f"{name}, again")
        shade("SOLID")
        yield 0.3
        yield from empty_engine(name)


def bench_edits():
    for name, path in scenes():
        yield from prepare(path)
        yield from first_pixels(name)
        meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
        lamps = [o for o in bpy.context.scene.objects if o.type == "LIGHT"]
        obj = meshes[0]
        material = next(
            (s.material for o in meshes for s in o.material_slots if s.material is not None), None
        )
        node = next(n for n in material.node_tree.nodes if n.type.startswith("BSDF"))

        def move(i, obj=obj):
            obj.location.x += 0.01

        def paint(i, node=node):
            node.inputs[0].default_value = (0.1 + 0.1 * i, 0.5, 0.5, 1.0)

        def turn(i):
            area().spaces[0].region_3d.view_rotation.rotate(
                __import__("mathutils").Euler((0.0, 0.0, 0.1))
            )

        yield from after_edit(f"{name}, object moved", move)
        yield from after_edit(f"{name}, colour", paint)
        if lamps:

            def dim(i, lamp=lamps[0]):
                lamp.data.energy *= 0.9

            yield from after_edit(f"{name}, lamp", dim)
        yield from after_edit(f"{name}, view turned", turn)


def large_scene():
    """Five million triangles, most of them in one object, and a small one that moves."""
    yield from prepare()
    n = 1582
    x, y = np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32))
    z = np.sin(0.05 * x) * np.cos(0.07 * y)
    points = np.stack([0.01 * (x - n / 2), 0.01 * (y - n / 2), 0.2 * z - 1.5], -1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    quads = (corner + np.array([0, 1, n + 1, n])).astype(np.int32)
    mesh = bpy.data.meshes.new("Large")
    mesh.vertices.add(n * n)
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(quads), 4, np.int32))
    mesh.update(calc_edges=True)
    obj = bpy.data.objects.new("Large", mesh)
    bpy.context.scene.collection.objects.link(obj)
    yield 1.0
    yield from first_pixels("5 M triangles")


class Watcher(threading.Thread):
    """When the first sample after an edit is there, looked at every half millisecond."""

    def __init__(self, session):
        super().__init__(daemon=True)
        self._session = session
        self._pictures = session.progress().pictures
        self.seen = 0.0
        self.start()

    def run(self):
        base = None
        while not self.seen:
            progress = self._session.progress()
            if progress.pictures > self._pictures:
                base = progress.render.serial if base is None else base
                if progress.render.serial > base:
                    self.seen = time.perf_counter()
            time.sleep(0.0005)


def bench_large():
    yield from large_scene()
    for target in ("Cube", "Large"):
        times = []
        for _ in range(9):
            yield 1.0
            watcher = Watcher(shown().session)
            bpy.data.objects[target].location.x += 0.05
            yield from until(lambda watcher=watcher: watcher.seen > 0.0)
            times.append(1e3 * (watcher.seen - clock.changed))
        say(
            f"5 M triangles, {target} moved: first sample {min(times):.0f} ms after view_update "
            f"(median {np.median(times):.0f})"
        )


def heartbeat(seconds: float):
    """Returns the 95th percentile and the longest of a timer's gaps, in milliseconds."""
    gaps = []
    end = time.perf_counter() + seconds
    last = time.perf_counter()
    while last < end:
        yield 0.005
        now = time.perf_counter()
        gaps.append(1e3 * (now - last))
        last = now
    return np.percentile(gaps, 95), max(gaps)


def redraw_times(tag):
    """The longest gap in a timer around each of three redraws, in milliseconds."""
    gaps = []
    for _ in range(3):
        tag()
        _, longest = yield from heartbeat(2.0)
        gaps.append(longest)
    return min(gaps)


def bench_pulse():
    """Idle is the same view with a picture that has ended: solid shading would draw the triangles,
    which software OpenGL takes seconds for.
    """
    yield from large_scene()
    own = bpy.context.scene.pharos
    own.follow_cycles, own.preview_samples = False, 1
    yield 2.0
    yield from until(lambda: shown().session.wait(0.0))
    yield 1.0
    idle, idle_worst = yield from heartbeat(5.0)
    whole = yield from redraw_times(area().tag_redraw)
    samples = yield from redraw_times(shown().redraw)
    own.preview_samples = 100000
    yield 2.0
    yield from until(lambda: shown().session.progress().has_picture)
    yield 1.0
    busy, busy_worst = yield from heartbeat(10.0)
    say(
        f"5 M triangles: heartbeat p95 {busy:.1f} ms, idle {idle:.1f} ms: {busy - idle:.1f} over "
        f"(longest {busy_worst:.0f} and {idle_worst:.0f} ms); the host draws the window in "
        f"{whole:.0f} ms, with more samples of one picture in {samples:.0f} ms"
    )


def resident_megabytes() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def thread_count() -> int:
    return sum(1 for _ in Path("/proc/self/task").iterdir())


def start_and_stop():
    began = time.perf_counter()
    shade("RENDERED")
    yield from until(lambda: clock.drawn > began)
    shade("SOLID")
    yield 0.02


def final_render():
    """F12: on a job's thread, with the window alive."""
    ended = []
    handler = bpy.app.handlers.render_complete
    handler.append(lambda *_: ended.append(True))
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield from until(lambda: ended and not bpy.app.is_job_running("RENDER"))
    handler.pop()
    yield 0.02


def bench_restarts():
    """Viewports started and stopped, with a final render after every third."""
    count = int(os.environ.get("PHAROS_RESTARTS", "300"))
    warm = max(count // 4, 21)
    yield from prepare()
    bpy.context.preferences.view.render_display_type = "NONE"
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.pharos.samples = 4
    renders = 0
    for i in range(count + warm):
        if i == warm:
            gc.collect()
            memory, threads, renders = resident_megabytes(), thread_count(), 0
        yield from start_and_stop()
        if i % 3 == 2:
            yield from final_render()
            renders += 1
    gc.collect()
    grown = resident_megabytes() - memory
    say(
        f"{count} starts and stops and {renders} final renders: memory {memory:.0f} MB, grown by "
        f"{grown:.1f} MB ({100 * grown / memory:.2f} %), threads {threads} -> {thread_count()}"
    )


BENCHES = {
    name.removeprefix("bench_"): function
    for name, function in list(globals().items())
    if name.startswith("bench_")
}


def everything():
    chosen = sys.argv[sys.argv.index("--") + 1 :] or list(BENCHES)
    for name in chosen:
        yield from BENCHES[name]()


_steps = everything()


def step() -> float:
    try:
        return next(_steps)
    except StopIteration:
        code = 0
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


bpy.context.preferences.view.show_splash = False
bpy.utils.register_class(EmptyEngine)
bpy.app.timers.register(step, first_interval=1.0, persistent=True)
