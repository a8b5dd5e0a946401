"""Pictures written without Blender, and progress lines for programs that watch a render."""

from __future__ import annotations

import os
import sys
import time

import numpy as np

from .passes import PASSES


def read_pass(native, session, name: str) -> np.ndarray | None:
    """Pixels (n, channels) of a film pass, bottom row first; None without picture or pass."""
    film_pass = getattr(native.FilmPass, name)
    pixels = np.empty(
        (session.width * session.height, native.film_pass_channels(film_pass)), np.float32
    )
    return pixels if session.read(film_pass, pixels) else None


def write_partial(native, session, path: str) -> bool:
    """The picture as far as it has come, as an EXR file."""
    passes = []
    for entry in PASSES:
        pixels = read_pass(native, session, entry.film_pass)
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
