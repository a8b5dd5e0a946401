"""Pharos: a guided path tracer for Blender."""

bl_info = {
    "name": "Pharos",
    "description": "Path tracer that learns where the light is while it renders",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render Properties > Render Engine > Pharos",
    "category": "Render",
}

from . import (  # noqa: E402
    checkpoints,
    compare,
    engine,
    guide_memory,
    handlers,
    lobes,
    operators,
    panels,
    properties,
    report_rows,
    running,
    write_flag,
)

_PARTS = (
    properties,
    write_flag,
    engine,
    operators,
    lobes,
    report_rows,
    panels,
    compare,
    handlers,
    checkpoints,
    guide_memory,
    running,
)


def register():
    for part in _PARTS:
        part.register()


def unregister():
    for part in reversed(_PARTS):
        part.unregister()
