"""Lamps: Blender's values as the running version means them (no conversion here)."""

from __future__ import annotations

import numpy as np

from .. import compat

_TYPES = {"POINT": "Point", "SPOT": "Spot", "AREA": "Area", "SUN": "Sun"}


def _linked_or_value(socket, fallback):
    return fallback if socket is None or socket.is_linked else socket.default_value


def node_factor(light, report) -> np.ndarray:
    """What a lamp's node tree multiplies its strength with: a constant Emission."""
    if not light.use_nodes or light.node_tree is None:
        return np.ones(3)
    output = light.node_tree.get_output_node("CYCLES")
    links = output.inputs["Surface"].links if output is not None else ()
    if not links:
        return np.zeros(3)
    node = links[0].from_node
    if node.bl_idname != "ShaderNodeEmission":
        report.warn(light.name, f"Node {node.name!r} of a light is not supported.")
        return np.ones(3)
    color, strength = node.inputs["Color"], node.inputs["Strength"]
    for socket in (color, strength):
        if socket.is_linked:
            source = socket.links[0].from_node.name
            report.warn(light.name, f"Node {source!r} of a light is not supported.")
    color = np.array(_linked_or_value(color, (1.0, 1.0, 1.0, 1.0)), np.float64)[:3]
    return color * _linked_or_value(strength, 1.0)


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


def light_fields(native, light, report) -> dict | None:
    """Arguments of add_light but for name, place and visibility; None: emits nothing itself."""
    cycles = getattr(light, "cycles", None)
    if light.type == "AREA" and getattr(cycles, "is_portal", False):
        report.info(light.name, "Light portals are not used.")
        return None
    if light.type == "SPOT" and light.use_square:
        report.info(light.name, "Spot lights are round.")
    strength = compat.light_strength(light) * node_factor(light, report)
    return {
        "type": getattr(native.LightType, _TYPES[light.type]),
        "strength": strength.tolist(),
        "normalize": getattr(light, "normalize", True),
        "cast_shadow": compat.light_casts_shadow(light),
        "use_mis": getattr(cycles, "use_multiple_importance_sampling", True),
        "max_bounces": getattr(cycles, "max_bounces", 1024),
        **_shape_fields(native, light),
    }
