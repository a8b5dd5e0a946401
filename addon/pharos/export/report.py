"""What a scene holds that Pharos cannot render as given."""

from __future__ import annotations

from typing import NamedTuple

KINDS = ("OBJECT", "MATERIAL", "LIGHT", "WORLD", "MESH", "IMAGE", "VIEW_LAYER", "SCENE")


class Entry(NamedTuple):
    severity: str  # INFO, WARNING or ERROR
    object: str
    message: str
    kind: str = ""  # what `object` names, as in KINDS; empty where only the name is known
    tree: str = ""  # of the node, where it is in a group's tree
    node: str = ""
    missing: bool = False  # a file that the scene needs is not there or cannot be used


class Report:
    """Entries in order of discovery, each once."""

    def __init__(self):
        self._entries: dict[Entry, None] = {}

    def add(
        self, severity: str, name: str, message: str, *place: str, missing: bool = False
    ) -> None:
        """`place`: kind, tree and node, as far as they are known."""
        entry = Entry(severity, name, message, *place)._replace(missing=missing)
        self._entries[entry] = None

    def warn(self, name: str, message: str, *place: str) -> None:
        self.add("WARNING", name, message, *place)

    def info(self, name: str, message: str, *place: str) -> None:
        self.add("INFO", name, message, *place)

    def add_native(self, entries) -> None:
        """Entries of a render session."""
        for entry in entries:
            severity = entry.severity.name.upper()
            self.add(severity, entry.object, entry.message, missing=entry.missing)

    @property
    def entries(self) -> list[Entry]:
        return list(self._entries)
