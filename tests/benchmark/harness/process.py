"""Starts a program, waits with a limit, and says what it took: time and memory."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path


class EngineError(RuntimeError):
    """The engine gave no picture; the message holds the end of what it said."""


@dataclass
class Done:
    """How a program ended."""

    code: int  # negative: the signal that ended it
    out: str
    said: str  # the end of both streams
    wall: float
    peak_bytes: int  # of its resident memory


def run(command, timeout, env=None):
    """Never raises for what the program does; kills it and its children after `timeout` seconds."""
    with tempfile.TemporaryFile("w+", errors="replace") as out, \
            tempfile.TemporaryFile("w+", errors="replace") as err:
        began = time.monotonic()
        child = subprocess.Popen([str(word) for word in command], stdout=out, stderr=err,
                                 stdin=subprocess.DEVNULL, env=env, start_new_session=True)
        late = threading.Event()

        def stop():
            late.set()
            os.killpg(child.pid, signal.SIGKILL)

        timer = threading.Timer(timeout, stop)
        timer.start()
        try:
            _, status, usage = os.wait4(child.pid, 0)
        except BaseException:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            raise
        finally:
            timer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        wall = time.monotonic() - began
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read())
    said = "".join(texts)[-2000:]
    if late.is_set():
        said += f"\nno end after {timeout:g} s"
    return Done(child.returncode, texts[0], said, wall, usage.ru_maxrss * 1024)


def end_on_termination():
    """SIGTERM ends this program as Ctrl-C does: by way of run(), which ends its child."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))


def check(done, name):
    """Raises EngineError where a program did not end well."""
    if done.code != 0:
        raise EngineError(f"{Path(name).name} ended with {done.code}: {done.said.strip()}")
    return done
