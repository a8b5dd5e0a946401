"""Lamps: Blender's values as the running version means them (no conversion here)."""

from __future__ import annotations

import numpy as np

from .. import compat
from .nodes import flatten_light

_TYPES = {"POINT": "Point", "SPOT": "Spot", "AREA": "Area", "SUN": "Sun"}


def _node_fields(context, light, matrix) -> dict:
    """What a lamp's node tree multiplies its strength with: numbers, or a program."""
    strength = compat.light_strength(light)
    if not light.use_nodes or light.node_tree is None:
        return {"strength": strength.tolist()}
    native = context.native
    program = flatten_light(native, context.images, context.report, light, matrix).program
    *factor, constant = native.mean_emission(program)
    if constant:
        return {"strength": (strength * np.array(factor, np.float64)).tolist()}
    index = context.description.add_light_program(program)
    return {"strength": strength.tolist(), "program": index}


def _shape_fields(native, light) -> dict:
    if light.type == "AREA":
        round_shape = light.shape in {"DISK", "ELLIPSE"}
        two_sizes = light.shape in {"RECTANGLE", "ELLIPSE"}
        return {
            "shape": native.AreaShape.Ellipse if round_shape else native.AreaShape.Rectangle,
            "size_u": light.size,
            "size_v": light.size_y if two_sizes else light.size,
            "spread": light.spread,
        }
    if light.type == "SUN":
        return {"angle": light.angle}
    fields = {
        "radius": light.shadow_soft_size,
        "soft_falloff": getattr(light, "use_soft_falloff", True),
    }
    if light.type == "SPOT":
        fields |= {"spot_angle": light.spot_size, "spot_blend": light.spot_blend}
    return fields


def light_fields(context, light, matrix) -> dict:
    """Arguments of add_light but for name, place and visibility."""
    native, report = context.native, context.report
    cycles = getattr(light, "cycles", None)
    if light.type == "AREA" and getattr(cycles, "is_portal", False):
        return {"type": native.LightType.Area, "is_portal": True, **_shape_fields(native, light)}
    if light.type == "SPOT" and light.use_square:
        report.info(light.name, "Spot lights are round.", "LIGHT")
    return {
        "type": getattr(native.LightType, _TYPES[light.type]),
        **_node_fields(context, light, matrix),
        "normalize": getattr(light, "normalize", True),
        "cast_shadow": compat.light_casts_shadow(light),
        "use_mis": getattr(cycles, "use_multiple_importance_sampling", True),
        "max_bounces": getattr(cycles, "max_bounces", 1024),
        **_shape_fields(native, light),
    }
