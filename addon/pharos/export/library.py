"""What a live session holds already: meshes and images by the version they were handed over with.

A mesh is not read again while Blender's depsgraph says nothing of it; where that cannot be relied
on (after an undo, while it is edited, for what modifiers of other types make) it is read and known
again by its content. Whatever an export did not use is forgotten, here as in the session.
"""

from __future__ import annotations

import hashlib
import itertools
from pathlib import Path

import numpy as np


def digest(parts) -> bytes:
    """Of arrays and plain values, in order."""
    state = hashlib.sha256()  # processors have instructions for it
    for part in parts:
        if isinstance(part, np.ndarray):
            state.update(repr((part.shape, part.dtype.str)).encode())
            state.update(np.ascontiguousarray(part).data)
        elif isinstance(part, bytes):
            state.update(part)
        elif isinstance(part, (list, tuple)):
            state.update(digest(part))
        else:
            state.update(repr(part).encode())
    return state.digest()


class _Kind:
    """Versions of one kind of thing, by where it was found and by its content."""

    def __init__(self, versions):
        self._versions = versions
        self._by_place: dict[tuple, int] = {}
        self._by_content: dict[bytes, int] = {}
        self._used_places: dict[tuple, int] = {}
        self._used_contents: dict[bytes, int] = {}
        self._contents: dict[int, bytes] = {}

    @property
    def is_empty(self) -> bool:
        return not self._by_content

    def begin(self) -> None:
        self._used_places, self._used_contents = {}, {}

    def end(self) -> None:
        self._by_place, self._by_content = self._used_places, self._used_contents
        self._contents = {version: content for content, version in self._by_content.items()}

    def forget_places(self) -> None:
        self._by_place = {}

    def at(self, place: tuple) -> int | None:
        """The version of what was there, unless it was forgotten."""
        version = self._by_place.get(place)
        if version is not None:
            self._used_places[place] = version
            self._used_contents[self._contents[version]] = version
        return version

    def of(self, content: bytes, place: tuple | None) -> tuple[int, bool]:
        """The version of some content, and whether the session has it."""
        known = content in self._by_content or content in self._used_contents
        version = self._used_contents.get(content) or self._by_content.get(content)
        version = version or next(self._versions)
        self._used_contents[content] = version
        if place is not None:
            self._used_places[place] = version
        return version, known


class Library:
    """Of one live session, from one export to the next."""

    def __init__(self):
        self._versions = itertools.count(1)
        self._tagged: set[int] = set()
        self.clear()

    def clear(self) -> None:
        """The session holds nothing."""
        self.meshes = _Kind(self._versions)
        self.images = _Kind(self._versions)

    @property
    def is_empty(self) -> bool:
        return self.meshes.is_empty and self.images.is_empty

    def begin(self) -> None:
        self.meshes.begin()
        self.images.begin()

    def end(self) -> None:
        """The export is complete: what it used is what the session holds from now on."""
        self.meshes.end()
        self.images.end()
        self._tagged = set()

    def forget_places(self) -> None:
        """Pointers may stand for other things than before."""
        self.meshes.forget_places()
        self.images.forget_places()

    def tag(self, updates) -> None:
        """Take note of what a depsgraph says has changed."""
        for update in updates:
            kind = update.id.bl_rna.identifier
            if kind != "Object" or update.is_updated_geometry:
                self._tagged.add(update.id.original.as_pointer())

    def mesh_place(self, obj, *needs) -> tuple | None:
        """Where an object's mesh lies; None where what lies there cannot be relied on."""
        original, data = obj.original, obj.data
        if original is None or original.type != "MESH" or original.data is None:
            return None
        if data.is_editmode or original.mode != "OBJECT":
            return None
        mesh = original.data
        if {original.as_pointer(), mesh.as_pointer()} & self._tagged:
            return None
        sizes = (len(data.vertices), len(data.loops), len(data.polygons))
        return data.as_pointer(), mesh.as_pointer(), mesh.name_full, sizes, *needs

    def image_place(self, image, path: str) -> tuple | None:
        """Likewise of an image, with all that its pixels follow from."""
        pointer = image.original.as_pointer()
        if image.is_dirty or pointer in self._tagged:
            return None
        packed = image.packed_file
        # Asking for the size of an image that lies in a file would load it.
        size = (image.generated_width, image.generated_height, image.use_generated_float)
        return (
            pointer,
            image.name_full,
            path,
            file_state(path),
            None if packed is None else (packed.as_pointer(), packed.size),
            image.source,
            image.colorspace_settings.name,
            image.alpha_mode,
            *size,
            image.generated_type,
            tuple(image.generated_color),
        )


def file_state(path: str) -> tuple | None:
    """What tells one content of a file from another; None without the file."""
    try:
        state = Path(path).stat()
    except OSError:
        return None
    return state.st_mtime_ns, state.st_size
