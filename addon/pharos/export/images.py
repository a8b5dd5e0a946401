"""Images: packed bytes, files, or Blender's pixels; colour space and alpha by name."""

from __future__ import annotations

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


def _file_path(image, user) -> str:
    path = image.filepath_from_user(image_user=user) if user is not None else image.filepath
    return bpy.path.abspath(path, library=image.library)


class ImageTable:
    """Images of one description, each added once."""

    def __init__(self, native, description, report, library=None):
        self._native = native
        self._description = description
        self._report = report
        self._library = library
        self._indices: dict[tuple, int] = {}

    def index(self, image, user=None) -> int:
        """Index of an image; native.NONE (drawn magenta) without one."""
        if image is None:
            return self._native.NONE
        key = (image.original.as_pointer(), _file_path(image, user))
        if key not in self._indices:
            self._indices[key] = self._add(image, user)
        return self._indices[key]

    def _add(self, image, user) -> int:
        space, exact = color_space(image.colorspace_settings.name)
        alpha = _ALPHA[image.alpha_mode]
        if not exact:
            name = image.colorspace_settings.name
            self._report.warn(image.name, f"Colour space {name!r} is read as {space}.")
        if image.source in {"TILED", "SEQUENCE", "MOVIE"}:
            kind = {"TILED": "tiles", "SEQUENCE": "sequence", "MOVIE": "movie"}[image.source]
            self._report.warn(image.name, f"One picture of this {kind} is used.")
        in_blender = self._lives_in_blender(image)
        if in_blender and image.is_float:
            # Blender holds such pixels scene-linear and multiplied by alpha.
            space = space if space == "Data" else "Linear"
            alpha = alpha if alpha in {"ChannelPacked", "None_"} else "Premultiplied"
        path = _file_path(image, user)
        place = None if self._library is None else self._library.image_place(image, path)
        version = None if place is None else self._library.images.at(place)
        if version is not None:
            return self._description.add_kept_image(image.name, version)
        content = self._content(image, path, in_blender)
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
    def _content(image, path: str, in_blender: bool) -> dict:
        """The one of pixels, data and path that holds what Blender would render; {}: none does."""
        if in_blender:
            found = {"pixels": _pixels(image)}
        elif image.packed_file is not None:
            found = {"data": image.packed_file.data}
        else:
            found = {"path": path or None}
        return {name: value for name, value in found.items() if value is not None}

    @staticmethod
    def _lives_in_blender(image) -> bool:
        """No file holds the pixels that Blender would render."""
        return image.source in {"GENERATED", "VIEWER"} or image.is_dirty or image.source == "MOVIE"
