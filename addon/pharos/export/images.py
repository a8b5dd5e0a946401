"""Images: packed bytes, files, or Blender's pixels; colour space and alpha by name."""

from __future__ import annotations

import bpy
import numpy as np

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

    def __init__(self, native, description, report):
        self._native = native
        self._description = description
        self._report = report
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
        fields = {"name": image.name}
        space, exact = color_space(image.colorspace_settings.name)
        alpha = _ALPHA[image.alpha_mode]
        if not exact:
            name = image.colorspace_settings.name
            self._report.warn(image.name, f"Colour space {name!r} is read as {space}.")
        if image.source in {"TILED", "SEQUENCE", "MOVIE"}:
            kind = {"TILED": "tiles", "SEQUENCE": "sequence", "MOVIE": "movie"}[image.source]
            self._report.warn(image.name, f"One picture of this {kind} is used.")
        if self._lives_in_blender(image):
            fields["pixels"] = _pixels(image)
            if image.is_float:
                # Blender holds such pixels scene-linear and multiplied by alpha.
                space = space if space == "Data" else "Linear"
                alpha = alpha if alpha in {"ChannelPacked", "None_"} else "Premultiplied"
        elif image.packed_file is not None:
            fields["data"] = image.packed_file.data
        else:
            fields["path"] = _file_path(image, user)
        return self._description.add_image(
            color_space=getattr(self._native.ImageColorSpace, space),
            alpha=getattr(self._native.ImageAlpha, alpha),
            **fields,
        )

    @staticmethod
    def _lives_in_blender(image) -> bool:
        """No file holds the pixels that Blender would render."""
        return image.source in {"GENERATED", "VIEWER"} or image.is_dirty or image.source == "MOVIE"
