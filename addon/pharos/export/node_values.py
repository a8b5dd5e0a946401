"""Value nodes: the operations behind an output. A handler gets (flattener, node, scope, socket) and
returns a Value, or None for an output it does not have.
"""

from __future__ import annotations

import numpy as np

from .lamp_nodes import light_falloff
from .node_coordinates import COORDINATES, camel, surface_normal, uv
from .node_images import IMAGES
from .node_textures import TEXTURES
from .tree import input_by_identifier

_TABLE_ROWS = 256


def _rgb(f, node, scope, socket):
    return f.program.constant(*node.outputs[0].default_value[:3])


def _value(f, node, scope, socket):
    return f.program.constant(node.outputs[0].default_value)


# Arithmetic.


def _math(f, node, scope, socket):
    mode = f.native.MathMode.get(camel(node.operation))
    if mode is None:
        return None
    operands = [f.input(node, scope, s.identifier, 1) for s in node.inputs]
    clamp = f.native.CLAMP_BIT if node.use_clamp else 0
    return f.program.op("Math", operands, 1, mode | clamp)


def _vector_math(f, node, scope, socket):
    mode = f.native.VectorMathMode.get(camel(node.operation))
    if mode is None:
        return None
    operands = [f.input(node, scope, s.identifier, 3) for s in node.inputs[:3]]
    operands.append(f.input(node, scope, "Scale", 1))
    value = f.program.op("VectorMath", operands, 3, mode)
    return f.program.slice(value, 1) if socket.identifier == "Value" else value


def _mix_mode(f, node, clamp_factor: bool, clamp_result: bool) -> int | None:
    mode = f.native.BlendMode.get(camel(node.blend_type))
    if mode is None:
        return None
    mode |= f.native.CLAMP_FACTOR_BIT if clamp_factor else 0
    return mode | (f.native.CLAMP_BIT if clamp_result else 0)


def _mix_rgb(f, node, scope, socket):
    mode = _mix_mode(f, node, True, node.use_clamp)
    if mode is None:
        return None
    operands = [
        f.input(node, scope, "Fac", 1),
        f.input(node, scope, "Color1", 3),
        f.input(node, scope, "Color2", 3),
    ]
    return f.program.op("MixColor", operands, 3, mode)


def _mix_vector(f, node, scope):
    a, b = (f.input(node, scope, name, 3) for name in ("A_Vector", "B_Vector"))
    factor_bit = f.native.CLAMP_FACTOR_BIT if node.clamp_factor else 0
    if node.factor_mode == "UNIFORM":
        factor = f.input(node, scope, "Factor_Float", 1)
        return f.program.op("MixColor", [factor, a, b], 3, f.native.BlendMode["Mix"] | factor_bit)
    factor = f.input(node, scope, "Factor_Vector", 3)
    parts = []
    for i in range(3):
        operands = [f.program.component(value, i) for value in (factor, a, b)]
        parts.append(f.program.op("MixFloat", operands, 1, factor_bit))
    return f.program.op("Combine", parts, 3)


def _mix(f, node, scope, socket):
    factor_bit = f.native.CLAMP_FACTOR_BIT if node.clamp_factor else 0
    if node.data_type == "FLOAT":
        names = ("Factor_Float", "A_Float", "B_Float")
        operands = [f.input(node, scope, name, 1) for name in names]
        return f.program.op("MixFloat", operands, 1, factor_bit)
    if node.data_type == "VECTOR":
        return _mix_vector(f, node, scope)
    if node.data_type != "RGBA":
        return None
    mode = _mix_mode(f, node, node.clamp_factor, node.clamp_result)
    if mode is None:
        return None
    operands = [f.input(node, scope, "Factor_Float", 1)]
    operands += [f.input(node, scope, name, 3) for name in ("A_Color", "B_Color")]
    return f.program.op("MixColor", operands, 3, mode)


def _mapping(f, node, scope, socket):
    names = ("Vector", "Location", "Rotation", "Scale")
    operands = [f.input(node, scope, name, 3) for name in names]
    mode = f.native.MappingMode[camel(node.vector_type)]
    return f.program.op("Mapping", operands, 3, mode)


_SMOOTH = {"SMOOTHSTEP": "SmoothStep", "SMOOTHERSTEP": "SmootherStep"}


def _map_range(f, node, scope, socket):
    mode = f.native.MapRangeMode[
        _SMOOTH.get(node.interpolation_type) or camel(node.interpolation_type)
    ]
    if node.clamp:
        mode |= f.native.CLAMP_BIT
    if node.data_type == "FLOAT_VECTOR":
        names = ("From_Min", "From_Max", "To_Min", "To_Max", "Steps")
        operands = [f.input(node, scope, "Vector", 3)]
        operands += [f.input(node, scope, f"{name}_FLOAT3", 3) for name in names]
        return f.program.op("VectorMapRange", operands, 3, mode)
    names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
    operands = [f.input(node, scope, name, 1) for name in names]
    return f.program.op("MapRange", operands, 1, mode)


def _clamp(f, node, scope, socket):
    operands = [f.input(node, scope, name, 1) for name in ("Value", "Min", "Max")]
    return f.program.op("Clamp", operands, 1, 1 if node.clamp_type == "RANGE" else 0)


def _vector_rotate(f, node, scope, socket):
    mode = f.native.VectorRotateMode[camel(node.rotation_type)]
    mode |= f.native.INVERT_BIT if node.invert else 0
    operands = [f.input(node, scope, name, 3) for name in ("Vector", "Center", "Axis")]
    operands += [f.input(node, scope, "Angle", 1), f.input(node, scope, "Rotation", 3)]
    return f.program.op("VectorRotate", operands, 3, mode)


_SPACES = {"WORLD": 0, "OBJECT": 1, "CAMERA": 2}
_TRANSFORMED = {"VECTOR": 0, "POINT": 1, "NORMAL": 2}


def _vector_transform(f, node, scope, socket):
    mode = _SPACES[node.convert_from] + 3 * _SPACES[node.convert_to]
    mode += 9 * _TRANSFORMED[node.vector_type]
    return f.program.op("VectorTransform", [f.input(node, scope, "Vector", 3)], 3, mode)


# Colour.


def _separate_xyz(f, node, scope, socket):
    value = f.input(node, scope, node.inputs[0].identifier, 3)
    return f.program.component(value, list(node.outputs).index(socket))


def _combine_xyz(f, node, scope, socket):
    return f.program.op("Combine", [f.input(node, scope, s.identifier, 1) for s in node.inputs], 3)


def _color_model(f, node) -> int:
    fixed = {"ShaderNodeSeparateHSV": "HSV", "ShaderNodeCombineHSV": "HSV"}
    name = fixed.get(node.bl_idname) or getattr(node, "mode", "RGB")
    return next(v for k, v in f.native.ColorModel.items() if k.upper().rstrip("_") == name)


def _separate_color(f, node, scope, socket):
    color = f.input(node, scope, node.inputs[0].identifier, 3)
    value = f.program.op("SeparateColor", [color], 3, _color_model(f, node))
    return f.program.component(value, list(node.outputs).index(socket))


def _combine_color(f, node, scope, socket):
    operands = [f.input(node, scope, s.identifier, 1) for s in node.inputs]
    return f.program.op("CombineColor", operands, 3, _color_model(f, node))


def _operation(code: str, inputs, size: int):
    """A node whose inputs are the operation's operands: (identifier, size)."""

    def handler(f, node, scope, socket):
        operands = [f.input(node, scope, name, width) for name, width in inputs]
        return f.program.op(code, operands, size)

    return handler


def _ramp(f, node, scope, socket):
    ramp = node.color_ramp
    rows = [ramp.evaluate(i / (_TABLE_ROWS - 1)) for i in range(_TABLE_ROWS)]
    mode = f.program.add_table(rows)
    mode |= f.native.STEP_BIT if ramp.interpolation == "CONSTANT" else 0
    value = f.program.op("Ramp", [f.input(node, scope, "Fac", 1)], 4, mode)
    return f.program.component(value, 3) if socket.identifier == "Alpha" else value


def _curve_tables(mapping, combined_first: bool):
    """Rows of the three curves over their range; the fourth (combined) curve comes first."""
    mapping.initialize()
    curves = list(mapping.curves)
    ends = [point.location[0] for curve in curves for point in curve.points]
    low, high = min(0.0, *ends), max(1.0, *ends)
    rows = np.ones((_TABLE_ROWS, 4))
    for i, x in enumerate(np.linspace(low, high, _TABLE_ROWS)):
        if combined_first:
            x = mapping.evaluate(curves[3], x)
        for k in range(3):
            rows[i, k] = mapping.evaluate(curves[min(k, len(curves) - 1)], x)
    return rows, low, high


def _curves(factor: str, value: str, combined_first: bool):
    def handler(f, node, scope, socket):
        rows, low, high = _curve_tables(node.mapping, combined_first)
        mode = f.program.add_table(rows)
        mode |= f.native.EXTRAPOLATE_BIT if node.mapping.extend == "EXTRAPOLATED" else 0
        operands = [
            f.input(node, scope, factor, 1),
            f.input(node, scope, value, 3),
            f.program.constant(low),
            f.program.constant(high),
        ]
        result = f.program.op("Curves", operands, 3, mode)
        return f.program.slice(result, 1) if socket.type == "VALUE" else result

    return handler


# Shading.


def _layer_weight(f, node, scope, socket):
    operands = [f.input(node, scope, "Blend", 1), f.normal(node, scope)]
    value = f.program.op("LayerWeight", operands, 2)
    return f.program.component(value, 1 if socket.identifier == "Facing" else 0)


def _fresnel(f, node, scope, socket):
    operands = [f.input(node, scope, "IOR", 1), f.normal(node, scope)]
    return f.program.op("Fresnel", operands, 1)


def _normal_direction(f, node, scope, socket):
    """The node's own direction, or the cosine of its angle to the normal that is given."""
    # Cycles takes the direction as it is, not at unit length.
    direction = f.program.constant(*node.outputs["Normal"].default_value)
    if socket.identifier == "Normal":
        return direction
    zero = f.program.constant(0.0, 0.0, 0.0)
    given = f.input(node, scope, "Normal", 3)
    given = f.program.vector_math("Normalize", given, zero)
    return f.program.slice(f.program.vector_math("DotProduct", direction, given), 1)


def _normal_map(f, node, scope, socket):
    space = node.space.removeprefix("BLENDER_")
    if space != node.space:
        f.unsupported(node, f"space {node.space!r}")
    operands = [f.input(node, scope, "Strength", 1), f.input(node, scope, "Color", 3)]
    if space == "TANGENT" and node.uv_map:
        operands.append(uv(f, node.uv_map))
    return f.program.op("NormalMap", operands, 3, f.native.NormalMapSpace[camel(space)])


def bumped_normal(f, operands, width: float, height, inverted: bool = False):
    """The normal that heights make: `height()` gives them where the program looks; `operands` are
    strength and distance, then the normal.
    """
    before, heights = f.program.step, []
    for step in ((0.0, 0.0), (width, 0.0), (0.0, width)):
        f.program.step = step
        heights.append(height())
    f.program.step = before
    strength, distance, normal = operands
    operands = [strength, distance, f.program.constant(width), *heights, normal]
    return f.program.op("Bump", operands, 3, f.native.INVERT_BIT if inverted else 0)


def _bump(f, node, scope, socket):
    normal = f.normal(node, scope)
    if not f.linked(node, scope, "Height"):
        if normal != f.program.default_normal:
            return normal
        return surface_normal(f)
    operands = [f.input(node, scope, name, 1) for name in ("Strength", "Distance")]
    # How far apart heights are compared, in pixels; a setting of newer versions.
    width = input_by_identifier(node, "Filter Width")
    width = 1.0 if width is None else max(width.default_value, 1e-3)
    return bumped_normal(
        f, [*operands, normal], width, lambda: f.input(node, scope, "Height", 1), node.invert
    )


def displaced_height(f, source):
    """What a Displacement node raises the surface by; None for another node."""
    node, _, scope = source
    if node.bl_idname != "ShaderNodeDisplacement":
        return None
    height = f.input(node, scope, "Height", 1)
    middle = f.input(node, scope, "Midlevel", 1)
    above = f.program.math("Subtract", height, middle)
    return f.program.math("Multiply", above, f.input(node, scope, "Scale", 1))


def _occlusion(f, node, scope, socket):
    """As if nothing were near."""
    f.unsupported(node)
    if socket.identifier == "Color":
        return f.input(node, scope, "Color", 3)
    return f.program.constant(1.0)


def _bevel(f, node, scope, socket):
    """Edges stay sharp."""
    f.unsupported(node)
    normal = f.normal(node, scope)
    return surface_normal(f) if normal == f.program.default_normal else normal


def _absent(*values: float):
    """A node of what is never there: reported, with the values of nothing."""

    def handler(f, node, scope, socket):
        f.unsupported(node)
        vector = socket.type in {"RGBA", "VECTOR"}
        return f.program.constant(*(values or (0.0,)) * (3 if vector else 1))

    return handler


VALUES = {
    **COORDINATES,
    **IMAGES,
    **TEXTURES,
    "ShaderNodeRGB": _rgb,
    "ShaderNodeValue": _value,
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeMix": _mix,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeVectorRotate": _vector_rotate,
    "ShaderNodeVectorTransform": _vector_transform,
    "ShaderNodeSeparateXYZ": _separate_xyz,
    "ShaderNodeSeparateRGB": _separate_xyz,
    "ShaderNodeCombineXYZ": _combine_xyz,
    "ShaderNodeCombineRGB": _combine_xyz,
    "ShaderNodeSeparateColor": _separate_color,
    "ShaderNodeSeparateHSV": _separate_color,
    "ShaderNodeCombineColor": _combine_color,
    "ShaderNodeCombineHSV": _combine_color,
    "ShaderNodeInvert": _operation("Invert", (("Fac", 1), ("Color", 3)), 3),
    "ShaderNodeGamma": _operation("Gamma", (("Color", 3), ("Gamma", 1)), 3),
    "ShaderNodeBrightContrast": _operation(
        "BrightContrast", (("Color", 3), ("Bright", 1), ("Contrast", 1)), 3
    ),
    "ShaderNodeHueSaturation": _operation(
        "HueSaturation",
        (("Hue", 1), ("Saturation", 1), ("Value", 1), ("Fac", 1), ("Color", 3)),
        3,
    ),
    "ShaderNodeRGBToBW": _operation("Luminance", (("Color", 3),), 1),
    "ShaderNodeBlackbody": _operation("Blackbody", (("Temperature", 1),), 3),
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _curves("Fac", "Color", combined_first=True),
    "ShaderNodeVectorCurve": _curves("Fac", "Vector", combined_first=False),
    "ShaderNodeFloatCurve": _curves("Factor", "Value", combined_first=False),
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
    "ShaderNodeNormal": _normal_direction,
    "ShaderNodeNormalMap": _normal_map,
    "ShaderNodeBump": _bump,
    "ShaderNodeAmbientOcclusion": _occlusion,
    "ShaderNodeBevel": _bevel,
    "ShaderNodeWireframe": _absent(),
    "ShaderNodeHairInfo": _absent(),
    "ShaderNodeParticleInfo": _absent(),
    "ShaderNodePointInfo": _absent(),
    "ShaderNodeVolumeInfo": _absent(),
    "ShaderNodeLightFalloff": light_falloff,
}
