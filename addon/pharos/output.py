"""Pictures written without Blender, and progress lines for programs that watch a render."""

from __future__ import annotations

import os
import sys
import time

import numpy as np

from .passes import Pass


def read_pass(native, session, entry: Pass) -> np.ndarray | None:
    """Pixels (n, channels) of a pass, bottom row first; None without picture or pass."""
    pixels = np.empty((session.width * session.height, len(entry.channels)), np.float32)
    if entry.aov >= 0:
        found = session.read_aov(entry.aov, pixels)
    else:
        found = session.read(getattr(native.FilmPass, entry.film_pass), pixels)
    return pixels if found else None


def write_partial(native, session, entries, path: str) -> bool:
    """The picture with these passes as far as it has come, as an EXR file."""
    passes = []
    for entry in entries:
        pixels = read_pass(native, session, entry)
        if pixels is not None:
            passes.append((entry.name, entry.channels, pixels))
    if not passes:
        return False
    native.write_exr(path, session.width, session.height, passes)
    return True


class ProgressLine:
    """`pharos: 37 % 48/128 samples 12.3 s left noise 0.021` on stdout, a few times a second."""

    _INTERVAL = 0.25

    def __init__(self, background: bool):
        self._wanted = background and os.environ.get("PHAROS_PROGRESS") == "1"
        self._next = 0.0

    def show(self, progress, last: bool = False) -> None:
        now = time.monotonic()
        if not self._wanted or (now < self._next and not last):
            return
        self._next = now + self._INTERVAL
        sys.stdout.write(
            f"pharos: {100 * progress.fraction:.0f} % "
            f"{progress.samples}/{progress.total_samples} samples "
            f"{progress.remaining:.1f} s left noise {progress.noise:.3g}\n"
        )
        sys.stdout.flush()
