"""What a figure depends on beside the code: the day, the machine, the versions."""

import datetime
import hashlib
import importlib.metadata
import os
import platform
import re
import subprocess
from pathlib import Path

from harness.scenes import ROOT


def processor():
    """The processor's name and the number of cores this process may use."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        name = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE).group(1)
    except (OSError, AttributeError):
        name = platform.processor() or platform.machine()
    return f"{' '.join(name.split())}, {len(os.sched_getaffinity(0))} cores"


def _pharos_version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    version = re.search(r"project\(pharos VERSION ([\d.]+)", text).group(1)
    done = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short=10", "HEAD"],
                          capture_output=True, text=True, check=False)
    commit = done.stdout.strip()
    return f"{version} ({commit})" if commit else version


def _old_blender():
    done = subprocess.run([os.environ.get("BLENDER", "blender"), "--version"],
                          capture_output=True, text=True, check=False)
    found = re.search(r"Blender ([\d.]+)", done.stdout)
    return found.group(1) if found else "unknown"


def versions(programs):
    """Of the programs that take part."""
    found = {"Pharos": _pharos_version()} if "pharos" in programs else {}
    if "cycles" in programs:
        found["bpy"] = importlib.metadata.version("bpy")
    if "cycles-3.4" in programs:
        found["Blender"] = _old_blender()
    return found


def today():
    return datetime.date.today().strftime("%-d %B %Y")


def content(path):
    """Changes when a file does."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]
