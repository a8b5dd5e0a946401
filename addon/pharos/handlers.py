"""What happens outside of a render: reports reach their scenes, a dump asked for by an argument is
written once the file is loaded.

Renders may run on threads that must not write to Blender's data, so their reports wait here for a
timer on the main thread; in background mode there is no other thread and they are written at once.
"""

from __future__ import annotations

import queue
import sys
import traceback

import bpy
from bpy.app.handlers import persistent

from .export.report import Entry

_waiting: queue.SimpleQueue = queue.SimpleQueue()
_epoch = [0]  # grows whenever pointers may stand for other things than before
_DUMP_ARGUMENT = "--pharos-dump"
_FORBIDDEN = "Writing to ID classes"  # how Blender's message begins
_RENDER_ARGUMENTS = {"-f", "--render-frame", "-a", "--render-anim"}


def write_report(scene, entries) -> None:
    """Replace a scene's report where it has changed."""
    report = scene.pharos.report
    fields = Entry._fields
    if [tuple(getattr(e, f) for f in fields) for e in report] == [tuple(e) for e in entries]:
        return
    report.clear()
    for entry in entries:
        item = report.add()
        for field, value in zip(fields, entry):
            setattr(item, field, value)


def write_slow(scene, rows) -> None:
    """Replace the list of what made a scene's picture slow: (kind, name, share)."""
    scene.pharos.slow.clear()
    for kind, name, share in rows:
        item = scene.pharos.slow.add()
        item.kind, item.name, item.share = kind, name, share


def _post(write, scene_name: str, what) -> None:
    _waiting.put((write, scene_name, what))
    if bpy.app.background:
        _deliver()


def post_report(scene_name: str, entries) -> None:
    """Hand a report to the scene of that name, from any thread."""
    _post(write_report, scene_name, entries)


def post_slow(scene_name: str, rows) -> None:
    """Hand it what made its picture slow, likewise."""
    _post(write_slow, scene_name, rows)


def edit_epoch() -> int:
    """Grows with every undo, redo and loaded file."""
    return _epoch[0]


@persistent
def _begin_epoch(*_):
    _epoch[0] += 1


def _epoch_handlers() -> list:
    handlers = bpy.app.handlers
    return [
        handlers.undo_pre,
        handlers.undo_post,
        handlers.redo_pre,
        handlers.redo_post,
        handlers.load_post,
    ]


def _deliver() -> float:
    """Where Blender forbids to write (write_flag.py) nothing is lost: it is tried again."""
    for _ in range(_waiting.qsize()):
        write, scene_name, what = _waiting.get()
        scene = bpy.data.scenes.get(scene_name)
        try:
            if scene is not None:
                write(scene, what)
        except AttributeError as error:
            if _FORBIDDEN in str(error):
                _waiting.put((write, scene_name, what))
            else:
                traceback.print_exc()
    return 0.5


def dump_argument() -> str:
    """FILE of `-- --pharos-dump FILE`; empty without."""
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if _DUMP_ARGUMENT in own:
        place = own.index(_DUMP_ARGUMENT) + 1
        return own[place] if place < len(own) else ""
    return ""


def _renders_by_argument() -> bool:
    ours = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    return any(argument in _RENDER_ARGUMENTS for argument in sys.argv[:ours])


@persistent
def _dump_after_load(*_):
    path = dump_argument()
    if path:
        bpy.ops.pharos.dump(filepath=path)


def register():
    for handler in _epoch_handlers():
        handler.append(_begin_epoch)
    if not bpy.app.background:
        bpy.app.timers.register(_deliver, first_interval=0.5, persistent=True)
    elif dump_argument() and not _renders_by_argument():
        bpy.app.handlers.load_post.append(_dump_after_load)


def unregister():
    if bpy.app.timers.is_registered(_deliver):
        bpy.app.timers.unregister(_deliver)
    for handler in _epoch_handlers():
        if _begin_epoch in handler:
            handler.remove(_begin_epoch)
    if _dump_after_load in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_dump_after_load)
