"""Images: packed bytes, files, or Blender's pixels; colour space and alpha by name."""

from __future__ import annotations

import re
from pathlib import Path

import bpy
import numpy as np

from .library import digest, file_state

_DATA_SPACES = {"Non-Color", "Raw", "Generic Data", "Non-Colour Data"}
_LINEAR_SPACES = {
    "Linear",
    "Linear Rec.709",
    "Linear BT.709",
    "Linear BT.709 I-D65",
    "scene_linear",
}
_ALPHA = {
    "STRAIGHT": "Straight",
    "PREMUL": "Premultiplied",
    "CHANNEL_PACKED": "ChannelPacked",
    "NONE": "None_",
}


def color_space(name: str) -> tuple[str, bool]:
    """Our name of a colour space, and whether it is the same one."""
    if name in _DATA_SPACES:
        return "Data", True
    if name in _LINEAR_SPACES:
        return "Linear", True
    if name == "sRGB":
        return "Srgb", True
    return ("Linear" if name.lower().startswith("linear") else "Srgb"), False


def _pixels(image) -> np.ndarray | None:
    width, height = image.size
    channels = image.channels
    if not width or not height or not 1 <= channels <= 4:
        return None
    flat = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(flat)
    source = flat.reshape(height, width, channels)
    if channels == 4:
        return source
    out = np.ones((height, width, 4), np.float32)
    if channels == 3:
        out[..., :3] = source
    else:
        out[..., :3] = source[..., :1]
        out[..., 3] = source[..., 1] if channels == 2 else 1.0
    return out


def picture_of_frame(user, frame: int) -> int:
    """The number of the picture that a sequence shows in a frame of the scene."""
    length = user.frame_duration
    place = frame - user.frame_start + 1
    if user.use_cyclic and length > 0:
        place = (place - 1) % length + 1
    return min(max(place, 0), length) + user.frame_offset


def sequence_path(path: str, number: int) -> str:
    """The path with the last digits of its name, extension aside, replaced by a number."""
    folder, name = path[: len(path) - len(Path(path).name)], Path(path).name
    stem, suffix = Path(name).stem, Path(name).suffix
    found = re.match(r"^(.*?)(\d+)(\D*)$", stem)
    if found is None:
        return path
    head, digits, tail = found.groups()
    return f"{folder}{head}{number:0{len(digits)}d}{tail}{suffix}"


def tile_path(path: str, number: int) -> str:
    """The file of a tile: <UDIM> is its number, <UVTILE> the place it begins at, from 1."""
    column, row = (number - 1001) % 10, (number - 1001) // 10
    return path.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")


class ImageTable:
    """Images of one description, each added once."""

    def __init__(self, native, description, report, frame: int = 1, library=None):
        self._native = native
        self._description = description
        self._report = report
        self._frame = frame
        self._library = library
        self._indices: dict[tuple, int] = {}

    def index(self, image, user=None, tile: int = 1001) -> int:
        """Index of an image (of a tiled one: of a tile); native.NONE, drawn magenta, without."""
        if image is None:
            return self._native.NONE
        path = self._file_path(image, user, tile)
        key = (image.original.as_pointer(), path, tile)
        if key not in self._indices:
            self._indices[key] = self._add(image, path, tile)
        return self._indices[key]

    def tiles(self, image, user=None) -> list:
        """The tiles of a tiled image."""
        if image is None or image.source != "TILED":
            return []
        make = self._native.ImageTile
        return [
            make(tile.number - 1001, self.index(image, user, tile.number)) for tile in image.tiles
        ]

    def _file_path(self, image, user, tile: int) -> str:
        path = image.filepath
        if image.source == "SEQUENCE" and user is not None:
            path = sequence_path(path, picture_of_frame(user, self._frame))
        elif image.source == "TILED":
            path = tile_path(path, tile)
        return bpy.path.abspath(path, library=image.library)

    def _packed(self, image, tile: int):
        """The packed file of an image or of one of its tiles."""
        if image.source != "TILED" or not image.packed_files:
            return image.packed_file
        numbers = [entry.number for entry in image.tiles]
        place = numbers.index(tile)
        return image.packed_files[place].packed_file if place < len(image.packed_files) else None

    def _add(self, image, path: str, tile: int) -> int:
        space, exact = color_space(image.colorspace_settings.name)
        alpha = _ALPHA[image.alpha_mode]
        if not exact:
            name = image.colorspace_settings.name
            self._report.warn(image.name, f"Colour space {name!r} is read as {space}.", "IMAGE")
        if image.source == "MOVIE":
            self._report.warn(image.name, "One picture of this movie is used.", "IMAGE")
        in_blender = self._lives_in_blender(image)
        if in_blender and image.source == "TILED":
            message = "Of tiles that are not saved, the first is used."
            self._report.warn(image.name, message, "IMAGE")
        if in_blender and image.is_float:
            # Blender holds such pixels scene-linear and multiplied by alpha.
            space = space if space == "Data" else "Linear"
            alpha = alpha if alpha in {"ChannelPacked", "None_"} else "Premultiplied"
        place = None if self._library is None else self._library.image_place(image, path)
        version = None if place is None else self._library.images.at(place)
        if version is not None:
            return self._description.add_kept_image(image.name, version)
        content = self._pixels(image) if in_blender else self._file(image, path, tile)
        if self._library is not None and content:
            parts = [image.name_full, space, alpha, *content.items(), file_state(path)]
            version, known = self._library.images.of(digest(parts), place)
            if known:
                return self._description.add_kept_image(image.name, version)
        return self._description.add_image(
            name=image.name,
            color_space=getattr(self._native.ImageColorSpace, space),
            alpha=getattr(self._native.ImageAlpha, alpha),
            version=version or 0,
            **content,
        )

    @staticmethod
    def _pixels(image) -> dict:
        pixels = _pixels(image)
        return {} if pixels is None else {"pixels": pixels}

    def _file(self, image, path: str, tile: int) -> dict:
        """The one of data and path that leads to the picture; {}: none does."""
        packed = self._packed(image, tile)
        if packed is not None:
            return {"data": packed.data}
        return {"path": path} if path else {}

    @staticmethod
    def _lives_in_blender(image) -> bool:
        """No file holds the pixels that Blender would render."""
        return image.source in {"GENERATED", "VIEWER"} or image.is_dirty or image.source == "MOVIE"
