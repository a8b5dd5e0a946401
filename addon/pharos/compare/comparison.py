"""Two background Blenders that render a copy of the scene, one after the other: nothing here waits.

The copy lies in a folder of its own that is gone when the comparison is.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy

WORKER = Path(__file__).with_name("worker.py")
ENGINES = ("PHAROS", "CYCLES")
_SAID = 600  # characters of a failed Blender that are shown


class ComparisonError(RuntimeError):
    """Why there is no comparison."""


@dataclass
class Contestant:
    """What one engine made of the scene."""

    engine: str
    samples: int
    seconds: list[float]  # CPU, of each of the two pictures
    report: list[str]
    changed: list[str]
    pictures: list[Path]


class Comparison:
    """Start it, then poll() until it is done; cancel() at any time."""

    def __init__(self, scene, seconds: float, blender: str):
        self._folder = Path(tempfile.mkdtemp(prefix="pharos_compare_"))
        self._blender = blender
        self._copy = self._folder / "scene.blend"
        self._scene_name = scene.name
        self._seconds = seconds
        self._seed = scene.pharos.seed
        fixed = scene.render.threads_mode == "FIXED"
        self._threads = scene.render.threads if fixed else os.cpu_count() or 1
        self._child: subprocess.Popen | None = None
        self.results: list[Contestant] = []
        try:
            # Paths to images are remapped, so that the copy finds them.
            bpy.ops.wm.save_as_mainfile(
                filepath=str(self._copy), copy=True, compress=False, relative_remap=True
            )
            self._start(ENGINES[0])
        except Exception:
            self.close()
            raise

    @property
    def state(self) -> str:
        """What is being done, for the interface."""
        if len(self.results) == len(ENGINES):
            return "done"
        return f"{ENGINES[len(self.results)].capitalize()} is rendering"

    @property
    def pid(self) -> int | None:
        """Of the Blender at work."""
        return self._child.pid if self._child else None

    def _start(self, engine: str) -> None:
        folder = self._folder / engine
        folder.mkdir()
        wanted = self._seconds
        if self.results:  # the second engine gets what the first one took
            wanted = sum(self.results[0].seconds) / len(self.results[0].seconds)
        job = {
            "scene": self._scene_name,
            "engine": engine,
            "seconds": wanted,
            "threads": self._threads,
            "seed": self._seed,
            "folder": str(folder),
        }
        path = folder / "JOB.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        trusted = bpy.context.preferences.filepaths.use_scripts_auto_execute
        # Drivers run where they run in this Blender.
        command = [self._blender, "-b", "--factory-startup", "-y" if trusted else "-Y"]
        command += ["--python-exit-code", "3", str(self._copy), "-P", str(WORKER), "--", str(path)]
        with (folder / "said.txt").open("wb") as said:
            self._child = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def poll(self) -> bool:
        """True when both engines are done. Raises ComparisonError where one of them failed."""
        if self._child is None:
            return len(self.results) == len(ENGINES)
        if self._child.poll() is None:
            return False
        code, self._child = self._child.returncode, None
        engine = ENGINES[len(self.results)]
        folder = self._folder / engine
        result = folder / "RESULT.json"
        if not result.exists():
            said = (folder / "said.txt").read_text(encoding="utf-8", errors="replace")
            raise ComparisonError(f"{engine} gave no picture (exit code {code}): {said[-_SAID:]}")
        fields = json.loads(result.read_text(encoding="utf-8"))
        pictures = [folder / f"{name}.exr" for name in ("first", "second")]
        self.results.append(Contestant(engine, **fields, pictures=pictures))
        if len(self.results) < len(ENGINES):
            self._start(ENGINES[len(self.results)])
            return False
        return True

    def cancel(self) -> None:
        """End the Blender at work."""
        child, self._child = self._child, None
        if child is not None and child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()

    def close(self) -> None:
        """Cancel, and remove everything."""
        self.cancel()
        shutil.rmtree(self._folder, ignore_errors=True)
