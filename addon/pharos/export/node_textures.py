"""Procedural textures: noise, cells, waves, bricks. Handlers as in node_values."""

from __future__ import annotations

from .node_coordinates import camel, vector_or_generated

_DIMENSIONS = {"1D": 0, "2D": 1, "3D": 2, "4D": 3}
_LEGACY = 400  # before this version noise had no lacunarity and did not repeat


def _scalar(f, node, scope, name: str, fallback: float = 0.0):
    """An input that some versions do not have."""
    if any(socket.identifier == name for socket in node.inputs):
        return f.input(node, scope, name, 1)
    return f.program.constant(fallback)


def _place(f, node, scope) -> list:
    """Vector, W and scale; what the dimensions do not ask for is not evaluated."""
    dimensions = node.bl_rna.properties.get("noise_dimensions") and node.noise_dimensions
    dimensions = dimensions or getattr(node, "voronoi_dimensions", None)
    dimensions = dimensions or getattr(node, "musgrave_dimensions", "3D")
    zero = f.program.constant(0.0, 0.0, 0.0)
    vector = zero if dimensions == "1D" else vector_or_generated(f, node, scope)
    needs_w = dimensions in {"1D", "4D"}
    w = f.input(node, scope, "W", 1) if needs_w else f.program.constant(0.0)
    return [_DIMENSIONS[dimensions], vector, w, _scalar(f, node, scope, "Scale", 1.0)]


def _noise(f, node, scope, socket):
    mode, *operands = _place(f, node, scope)
    mode |= 4 * f.native.FractalType[camel(getattr(node, "noise_type", "FBM"))]
    if getattr(node, "normalize", True):
        mode |= f.native.NORMALIZE_NOISE_BIT
    if f.version < _LEGACY:
        mode |= f.native.LEGACY_NOISE_BIT
    operands += [
        _scalar(f, node, scope, "Detail"),
        _scalar(f, node, scope, "Roughness"),
        _scalar(f, node, scope, "Lacunarity", 2.0),
        _scalar(f, node, scope, "Offset"),
        _scalar(f, node, scope, "Gain", 1.0),
        _scalar(f, node, scope, "Distortion"),
    ]
    if socket.identifier == "Color":
        return f.program.op("Noise", operands, 3, mode | f.native.COLOR_NOISE_BIT)
    return f.program.op("Noise", operands, 1, mode)


def _musgrave(f, node, scope, socket):
    mode, *operands = _place(f, node, scope)
    mode |= 4 * f.native.FractalType[camel(node.musgrave_type)]
    names = ("Detail", "Dimension", "Lacunarity", "Offset", "Gain")
    operands += [_scalar(f, node, scope, name) for name in names]
    return f.program.op("Musgrave", operands, 1, mode)


def _white_noise(f, node, scope, socket):
    dimensions = node.noise_dimensions
    zero = f.program.constant(0.0, 0.0, 0.0)
    vector = zero if dimensions == "1D" else f.input(node, scope, "Vector", 3)
    w = f.input(node, scope, "W", 1)
    value = f.program.op("WhiteNoise", [vector, w], 4, _DIMENSIONS[dimensions])
    return f.program.component(value, 3) if socket.identifier == "Value" else value


_CELL_OUTPUTS = {"Distance": (0, 1), "Radius": (0, 1), "Color": (1, 3), "Position": (4, 3)}
_CELL_OUTPUTS["W"] = (7, 1)


def _voronoi(f, node, scope, socket):
    mode, *operands = _place(f, node, scope)
    mode |= 4 * f.native.CellFeature[camel(node.feature)]
    # Edges and spheres are measured straight.
    if node.feature in {"F1", "F2", "SMOOTH_F1"}:
        mode |= 32 * f.native.CellMetric[camel(node.distance)]
    if getattr(node, "normalize", False):
        mode |= f.native.NORMALIZE_CELLS_BIT
    operands += [
        _scalar(f, node, scope, "Detail"),
        _scalar(f, node, scope, "Roughness"),
        _scalar(f, node, scope, "Lacunarity", 2.0),
        _scalar(f, node, scope, "Smoothness"),
        _scalar(f, node, scope, "Exponent", 1.0),
        _scalar(f, node, scope, "Randomness", 1.0),
    ]
    value = f.program.op("Voronoi", operands, 8, mode)
    first, size = _CELL_OUTPUTS[socket.identifier]
    return f.program.part(value, first, size)


_DIRECTIONS = {"X": 0, "Y": 1, "Z": 2, "DIAGONAL": 3, "SPHERICAL": 3}


def _wave(f, node, scope, socket):
    rings = node.wave_type == "RINGS"
    direction = node.rings_direction if rings else node.bands_direction
    mode = int(rings) + 2 * _DIRECTIONS[direction]
    mode |= 8 * f.native.WaveProfile[camel(node.wave_profile)]
    if f.version < _LEGACY:
        mode |= f.native.LEGACY_NOISE_BIT
    names = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
    operands = [vector_or_generated(f, node, scope)]
    operands += [f.input(node, scope, name, 1) for name in names]
    value = f.program.op("Wave", operands, 1, mode)
    return f.program.op("ScalarToVector", [value], 3) if socket.identifier == "Color" else value


def _magic(f, node, scope, socket):
    operands = [vector_or_generated(f, node, scope)]
    operands += [f.input(node, scope, name, 1) for name in ("Scale", "Distortion")]
    value = f.program.op("Magic", operands, 4, node.turbulence_depth)
    return f.program.component(value, 3) if socket.identifier == "Fac" else value


def _brick(f, node, scope, socket):
    scalars = ("Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height")
    operands = [vector_or_generated(f, node, scope)]
    operands += [f.input(node, scope, name, 3) for name in ("Color1", "Color2", "Mortar")]
    operands += [f.input(node, scope, name, 1) for name in scalars]
    fields = (node.offset, node.squash, node.offset_frequency, node.squash_frequency)
    operands += [f.program.constant(value) for value in fields]
    value = f.program.op("Brick", operands, 4)
    return f.program.component(value, 3) if socket.identifier == "Fac" else value


def _checker(f, node, scope, socket):
    vector = vector_or_generated(f, node, scope)
    colors = [f.input(node, scope, name, 3) for name in ("Color1", "Color2")]
    value = f.program.op("Checker", [vector, *colors, f.input(node, scope, "Scale", 1)], 4)
    return f.program.component(value, 3) if socket.identifier == "Fac" else value


def _gradient(f, node, scope, socket):
    vector = vector_or_generated(f, node, scope)
    mode = f.native.GradientMode[camel(node.gradient_type)]
    return f.program.op("Gradient", [vector], 1, mode)


TEXTURES = {
    "ShaderNodeTexNoise": _noise,
    "ShaderNodeTexMusgrave": _musgrave,
    "ShaderNodeTexWhiteNoise": _white_noise,
    "ShaderNodeTexVoronoi": _voronoi,
    "ShaderNodeTexWave": _wave,
    "ShaderNodeTexMagic": _magic,
    "ShaderNodeTexBrick": _brick,
    "ShaderNodeTexChecker": _checker,
    "ShaderNodeTexGradient": _gradient,
}
