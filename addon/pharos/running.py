"""Final renders under way: before the add-on is switched off they are ended, because Blender uses
the engine's class on the thread of the render until that thread ends.
"""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from pathlib import Path

_THREADS = Path("/proc/self/task")
_PATIENCE = 20.0  # seconds

_stops: dict[int, threading.Event] = {}  # by the number of the render's thread


@contextmanager
def announced():
    """A render on this thread; yields the event that tells it to stop."""
    thread, stop = threading.get_native_id(), threading.Event()
    _stops[thread] = stop
    try:
        yield stop
    finally:
        _stops.pop(thread, None)


def ask_all() -> bool:
    """Ask all renders to stop; False where there are none."""
    stops = list(_stops.values())
    for stop in stops:
        stop.set()
    return bool(stops)


def end_all() -> None:
    """Ask all renders to stop, and wait for the threads of others."""
    ask_all()
    others = [_THREADS / str(thread) for thread in _stops if thread != threading.get_native_id()]
    deadline = time.monotonic() + _PATIENCE
    while any(thread.exists() for thread in others) and time.monotonic() < deadline:
        time.sleep(0.01)


def register():
    """Nothing: there are no renders yet."""


def unregister():
    end_all()
