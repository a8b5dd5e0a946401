"""Runs one engine on one scene in a process of its own and hands back timed pictures.

A program is a function of (scene, options, runs, threads, program=None) that yields a Shot for each
(samples, seed) of `runs`, and raises EngineError where it cannot go on; pictures it has yielded by
then count. PROGRAMS holds those there are.
"""

import json
import os
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness import pictures, process
from harness.process import EngineError
from harness.scenes import BOUNCES, ROOT

WORKER = Path(__file__).with_name("cycles_worker.py")
EXPORTER = Path(__file__).with_name("dump_worker.py")
MEBIBYTE = 1 << 20


@dataclass
class Shot:
    """One picture with what it cost."""

    samples: int
    seed: int
    seconds: float  # CPU seconds of rendering, scene preparation included, divided by threads
    pixels: np.ndarray  # (height, width, 3) float32, bottom row first
    facts: dict = field(default_factory=dict)  # further columns of results.py
    budget: int | None = None  # what was asked for, where that is not `samples`

    def __post_init__(self):
        if self.budget is None:
            self.budget = self.samples


def cache_folder():
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "pharos"


def _cycles(command, scene, options, runs, threads, timeout=3600):
    with tempfile.TemporaryDirectory() as folder:
        job = {"name": scene.name, "runs": runs, "threads": threads, "bounces": BOUNCES,
               "resolution": scene.resolution, "guiding": options.get("guiding", False),
               "began": time.time()}
        done = process.run([*command, scene.file, folder, json.dumps(job)], timeout)
        facts, count = {}, 0
        for line in done.out.splitlines():
            if line.startswith("START "):
                facts = json.loads(line[6:])
            elif line.startswith("ROW "):
                row = json.loads(line[4:])
                count += 1
                yield Shot(row["samples"], row["seed"], row["seconds"], np.load(row["image"]),
                           {**facts, "wall": row["wall"], "memory": row["memory"]})
    process.check(done, command[0])
    if count != len(runs):
        raise EngineError(f"Cycles gave {count} of {len(runs)} pictures of {scene.name}")


def render_cycles(scene, options, runs, threads, program=None):
    """Cycles of bpy; all runs in one process."""
    return _cycles([program or sys.executable, WORKER], scene, options, runs, threads)


def render_old_cycles(scene, options, runs, threads, program=None):
    """Cycles of the Blender on the path (Debian's 3.4.1)."""
    blender = program or os.environ.get("BLENDER") or shutil.which("blender")
    if not blender:
        raise EngineError("there is no blender on the path")
    command = [blender, "-b", "--factory-startup", "-Y", "--python-exit-code", "3", "-P", WORKER,
               "--"]
    return _cycles(command, scene, options, runs, threads)


def dump_file(scene):
    """The scene as pharos-cli reads it, made by the add-on in bpy, and what that took.

    Kept beside the build that it belongs to, while nothing changes.
    """
    native = sorted((ROOT / "build/blender/addons/pharos").rglob("*.*"))
    newest = max((path.stat().st_mtime_ns for path in native), default=0)
    path = ROOT / "build/benchmark/dumps" / f"{scene.name}_{scene.key()}.pharos"
    about = path.with_suffix(".json")
    if not (path.exists() and about.exists() and path.stat().st_mtime_ns > newest):
        path.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, EXPORTER, scene.file, path, *scene.resolution, BOUNCES,
                   time.time()]
        scripts = {"BLENDER_USER_SCRIPTS": str(ROOT / "build/blender")}
        done = process.check(process.run(command, 600, os.environ | scripts), EXPORTER)
        line = next(line for line in done.out.splitlines() if line.startswith("EXPORTED "))
        about.write_text(line.split(" ", 1)[1])
    return path, json.loads(about.read_text())


def _facts(work, row, export, peak_bytes, last):
    """Columns from the counters that pharos-cli writes; most are known of the whole render only."""
    facts = {"wall": row["wall_seconds"] + work["build_seconds"], "startup": export["startup"],
             "export": export["seconds"] + work["read_seconds"], "build": work["build_seconds"]}
    if last and work["vertices"]:
        facts |= {"memory": peak_bytes / MEBIBYTE, "dropped": work["nonfinite_samples"],
                  "vertices": work["vertices"] / work["camera_samples"],
                  "rays": work["rays"] / work["camera_samples"],
                  "cpu_per_vertex": work["render_cpu_seconds"] / work["vertices"],
                  "guided_share": work["guided_share"],
                  "stages": {stage["name"]: stage["seconds"] for stage in work["stages"]
                             if stage["items"]}}
    return facts


def render_pharos(scene, options, runs, threads, program=None):
    """Each picture is a render of its own, as a user asks for it: how many samples there are to be
    decides whether learning could pay."""
    for run in runs:
        yield from render_snapshots(scene, options, [run], threads, program)


def render_snapshots(scene, options, runs, threads, program=None, timeout=3600):
    """Budgets of one seed are snapshots of one render."""
    program = str(program or ROOT / "build/release/native/pharos-cli")
    dump, export = dump_file(scene)
    for seed in dict.fromkeys(seed for _, seed in runs):
        budgets = sorted({samples for samples, s in runs if s == seed})
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out.exr"
            command = [program, "render", str(dump), "-o", str(out),
                       "--samples", str(budgets[-1]), "--seed", str(seed),
                       "--threads", str(threads), "--guiding", options["guiding"],
                       "--nee", options.get("nee", "on"), *options.get("more", ()),
                       "--snapshots", ",".join(map(str, budgets)),
                       "--stats-json", str(Path(folder) / "stats.json")]
            done = process.check(process.run(command, timeout), program)
            work = json.loads((Path(folder) / "stats.json").read_text())
            for row, asked in zip(work["snapshots"], budgets, strict=True):
                pixels = pictures.read_exr(Path(folder) / f"out.{row['samples']}.exr")
                seconds = row["cpu_seconds"] / threads + work["build_seconds"]
                facts = _facts(work, row, export, done.peak_bytes, asked == budgets[-1])
                yield Shot(row["samples"], seed, seconds, pixels, facts, asked)


PROGRAMS = {"pharos": render_pharos, "cycles": render_cycles, "cycles-3.4": render_old_cycles}
