"""Blender's permission to write, kept right when a render ends.

Blender 3.4 to 4.5 keep in one flag for all threads whether Python may write to its data: each call
of Blender into a class remembers the flag, sets its own and puts the remembered one back. A render
thread that comes in while the main thread draws a panel remembers "no", and puts that back when it
leaves, after the drawing has ended: from then on no timer, no handler and no driver of any add-on
may write. No engine can keep Blender from it, but it can be undone: where a callback may have
remembered the wrong, it has the main thread enter an operator, which remembers the "yes" that holds
while the callback is inside, and leave it only after the callback has gone.
"""

from __future__ import annotations

import queue
import sys
import threading
import time
import weakref
from dataclasses import dataclass, field

import bpy

_LOOK_INTERVAL = 0.1  # seconds between looks of the main thread
_PATIENCE = 2.0  # seconds a callback waits for it: it may be busy drawing
_HURRIED_PATIENCE = 0.4  # seconds, of one that is told to stop; and its own for one to return
_GLANCE = 0.01  # seconds between a waiting callback's looks at whether it is

_at_risk = threading.Event()  # a callback came in while the main thread was in Python
_leaving: queue.SimpleQueue = queue.SimpleQueue()


class Visit:
    """Lives as long as the callback that holds it: nobody else may."""


@dataclass
class _Leave:
    visit: weakref.ref
    main_is_in: threading.Event = field(default_factory=threading.Event)


def enter() -> Visit:
    """The first call in a callback of the engine; the result is to be its local variable."""
    main = threading.main_thread()
    if threading.current_thread() is not main and main.ident in sys._current_frames():
        _at_risk.set()
    return Visit()


def leave(visit: Visit, engine) -> None:
    """The last call in a callback of this engine. Waits for the main thread where that is needed, a
    while: not when a preview is given up, as the main thread itself waits for its end then. What is
    not mended here a later callback can mend."""
    if bpy.app.background or threading.current_thread() is threading.main_thread():
        return
    if not _at_risk.is_set():
        return
    asked = _Leave(weakref.ref(visit))
    _leaving.put(asked)
    begin = time.monotonic()
    while not asked.main_is_in.wait(_GLANCE):
        patience = _PATIENCE
        if engine.test_break():
            patience = 0.0 if engine.is_preview else _HURRIED_PATIENCE
        if time.monotonic() - begin > patience:
            break


class PHAROS_OT_keep_write_flag(bpy.types.Operator):
    """Stay until the callbacks that are leaving have left"""

    bl_idname = "pharos.keep_write_flag"
    bl_label = "Keep Write Flag"
    bl_options = {"INTERNAL"}

    def execute(self, context):
        """A visit ends with its callback's frame, and Python's lock is held from there until
        Blender has put the flag back: once it is seen here that it ended, the flag is back."""
        deadline = time.monotonic() + _HURRIED_PATIENCE
        all_left = True
        while not _leaving.empty():
            asked = _leaving.get()
            asked.main_is_in.set()
            while asked.visit() is not None and time.monotonic() < deadline:
                time.sleep(0.0005)
            all_left = all_left and asked.visit() is None
        if all_left:
            _at_risk.clear()
        return {"FINISHED"}


def _look() -> float:
    if not _leaving.empty():
        try:
            bpy.ops.pharos.keep_write_flag()
        except RuntimeError:  # the flag forbids it already: a later render can mend it
            while not _leaving.empty():
                _leaving.get().main_is_in.set()
    return _LOOK_INTERVAL


def register():
    bpy.utils.register_class(PHAROS_OT_keep_write_flag)
    if not bpy.app.background:
        bpy.app.timers.register(_look, first_interval=_LOOK_INTERVAL, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    bpy.utils.unregister_class(PHAROS_OT_keep_write_flag)
