"""Tests in a window: functions named step_*, run one at a time from a timer, so that Blender draws
and handles events between them. An assertion that fails is tried again for a while."""

from __future__ import annotations

import os
import sys
import traceback

import bpy
import harness

_INTERVAL = 0.4


class _Runner:
    """Prints a line a step, as harness.main() does; ends the process after the last."""

    def __init__(self, steps, most_tries: int):
        self._steps, self._most_tries, self._tries = steps, most_tries, 0

    def __call__(self) -> float:
        """A failure ends the process, as an exception in a timer would leave it running."""
        if not self._steps:
            finish(0)
        function = self._steps[0]
        try:
            function()
        except AssertionError as error:
            self._tries += 1
            if self._tries < self._most_tries:
                return _INTERVAL
            fail(function, error)
        except BaseException as error:
            fail(function, error)
        harness.say(f"PASS {function.__name__}")
        self._tries = 0
        self._steps.pop(0)
        return _INTERVAL


def fail(function, error) -> None:
    traceback.print_exc()
    harness.say(f"FAIL {function.__name__}: {type(error).__name__}: {error}")
    finish(1)


def finish(code: int) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def main(names: dict, most_tries: int = 75) -> None:
    """Run the script's steps once Blender's window is there."""
    steps = [function for name, function in names.items() if name.startswith("step_")]
    harness.enable_addon()
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(_Runner(steps, most_tries), first_interval=1.0, persistent=True)
