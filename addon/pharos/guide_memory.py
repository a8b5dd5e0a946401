"""What final renders remember of the light: the network of the frame before goes on in the next.

Within an animation it stays in this process; across renders it lies in a file beside the .blend,
if the scene asks for it. A picture's noise then depends on those rendered before, its light does
not. The file is replaced as a whole, so that others may read it meanwhile.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from . import checkpoints

_SUFFIX = ".pharos_guide"
_LARGEST = 1 << 30  # bytes that are read

# What the frame before has learned, by the names of scene, view layer and stereo view.
_learned: dict[tuple[str, str, str], bytes] = {}


def _file_for(key: tuple[str, str, str]) -> Path | None:
    """Beside the .blend; nothing while that has not been saved."""
    if not bpy.data.filepath:
        return None
    blend = Path(bpy.data.filepath)
    parts = [blend.stem, *(re.sub(r"[^\w-]", "_", name) for name in key if name)]
    return blend.with_name(".".join(parts) + _SUFFIX)


def _read(path: Path | None) -> bytes:
    if path is None or not path.is_file() or path.stat().st_size > _LARGEST:
        return b""
    with suppress(OSError):
        return path.read_bytes()
    return b""


def _write(path: Path, field: bytes) -> None:
    scratch = path.with_name(f".{os.getpid()}_{path.name}")
    try:
        scratch.write_bytes(field)
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


class GuideMemory:
    """Of one view layer (and stereo view) of the frame that is rendered."""

    def __init__(self, engine, scene, layer: str, view: str):
        self._key = (scene.name, layer, view)
        memory = "NONE" if engine.is_preview else scene.pharos.guide_memory
        self._file = _file_for(self._key) if memory == "FILE" else None
        self.keeps = memory != "NONE" and (engine.is_animation or self._file is not None)

    def earlier(self, checkpoint: str) -> bytes:
        """What the render starts from; empty: from nothing.

        What it starts from lies beside its checkpoint, so that a render that was stopped goes on as
        it began.
        """
        if not self.keeps:
            return b""
        if checkpoint and Path(checkpoint).is_file():
            return _read(checkpoints.start_of(checkpoint))
        field = _learned.get(self._key) or _read(self._file)
        if checkpoint:
            start = checkpoints.start_of(checkpoint)
            start.unlink(missing_ok=True)
            if field:
                _write(start, field)
        return field

    def remember(self, session) -> str:
        """Takes what a finished render has learned; says what went wrong, else nothing."""
        field = session.field() if self.keeps else b""
        if not field:
            return ""
        _learned[self._key] = field
        if self._file is not None:
            try:
                _write(self._file, field)
            except OSError as error:
                return f"What the network has learned cannot be kept: {error.strerror}."
        return ""


@persistent
def _forget(*_):
    _learned.clear()


def _handlers() -> list:
    handlers = bpy.app.handlers
    return [handlers.render_init, handlers.render_complete, handlers.render_cancel]


def register():
    for handler in _handlers():
        handler.append(_forget)


def unregister():
    for handler in _handlers():
        handler.remove(_forget)
    _learned.clear()
