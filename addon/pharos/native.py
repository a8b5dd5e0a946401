"""The native module, or the reason why it cannot be used.

The module is compiled for processors with AVX2 and FMA, so the processor is asked before the module
is loaded; afterwards the module intersects one triangle, because a host may have captured its calls
to the ray tracing library.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

_NEEDED_FLAGS = ("avx2", "fma", "bmi2")


class Native(NamedTuple):
    """Exactly one of the two is set."""

    module: ModuleType | None
    problem: str


def _missing_flags(cpuinfo: str) -> list[str]:
    for line in cpuinfo.splitlines():
        if line.startswith("flags"):
            present = set(line.split(":", 1)[1].split())
            return [flag for flag in _NEEDED_FLAGS if flag not in present]
    return []


def _load() -> Native:
    try:
        missing = _missing_flags(Path("/proc/cpuinfo").read_text(encoding="ascii", errors="ignore"))
    except OSError:
        missing = []
    if missing:
        names = ", ".join(flag.upper() for flag in missing)
        return Native(None, f"This processor lacks {names}, which Pharos needs.")
    try:
        from . import _native
    except ImportError as error:
        return Native(None, f"The native module could not be loaded: {error}")
    if not _native.self_test():
        return Native(
            None,
            "Ray tracing calls of Pharos end in another library of this Blender "
            "(the self-test missed a triangle).",
        )
    return Native(_native, "")


@cache
def load() -> Native:
    """Load once; later calls return the same answer."""
    return _load()
