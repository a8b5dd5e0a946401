#!/usr/bin/env python3
"""Runs every test script in every host and prints `N passed, N failed, N skipped`.

Hosts come from the environment:
  BLENDER              a blender program (default: the one on PATH)
  PHAROS_BPY_PYTHON    a Python that imports bpy (default: build/bpy/bin/python)
  BLENDER_USER_SCRIPTS where addons/pharos lies ready (default: build/blender)
A script's line `# hosts: ...` names where it runs: blender, bpy, window (blender under xvfb) or
driver (this Python, starting blender itself). Arguments choose scripts by part of their name.

Another bpy is tried by hand, 5.0 say (any folder will do for the environment):
  /usr/bin/python3 -m venv /tmp/bpy5 && /tmp/bpy5/bin/pip install 'bpy>=5.0,<5.1' numpy
  PHAROS_TEST_HOSTS=bpy PHAROS_BPY_PYTHON=/tmp/bpy5/bin/python /usr/bin/python3 run_all.py
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COVERED: dict[str, list[str]] = {}  # by host: the node of each mode compared with Cycles
TIMEOUT = int(os.environ.get("PHAROS_TEST_TIMEOUT", "300"))


def environment() -> dict[str, str]:
    values = dict(os.environ)
    values.setdefault("BLENDER_USER_SCRIPTS", str(ROOT / "build" / "blender"))
    values.setdefault("BLENDER", shutil.which("blender") or "blender")
    values.setdefault("PHAROS_BPY_PYTHON", str(ROOT / "build" / "bpy" / "bin" / "python"))
    values["PYTHONPATH"] = str(HERE)
    values["PYTHONDONTWRITEBYTECODE"] = "1"
    return values


def hosts_of(script: Path) -> list[str]:
    found = re.search(r"^# hosts: (.+)$", script.read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1).split() if found else ["blender", "bpy"]


def blender_start(script: Path) -> list[str]:
    """Blender does not look at PYTHONPATH: the script's folder is put on the path for it."""
    expression = (
        f"import sys; sys.path.insert(0, {str(HERE)!r}); sys.argv = [{str(script)!r}]; "
        f"exec(compile(open({str(script)!r}).read(), {str(script)!r}, 'exec'), "
        f"{{'__name__': '__main__', '__file__': {str(script)!r}}})"
    )
    return ["--factory-startup", "-Y", "--python-exit-code", "3", "--python-expr", expression]


def command(host: str, script: Path, env: dict[str, str]) -> list[str] | None:
    """None where the host is not there."""
    blender = shutil.which(env["BLENDER"])
    if host == "bpy":
        python = Path(env["PHAROS_BPY_PYTHON"])
        return [str(python), str(script)] if python.exists() else None
    if host == "driver":
        return [sys.executable, str(script)]
    if blender is None:
        return None
    if host == "blender":
        return [blender, "-b", *blender_start(script)]
    if shutil.which("xvfb-run") is None:
        return None
    screen = "-screen 0 800x600x24 +extension GLX"
    window = ["--window-geometry", "0", "0", "800", "600"]
    return ["xvfb-run", "-a", "-s", screen, blender, *window, *blender_start(script)]


def run(host: str, script: Path, env: dict[str, str]) -> tuple[int, int, int]:
    """Passed, failed and skipped tests of one script in one host."""
    title = f"{script.stem} [{host}]"
    arguments = command(host, script, env)
    if arguments is None:
        say(f"{title}: host is not there, skipped")
        return 0, 0, 1
    began = time.monotonic()
    try:
        done = subprocess.run(
            arguments, env=env, timeout=TIMEOUT, capture_output=True, text=True, check=False
        )
        text, code = done.stdout + done.stderr, done.returncode
    except subprocess.TimeoutExpired as expired:
        text = "".join(
            part.decode(errors="replace") for part in (expired.stdout, expired.stderr) if part
        )
        code = f"no end after {TIMEOUT} s"
    counts = [
        len(re.findall(rf"^{word} ", text, re.MULTILINE)) for word in ("PASS", "FAIL", "SKIP")
    ]
    broken = (code != 0 and not counts[1]) or not any(counts)
    lines = re.findall(r"^(?:FAIL|SKIP|MEASURED) .*$", text, re.MULTILINE)
    COVERED.setdefault(host, []).extend(re.findall(r"^COVERS (\S+)", text, re.MULTILINE))
    if broken:
        counts[1] += 1
        last = text.strip().splitlines()[-1:] or ["it said nothing"]
        lines.append(f"FAIL {script.stem}: exit code {code}, {last[0][:200]}")
    say(f"{title}: {counts[0]} passed, {counts[1]} failed, {time.monotonic() - began:.1f} s")
    if counts[1]:
        output = text[-6000:].replace("\n", "\n| ")
        say(f"--- exit code {code}; output:\n| {output}\n---")
    for line in lines:
        say(f"  {line} [{host}]")
    return tuple(counts)


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> int:
    env = environment()
    chosen = sys.argv[1:]
    scripts = sorted(HERE.glob("test_*.py"))
    scripts = [s for s in scripts if not chosen or any(part in s.name for part in chosen)]
    only = env.get("PHAROS_TEST_HOSTS", "").split()
    totals = [0, 0, 0]
    for script in scripts:
        for host in hosts_of(script):
            if only and host not in only:
                continue
            for i, count in enumerate(run(host, script, env)):
                totals[i] += count
    for host, modes in COVERED.items():
        if modes:
            say(f"{host}: {len(set(modes))} nodes compared with Cycles in {len(modes)} modes")
    say(f"{totals[0]} passed, {totals[1]} failed, {totals[2]} skipped")
    return 1 if totals[1] or not totals[0] else 0


if __name__ == "__main__":
    sys.exit(main())
