"""Image textures against Cycles of the same host: interpolation, extension, projection, alpha,
tiles, sequences.

Pictures are random, so that a wrong texel shows.
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import Case, check, place

_WIDTH, _HEIGHT = 7, 5


def _values(seed: int, width: int = _WIDTH, height: int = _HEIGHT) -> np.ndarray:
    """Random 8-bit RGBA rows as floats; alpha 0 and 1 among others."""
    random = np.random.default_rng(seed)
    rgba = random.integers(0, 256, (height, width, 4)).astype(np.float32) / 255.0
    rgba[0, 0, 3], rgba[1, 1, 3] = 0.0, 1.0
    return rgba


def _saved(name: str, rgba: np.ndarray, kind: str = "PNG") -> str:
    """A file with these pixels; its path."""
    is_float = kind == "OPEN_EXR"
    height, width = rgba.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    if is_float:
        image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.ascontiguousarray(rgba, np.float32).ravel())
    path = str(harness.TEMPORARY / f"{name}.{'exr' if is_float else 'png'}")
    image.filepath_raw, image.file_format = path, kind
    image.save()
    bpy.data.images.remove(image)
    return path


def _loaded(path: str, alpha: str = "STRAIGHT", space: str = "sRGB", source: str = "FILE"):
    image = bpy.data.images.load(path)
    image.source, image.alpha_mode = source, alpha
    image.colorspace_settings.name = space
    return image


def _look_up(name: str, make_image, fields, output: str = "Color", kind="ShaderNodeTexImage"):
    """An image node fed with the pixel's place, moved so that the picture is in its middle."""

    def build(owner):
        node = harness.node(owner, kind)
        node.image = make_image()
        for field, value in fields.items():
            setattr(node, field, value)
        node.image_user.frame_duration = 100
        vector, _ = place(owner)
        harness.connect(owner, vector, node.inputs["Vector"])
        found = next(s for s in node.outputs if s.identifier == output)
        return found

    return Case(name, build)


def test_interpolation_and_extension():
    path = _saved("plain", _values(1))
    cases = []
    extensions = ["REPEAT", "EXTEND", "CLIP"] + ["MIRROR"] * (harness.VERSION >= (3, 5, 0))
    for interpolation in ("Linear", "Closest", "Cubic", "Smart"):
        for extension in extensions:
            fields = {"interpolation": interpolation, "extension": extension}
            for output in ("Color", "Alpha"):
                name = f"{interpolation} {extension} {output}"
                cases.append(_look_up(name, lambda: _loaded(path), fields, output))
    check(cases)


def test_projections():
    path = _saved("projected", _values(2))
    cases = []
    for projection in ("FLAT", "BOX", "SPHERE", "TUBE"):
        for interpolation in ("Linear", "Closest"):
            fields = {"projection": projection, "interpolation": interpolation}
            fields["projection_blend"] = 0.3
            cases.append(_look_up(f"{projection} {interpolation}", lambda: _loaded(path), fields))
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        for interpolation in ("Linear", "Cubic"):
            fields = {"projection": projection, "interpolation": interpolation}
            name = f"environment {projection} {interpolation}"
            kind = "ShaderNodeTexEnvironment"
            cases.append(_look_up(name, lambda: _loaded(path), fields, kind=kind))
    check(cases)


def test_alpha_and_colour_space():
    paths = {kind: _saved(f"alpha_{kind}", _values(3), kind) for kind in ("PNG", "OPEN_EXR")}
    cases = []
    for kind, path in paths.items():
        linear = "Linear" if harness.VERSION < (4, 0, 0) else "Linear Rec.709"
        spaces = ("sRGB", "Non-Color", linear)
        for alpha in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
            for space in spaces:
                for output in ("Color", "Alpha"):
                    name = f"{kind} {alpha} {space} {output}"
                    make = lambda p=path, a=alpha, s=space: _loaded(p, a, s)  # noqa: E731
                    cases.append(_look_up(name, make, {"interpolation": "Closest"}, output))
    check(cases)


def _tiled(name: str, token: str):
    """Three tiles in files, the last one in the second row."""
    for number in (1001, 1002, 1013):
        column, row = (number - 1001) % 10 + 1, (number - 1001) // 10 + 1
        title = {"<UDIM>": f"{name}.{number}", "<UVTILE>": f"{name}.u{column}_v{row}"}[token]
        _saved(title, _values(number))
    image = bpy.data.images.load(str(harness.TEMPORARY / f"{name}.{token}.png"))
    image.source, image.alpha_mode = "TILED", "STRAIGHT"
    image.colorspace_settings.name = "sRGB"
    for number in (1002, 1013):
        if number not in [tile.number for tile in image.tiles]:
            image.tiles.new(number)
    return image


def test_tiles():
    cases = []
    for token in ("<UDIM>", "<UVTILE>"):
        for interpolation in ("Linear", "Closest", "Cubic"):
            name = f"{token} {interpolation}"
            fields = {"interpolation": interpolation}
            make = lambda t=token: _tiled(f"tiles{t[1:3]}", t)  # noqa: E731
            cases += [_look_up(f"{name} {out}", make, fields, out) for out in ("Color", "Alpha")]
    check(cases)
    assert harness.report() == [], harness.report()


def _sequence(name: str):
    for number in (3, 4, 5):
        path = _saved(f"{name}{number:04d}", _values(number))
    image = bpy.data.images.load(path.replace("0005", "0004"))
    image.source, image.alpha_mode = "SEQUENCE", "STRAIGHT"
    image.colorspace_settings.name = "sRGB"
    return image


def _sequence_case(cyclic: bool, start: int, offset: int, frames: int):
    def build(owner):
        node = harness.node(owner, "ShaderNodeTexImage")
        node.image = _sequence("frames")
        user = node.image_user
        user.use_auto_refresh, user.use_cyclic = True, cyclic
        user.frame_start, user.frame_offset, user.frame_duration = start, offset, frames
        vector, _ = place(owner)
        harness.connect(owner, vector, node.inputs["Vector"])
        return node.outputs["Color"]

    return Case(f"sequence {cyclic} {start} {offset} {frames}", build)


def test_sequences():
    """Frame 1 shows picture 3, 4 or 5 by start, offset and repetition, or one that is missing."""
    once = ((False, 1, 2, 3), (False, 0, 2, 3), (False, 1, 3, 9))
    again = ((True, -5, 2, 3), (True, -3, 3, 2))
    check([_sequence_case(*each) for each in (*once, *again)])


def test_packed_and_generated():
    path = _saved("packed", _values(4))

    def packed():
        image = _loaded(path)
        image.pack()
        return image

    def generated():
        image = bpy.data.images.new("generated", 8, 8)
        image.generated_type = "COLOR_GRID"
        return image

    check([_look_up("packed", packed, {}), _look_up("generated", generated, {})])


harness.main(globals())
