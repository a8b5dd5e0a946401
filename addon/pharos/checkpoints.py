"""Checkpoints of final renders: where they lie, and when they are no longer needed.

They lie beside the pictures, named after them, and are removed when their frame's picture is safe:
written to its file, or complete in Blender's Render Result.
"""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

_SUFFIX = ".pharos_checkpoint"


def _word(name: str) -> str:
    """Part of a file's name: nothing in it leads to another folder."""
    return re.sub(r"[^\w-]", "_", name)


def _stem(scene, frame: int) -> Path:
    picture = Path(bpy.path.abspath(scene.render.frame_path(frame=frame)))
    return picture.with_name(_word(picture.stem) or "frame")


def path_for(scene, layer: str, view: str) -> str:
    """The checkpoint of a view layer of the current frame; empty where none is wanted."""
    if not scene.pharos.use_checkpoint:
        return ""
    stem = _stem(scene, scene.frame_current)
    with suppress(OSError):  # the native part names the folder when it cannot write
        stem.parent.mkdir(parents=True, exist_ok=True)
    parts = [stem.name, _word(layer), *([_word(view)] if view else [])]
    return str(stem.with_name(".".join(parts) + _SUFFIX))


def start_of(checkpoint: str) -> Path:
    """What the network of that render started from, beside its checkpoint and as long as that."""
    return Path(checkpoint.removesuffix(_SUFFIX) + ".start" + _SUFFIX)


def _remove(scene) -> None:
    stem = _stem(scene, scene.frame_current)
    if not stem.parent.is_dir():
        return
    for path in stem.parent.iterdir():
        if path.name.startswith(stem.name + ".") and path.name.endswith(_SUFFIX):
            path.unlink(missing_ok=True)


@persistent
def _picture_written(scene, *_):
    picture = Path(bpy.path.abspath(scene.render.frame_path(frame=scene.frame_current)))
    if scene.pharos.use_checkpoint and picture.is_file():
        _remove(scene)


@persistent
def _render_complete(scene, *_):
    if scene.pharos.use_checkpoint:
        _remove(scene)


def register():
    bpy.app.handlers.render_write.append(_picture_written)
    bpy.app.handlers.render_complete.append(_render_complete)


def unregister():
    bpy.app.handlers.render_complete.remove(_render_complete)
    bpy.app.handlers.render_write.remove(_picture_written)
