"""Denoised previews by the OpenImageDenoise library of Blender itself, where there is one.

The library is called through its C interface, on a thread that Python's lock does not hold. What
is denoised is only what the viewport shows; the samples stay as they are.

Only Blender's own library is taken: one from elsewhere aborts in a Blender with another allocator
(Debian's 3.4.1 has jemalloc; the library binds its parts to their own symbols first).
"""

from __future__ import annotations

import ctypes
import threading
from functools import cache
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

_NAMES = ("libOpenImageDenoise.so.2", "libOpenImageDenoise.so")
_CPU = 1
_FLOAT3 = 3
_PIXEL = 16  # bytes: RGBA


class Library(NamedTuple):
    """Exactly one of the two is set."""

    oidn: ctypes.CDLL | None
    problem: str


def _candidates() -> list[Path]:
    folder = Path(bpy.utils.resource_path("LOCAL")).parent / "lib"
    return [folder / name for name in _NAMES]


def _declare(oidn: ctypes.CDLL) -> None:
    handle, text, size = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
    for name, result, arguments in (
        ("oidnNewDevice", handle, [ctypes.c_int]),
        ("oidnCommitDevice", None, [handle]),
        ("oidnReleaseDevice", None, [handle]),
        ("oidnGetDeviceError", ctypes.c_int, [handle, ctypes.POINTER(text)]),
        ("oidnNewFilter", handle, [handle, text]),
        (
            "oidnSetSharedFilterImage",
            None,
            [handle, text, handle, ctypes.c_int, size, size, size, size, size],
        ),
        ("oidnSetFilterBool", None, [handle, text, ctypes.c_bool]),
        ("oidnCommitFilter", None, [handle]),
        ("oidnExecuteFilter", None, [handle]),
        ("oidnReleaseFilter", None, [handle]),
    ):
        function = getattr(oidn, name)
        function.restype, function.argtypes = result, arguments


@cache
def load() -> Library:
    """Load once; later calls return the same answer."""
    path = next((path for path in _candidates() if path.is_file()), None)
    if path is None:
        return Library(None, "This Blender comes without the OpenImageDenoise library.")
    try:
        oidn = ctypes.CDLL(str(path))
        _declare(oidn)
    except (OSError, AttributeError) as error:
        return Library(None, f"OpenImageDenoise could not be loaded: {error}")
    return Library(oidn, "")


def denoised(oidn, pixels: np.ndarray) -> np.ndarray:
    """A picture (height, width, RGBA; float32) without its noise; alpha stays. RuntimeError."""
    source = np.ascontiguousarray(pixels)
    out = source.copy()
    height, width = source.shape[:2]
    device = oidn.oidnNewDevice(_CPU)
    if not device:
        raise RuntimeError("OpenImageDenoise has no device.")
    try:
        oidn.oidnCommitDevice(device)
        denoiser = oidn.oidnNewFilter(device, b"RT")
        for name, image in ((b"color", source), (b"output", out)):
            oidn.oidnSetSharedFilterImage(
                denoiser, name, image.ctypes.data, _FLOAT3, width, height, 0, _PIXEL, 0
            )
        oidn.oidnSetFilterBool(denoiser, b"hdr", True)
        oidn.oidnCommitFilter(denoiser)
        oidn.oidnExecuteFilter(denoiser)
        oidn.oidnReleaseFilter(denoiser)
        message = ctypes.c_char_p()
        if oidn.oidnGetDeviceError(device, ctypes.byref(message)):
            raise RuntimeError((message.value or b"unknown error").decode(errors="replace"))
    finally:
        oidn.oidnReleaseDevice(device)
    return out


class Denoiser:
    """One picture at a time on a thread of its own; what comes meanwhile is left out."""

    def __init__(self, oidn):
        self._oidn = oidn
        self._thread: threading.Thread | None = None
        self._done: tuple | None = None
        self.problem = ""

    @property
    def busy(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    @property
    def is_ready(self) -> bool:
        return self._done is not None

    def start(self, pixels: np.ndarray, tag) -> None:
        """`tag` comes back with the result."""
        self._thread = threading.Thread(target=self._run, args=(pixels, tag), daemon=True)
        self._thread.start()

    def take(self) -> tuple | None:
        """(pixels, tag) of the last picture that is ready, once."""
        done, self._done = self._done, None
        return done

    def _run(self, pixels, tag) -> None:
        try:
            self._done = denoised(self._oidn, pixels), tag
        except RuntimeError as error:
            self.problem = str(error)
