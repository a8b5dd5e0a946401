"""Runs one engine on one scene in a process of its own and hands back timed pictures."""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness import pictures
from harness.scenes import BOUNCES, ROOT

WORKER = Path(__file__).with_name("cycles_worker.py")
EXPORTER = Path(__file__).with_name("dump_worker.py")


class EngineError(RuntimeError):
    """The engine gave no picture; the message holds the end of what it said."""


@dataclass
class Shot:
    """One picture with what it cost."""

    samples: int
    seed: int
    seconds: float  # CPU seconds of rendering, scene preparation included, divided by threads
    pixels: np.ndarray  # (height, width, 3) float32, bottom row first
    work: dict  # counters, where the engine has them


def cache_folder():
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "pharos"


def _run(command, timeout):
    # Libraries on the searching path of a caller must not leak into the contestants.
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False,
                          stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        said = (done.stdout + done.stderr)[-2000:]
        raise EngineError(f"{Path(command[0]).name} ended with {done.returncode}:\n{said}")
    return done.stdout


def render_cycles(scene, options, runs, threads, timeout=3600):
    """`runs` is a list of (samples, seed); all in one process."""
    with tempfile.TemporaryDirectory() as folder:
        job = {"name": scene.name, "runs": runs, "threads": threads, "bounces": BOUNCES,
               "resolution": scene.resolution, "guiding": options.get("guiding", False)}
        command = [sys.executable, str(WORKER), str(scene.file), folder, json.dumps(job)]
        said = _run(command, timeout)
        shots = []
        for line in said.splitlines():
            if line.startswith("ROW "):
                row = json.loads(line[4:])
                shots.append(Shot(row["samples"], row["seed"], row["seconds"],
                                  np.load(row["image"]), {}))
    if len(shots) != len(runs):
        raise EngineError(f"Cycles gave {len(shots)} of {len(runs)} pictures of {scene.name}")
    return shots


def dump_file(scene):
    """The scene as pharos-cli reads it, made by the add-on in bpy; kept while nothing changes."""
    native = sorted((ROOT / "build/blender/addons/pharos").rglob("*.*"))
    newest = max((path.stat().st_mtime_ns for path in native), default=0)
    path = cache_folder() / "dumps" / f"{scene.name}_{scene.key()}.pharos"
    if path.exists() and path.stat().st_mtime_ns > newest:
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    _run([sys.executable, str(EXPORTER), str(scene.file), str(path), *map(str, scene.resolution),
          str(BOUNCES)], 600)
    return path


def render_pharos(scene, options, runs, threads, program=None, timeout=3600):
    """Budgets of one seed are snapshots of one render, as passes do not depend on the total."""
    program = str(program or ROOT / "build/release/native/pharos-cli")
    dump = dump_file(scene)
    shots = []
    for seed in dict.fromkeys(seed for _, seed in runs):
        budgets = sorted({samples for samples, s in runs if s == seed})
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out.exr"
            command = [program, "render", str(dump), "-o", str(out),
                       "--samples", str(budgets[-1]), "--seed", str(seed),
                       "--threads", str(threads), "--guiding", options["guiding"],
                       "--nee", options.get("nee", "on"),
                       "--snapshots", ",".join(map(str, budgets)),
                       "--stats-json", str(Path(folder) / "stats.json")]
            _run(command, timeout)
            work = json.loads((Path(folder) / "stats.json").read_text())
            for row in work["snapshots"]:
                pixels = pictures.read_exr(Path(folder) / f"out.{row['samples']}.exr")
                seconds = row["cpu_seconds"] / threads + work["build_seconds"]
                shots.append(Shot(row["samples"], seed, seconds, pixels, work))
    return shots


def render(scene, engine, runs, threads, program=None):
    """Pictures of one engine; `program` takes the place of pharos-cli."""
    if engine.program == "cycles":
        return render_cycles(scene, engine.options, runs, threads)
    return render_pharos(scene, engine.options, runs, threads, program)
