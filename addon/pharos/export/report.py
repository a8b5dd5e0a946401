"""What a scene holds that Pharos cannot render as given."""

from __future__ import annotations

from typing import NamedTuple


class Entry(NamedTuple):
    severity: str  # INFO, WARNING or ERROR
    object: str
    message: str
    missing: bool = False  # a file that the scene needs is not there or cannot be used


class Report:
    """Entries in order of discovery, each once."""

    def __init__(self):
        self._entries: dict[Entry, None] = {}

    def add(self, severity: str, name: str, message: str, missing: bool = False) -> None:
        self._entries[Entry(severity, name, message, missing)] = None

    def warn(self, name: str, message: str) -> None:
        self.add("WARNING", name, message)

    def info(self, name: str, message: str) -> None:
        self.add("INFO", name, message)

    def add_native(self, entries) -> None:
        """Entries of a render session."""
        for entry in entries:
            self.add(entry.severity.name.upper(), entry.object, entry.message, entry.missing)

    @property
    def entries(self) -> list[Entry]:
        return list(self._entries)
