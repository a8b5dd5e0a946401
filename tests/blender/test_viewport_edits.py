"""Edit fuzzing: after each of many random edits the viewport shows what a fresh start would show.

Bit by bit, with the guide off; with it, whose learning depends on when an edit came, by statistics.
PHAROS_FUZZ_EDITS and PHAROS_FUZZ_SEED (tests/fuzz_edits sets them) ask for more edits than the few
of a usual run, with and without the guide; seeds that once failed are run as well.
"""
# hosts: window

from __future__ import annotations

import os
import random as random_module
import sys
import time
import traceback

import bpy
import edits
import harness
import numpy as np

EDITS = int(os.environ.get("PHAROS_FUZZ_EDITS", "30"))
GUIDED_EDITS = int(os.environ.get("PHAROS_FUZZ_EDITS", "10"))
SEED = int(os.environ.get("PHAROS_FUZZ_SEED", "1"))
# (seed, edits): sequences that once showed a stale picture.
REGRESSIONS: tuple[tuple[int, int], ...] = ()

_TICK = 0.02
_UNDO_SHARE = 0.25
_PATIENCE = 20.0  # seconds for one picture
_GUIDED_SAMPLES = 16
_BLOCK = 8  # pixels a side
# Of 8 x 8 pixels whose means differ by more than so many standard errors, this share is chance:
# few of their differences are normal.
_MOST_ERRORS = 5.0
_MOST_BLOCKS = 0.02


def window():
    return bpy.context.window_manager.windows[0]


def area():
    return next(a for a in window().screen.areas if a.type == "VIEW_3D")


def context():
    region = next(r for r in area().regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window(), area=area(), region=region)


# Edits that need a window.


def edit_navigate(random):
    data = area().spaces[0].region_3d
    data.view_perspective = random.choice(("PERSP", "ORTHO"))
    data.view_rotation.rotate(edits.Euler((0.0, 0.2, random.uniform(-1.0, 1.0))))
    data.view_distance = random.uniform(5.0, 12.0)


def edit_camera_view(random):
    if bpy.context.scene.camera is None:
        return False
    area().spaces[0].region_3d.view_perspective = "CAMERA"
    bpy.context.scene.camera.data.lens = random.uniform(25.0, 60.0)


def edit_border(random):
    set_border(area().spaces[0], random.uniform(0.2, 0.4), random.uniform(0.2, 0.4))


def edit_shading(random):
    area().spaces[0].shading.type = "SOLID"
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    area().spaces[0].shading.type = "RENDERED"


def edit_engine(random):
    render = bpy.context.scene.render
    render.engine = random.choice(("BLENDER_WORKBENCH", "CYCLES"))
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    render.engine = "PHAROS"


def set_border(space, x: float, y: float) -> None:
    """A small part of the region, so that pictures are quick; also of the camera's frame."""
    render = bpy.context.scene.render
    space.use_render_border = render.use_border = True
    for owner, prefix in ((space, "render_border"), (render, "border")):
        setattr(owner, f"{prefix}_min_x", x)
        setattr(owner, f"{prefix}_max_x", x + 0.25)
        setattr(owner, f"{prefix}_min_y", y)
        setattr(owner, f"{prefix}_max_y", y + 0.25)


def all_edits() -> list:
    found = {**vars(edits), **globals()}
    return [found[name] for name in sorted(found) if name.startswith("edit_")]


class History:
    """Undo steps of one sequence: what came before it is not undone."""

    def __init__(self):
        self._past = self._future = 0

    def push(self, name: str) -> None:
        with context():
            bpy.ops.ed.undo_push(message=name)
        self._past, self._future = self._past + 1, 0

    def undo(self) -> bool:
        if not self._past:
            return False
        with context():
            bpy.ops.ed.undo()
        self._past, self._future = self._past - 1, self._future + 1
        return True

    def redo(self) -> bool:
        if not self._future:
            return False
        with context():
            bpy.ops.ed.redo()
        self._past, self._future = self._past + 1, self._future - 1
        return True


# Pictures.


def shown_viewport():
    from pharos.viewport import viewport_of

    return viewport_of(area())


def shown_picture():
    """The finished picture of the viewport; None while there is none."""
    viewport = shown_viewport()
    if viewport is None or not viewport.session.wait(0.0):
        return None
    progress = viewport.session.progress()
    if progress.render.state != harness.native().SessionState.Finished:
        return None
    return viewport.session.picture()[0]


def fresh_picture(other_seed: int = 0) -> np.ndarray:
    """What a session shows that knows nothing of any edit; with another seed, other noise."""
    from pharos.export.library import Library
    from pharos.export.report import Report
    from pharos.export.scene import export_scene, set_view
    from pharos.export.settings import viewport_samples
    from pharos.view_state import ViewState

    native = harness.native()
    with context():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        scene = depsgraph.scene_eval
        description = export_scene(native, depsgraph, Report(), library=Library())
        set_view(native, description, scene, ViewState(native, bpy.context).view())
        description.set_settings(samples=viewport_samples(scene), time_limit=0.0)
        if other_seed:
            description.set_settings(seed=scene.pharos.seed + other_seed)
    session = native.LiveSession(2)
    session.set_scene(description)
    assert session.wait(_PATIENCE), "a fresh start did not end"
    found = session.picture()
    assert found is not None, session.progress().render.error
    return found[0]


def blocks_apart(shown: np.ndarray, fresh: np.ndarray) -> float:
    """The share of blocks of two pictures with independent noise whose means are not the same."""
    rows, columns = (size // _BLOCK * _BLOCK for size in shown.shape[:2])
    apart = (shown - fresh)[:rows, :columns, :3].astype(np.float64).mean(-1)
    blocks = apart.reshape(rows // _BLOCK, _BLOCK, columns // _BLOCK, _BLOCK).swapaxes(1, 2)
    blocks = blocks.reshape(-1, _BLOCK * _BLOCK)
    error = blocks.std(-1) / _BLOCK + 1e-4
    return float(np.mean(np.abs(blocks.mean(-1)) > _MOST_ERRORS * error))


class Fuzz:
    """A sequence of edits of one seed; step() is called from a timer until it returns None."""

    def __init__(self, seed: int, count: int, guided: bool = False):
        self.name = f"guided_edits_seed_{seed}" if guided else f"edits_seed_{seed}"
        self._guided = guided
        self._random = random_module.Random(seed)
        self._count = count
        self._done: list[str] = []
        self._began = 0.0
        self._tries = 0
        self._history = History()
        self._steps = self._run()

    def step(self) -> float | None:
        return next(self._steps, None)

    def _run(self):
        yield from self._prepare()
        for _ in range(self._count):
            self._edit()
            yield _TICK
            yield from self._compare()
        harness.say(f"PASS {self.name} ({self._count} edits)")

    def _prepare(self):
        """Blender draws between the steps, and the first push needs a picture of the start."""
        space = area().spaces[0]
        space.shading.type = "SOLID"
        yield _TICK
        edits.object_mode()
        bpy.context.view_layer.material_override = None
        own = edits.build_scene(self._random).pharos
        if self._guided:
            own.guiding, own.preview_samples = "NEURAL", _GUIDED_SAMPLES
        space.overlay.show_overlays = space.show_gizmo = False
        space.region_3d.view_perspective = "PERSP"
        set_border(space, 0.3, 0.3)
        space.shading.type = "RENDERED"
        bpy.ops.ed.undo_push(message="start")
        yield 0.2
        yield from self._compare()

    def _edit(self) -> None:
        random = self._random
        if random.random() < _UNDO_SHARE:
            names = [random.choice(("undo", "redo")) for _ in range(random.randrange(1, 4))]
            done = [name for name in names if getattr(self._history, name)()]
            if done:
                self._done.append("+".join(done))
                return
        while True:
            edit = random.choice(all_edits())
            with context():
                applied = edit(random) is not False
            if applied:
                break
        self._done.append(edit.__name__)
        self._history.push(edit.__name__)

    def _compare(self):
        began = time.monotonic()
        differing = 0
        while True:
            shown = shown_picture()
            if shown is not None:
                fresh = fresh_picture(differing + 1000 if self._guided else 0)
                if shown.shape == fresh.shape and self._alike(shown, fresh):
                    assert np.isfinite(shown).all()
                    return
                # An edit may not have reached the viewport yet; a stale picture stays one.
                differing += 1
            if differing > 4 or time.monotonic() - began > _PATIENCE:
                raise AssertionError(self._complaint(shown))
            yield 0.1 if differing else _TICK

    def _alike(self, shown, fresh) -> bool:
        if self._guided:
            return blocks_apart(shown, fresh) <= _MOST_BLOCKS
        return np.array_equal(shown, fresh)

    def _complaint(self, shown) -> str:
        last = " ".join(name.removeprefix("edit_") for name in self._done[-6:])
        where = f"edit {len(self._done)} of {self.name}: {last}"
        if shown is None:
            viewport = shown_viewport()
            error = viewport.session.progress().render.error if viewport else "no viewport"
            return f"no picture after {where} ({error})"
        fresh = fresh_picture()
        if shown.shape != fresh.shape:
            return f"{where}: size {shown.shape}, fresh {fresh.shape}"
        if self._guided:
            return f"{where}: {blocks_apart(shown, fresh_picture(2000)):.1%} of the blocks differ"
        apart = np.abs(shown - fresh)
        return f"{where}: {np.count_nonzero(apart.max(-1))} pixels differ, by {apart.max()}"


def finish(code: int) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def check_comparison() -> None:
    """The comparison by statistics takes noise for noise, and a tenth more light for a change."""
    noise = np.random.default_rng(1).exponential(1.0, (2, 64, 64, 4)).astype(np.float32)
    assert blocks_apart(noise[0], noise[1]) <= _MOST_BLOCKS
    smooth = 0.9 + 0.1 * noise
    assert blocks_apart(smooth[0], 1.1 * smooth[1]) > 0.5
    harness.say("PASS comparison_by_statistics")


_fuzzes = [Fuzz(SEED, EDITS), Fuzz(SEED, GUIDED_EDITS, guided=True)]
_fuzzes += [Fuzz(seed, count) for seed, count in REGRESSIONS]
_failed = []


def run_next() -> float:
    if not _fuzzes:
        finish(1 if _failed else 0)
    fuzz = _fuzzes[0]
    try:
        delay = fuzz.step()
    except BaseException as error:
        traceback.print_exc()
        harness.say(f"FAIL {fuzz.name}: {type(error).__name__}: {error}")
        _failed.append(fuzz)
        delay = None
    if delay is None:
        _fuzzes.pop(0)
        return _TICK
    return delay


check_comparison()
harness.enable_addon()
bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(run_next, first_interval=1.0, persistent=True)
