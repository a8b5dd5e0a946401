"""What coordinate nodes and Light Falloff mean in a lamp's tree, by Blender's version.

A lamp has no mesh: what Cycles tells its nodes follows from the point P that shines, its normal N
(towards the receiver where the lamp always faces it) and the lamp's matrix.
"""

from __future__ import annotations

import math

_OWN_SPACE = 404  # from this version on lamps are objects with a space and coordinates of their own


def _rows(matrix) -> list:
    return [tuple(row)[:3] for row in matrix][:3]


class LampSpace:
    """A lamp's place, for the programs of its nodes."""

    def __init__(self, light, matrix):
        self.light = light
        self.matrix = matrix


def _dots(f, rows, vector):
    """A matrix of constants times a vector."""
    parts = []
    for row in rows:
        product = f.program.vector_math("DotProduct", f.program.constant(*row), vector)
        parts.append(f.program.slice(product, 1))
    return f.program.op("Combine", parts, 3)


def _geometry(f, name: str):
    return f.program.op("Geometry", [], 3, f.native.GeometryOutput[name])


def _point_in_lamp(f, space: LampSpace):
    inverse = space.matrix.inverted_safe()
    turned = _dots(f, _rows(inverse), _geometry(f, "Position"))
    return f.program.vector_math("Add", turned, f.program.constant(*inverse.translation))


def _normal_in_lamp(f, space: LampSpace):
    turned = _dots(f, _rows(space.matrix.transposed()), _geometry(f, "Normal"))
    return f.program.vector_math("Normalize", turned, f.program.constant(0.0, 0.0, 0.0))


def _math(f, operation: str, a, b=None):
    return f.program.math(operation, a, b if b is not None else f.program.constant(0.0))


def _on_sphere(f, x, y, z):
    """Longitude and latitude of a direction."""
    turn = _math(f, "Multiply", _math(f, "Arctan2", x, y), f.program.constant(-0.5 / math.pi))
    polar = _math(f, "Multiply", _math(f, "Arccosine", z), f.program.constant(-1.0 / math.pi))
    one = f.program.constant(1.0)
    return _math(f, "Add", turn, f.program.constant(0.5)), _math(f, "Add", polar, one)


def _on_disc(f, x, y, scale):
    """Around the middle of the unit square, x and y times `scale` away from it."""
    half = f.program.constant(0.5)
    return [_math(f, "Add", _math(f, "Multiply", part, scale), half) for part in (x, y)]


def _surface_uv(f, space: LampSpace):
    """(u, v, 0) on a lamp, since it has such coordinates."""
    light = space.light
    if light.type == "AREA":
        return _geometry(f, "Parametric")
    normal = _normal_in_lamp(f, space)
    x, y, z = (f.program.component(normal, i) for i in range(3))
    if light.type == "POINT":
        u, v = _on_sphere(f, x, y, z)
    elif light.type == "SPOT":
        wide = f.program.constant(-0.5 / math.tan(0.5 * light.spot_size))
        u, v = _on_disc(f, x, y, _math(f, "Divide", wide, z))
    else:
        # Equal areas of the cone: the radius grows as the sine of half the angle.
        one, tiny = f.program.constant(1.0), f.program.constant(1e-8)
        half_sine = _math(f, "Multiply", _math(f, "Add", z, one), f.program.constant(0.5))
        sine = _math(f, "Subtract", one, _math(f, "Multiply", z, z))
        ratio = _math(f, "Divide", half_sine, _math(f, "Maximum", sine, tiny))
        edge = f.program.constant(-0.5 / max(math.sin(0.25 * light.angle), 1e-8))
        u, v = _on_disc(f, x, y, _math(f, "Multiply", _math(f, "Sqrt", ratio), edge))
    return f.program.op("Combine", [u, v, f.program.constant(0.0)], 3)


def lamp_coordinate(f, space: LampSpace, name: str):
    """An output of Texture Coordinate; None where lamps have nothing of their own."""
    own = f.version >= _OWN_SPACE
    if name in {"Generated", "Object"}:
        return _point_in_lamp(f, space) if own else _geometry(f, "Position")
    if name == "Normal":
        # Cycles 3 says so to light sampling, and the world's normal to rays that meet a lamp.
        return _normal_in_lamp(f, space)
    if name == "UV":
        return _surface_uv(f, space) if own else f.program.constant(0.0, 0.0, 0.0)
    return None


def lamp_geometry(f, space: LampSpace, name: str):
    """An output of Geometry; None where lamps have nothing of their own."""
    if name == "Parametric" and f.version >= _OWN_SPACE:
        return _surface_uv(f, space)
    return f.program.constant(0.0, 0.0, 0.0) if name == "Tangent" else None


def light_falloff(f, node, scope, socket):
    """Strength by distance, smoothed near the lamp."""
    value = f.input(node, scope, "Strength", 1)
    length = f.program.op("LightPath", [], 1, f.native.LightPathOutput["RayLength"])
    if socket.identifier in {"Linear", "Constant"}:
        value = _math(f, "Multiply", value, length)
    if socket.identifier == "Constant":
        value = _math(f, "Multiply", value, length)
    smooth = f.input(node, scope, "Smooth", 1)
    if smooth.known != (0.0,):
        smooth = _math(f, "Maximum", smooth, f.program.constant(0.0))
        square = _math(f, "Multiply", length, length)
        near = _math(f, "Divide", square, _math(f, "Add", smooth, square))
        value = _math(f, "Multiply", value, near)
    return value
