"""Attributes that materials read: tables of a mesh's values, values of an instance."""

from __future__ import annotations

import numpy as np

from .. import compat

# How foreach_get names the values of a type, their number and their kind.
_TYPES = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}
_ABSENT = (0.0, 0.0, 0.0, 0.0)

# Prefixes of instance attributes: what an Object Info node tells, and properties by name.
OBJECT_INFO = "info:"
OBJECT = "object:"
INSTANCER = "instancer:"


def _rendered_color(mesh):
    """The colour attribute that an unnamed Color Attribute node reads."""
    colors = mesh.color_attributes
    index = colors.render_color_index
    return colors[index] if 0 <= index < len(colors) else None


def _raw_values(mesh, name: str):
    """(domain, rows) of an attribute or UV map; None where there is none."""
    attribute = mesh.attributes.get(name) if name else _rendered_color(mesh)
    if attribute is not None and attribute.data_type in _TYPES:
        field, components, dtype = _TYPES[attribute.data_type]
        flat = np.empty(len(attribute.data) * components, dtype)
        attribute.data.foreach_get(field, flat)
        return attribute.domain, flat.reshape(-1, components).astype(np.float32)
    layer = mesh.uv_layers.get(name) if name else None
    if layer is not None:
        return "CORNER", compat.uv_coordinates(layer, len(mesh.loops))
    return None


def read_attributes(mesh, names, report) -> list:
    """(name, domain, rows) of what the mesh has of these names: a row of 1 to 4 float32 for each
    point, corner or face.
    """
    found = []
    for name in sorted(names):
        raw = _raw_values(mesh, name)
        if raw is None:
            continue
        domain, rows = raw
        if domain not in {"POINT", "CORNER", "FACE"}:
            report.warn(mesh.name, f"Attribute {name!r} of edges is not supported.", "MESH")
            continue
        found.append((name, domain, rows))
    return found


def _as_row(value) -> tuple:
    """A number in all components, or a vector or colour; absent for anything else."""
    if isinstance(value, (bool, int, float)):
        return (float(value),) * 3 + (1.0,)
    try:
        row = [float(component) for component in value]
    except (TypeError, ValueError):
        return _ABSENT
    if not 1 <= len(row) <= 4:
        return _ABSENT
    return tuple(row + [0.0] * (3 - len(row)) + [1.0])[:4] if len(row) < 4 else tuple(row)


def _property(owner, name: str):
    """A custom property, else a property by its path."""
    if owner is None:
        return None
    if name in owner:
        return owner[name]
    try:
        return owner.path_resolve(name)
    except ValueError:
        return None


def _property_row(owner, name: str) -> tuple:
    for holder in (owner, getattr(owner, "data", None)):
        value = _property(holder, name)
        if value is not None:
            return _as_row(value)
    return _ABSENT


def _random(native, instance) -> float:
    """Instances have a number of their own; objects take it from their name."""
    if instance.is_instance:
        # Unsigned, which Python is given with a sign.
        return (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF
    return native.random_of_name(instance.object.name)


def instance_value(native, instance, name: str) -> tuple:
    """Four numbers of an instance: vector or colour, and alpha."""
    obj = instance.object
    if name.startswith(OBJECT_INFO):
        what = name.removeprefix(OBJECT_INFO)
        if what == "Color":
            return tuple(obj.color)
        if what == "Random":
            return _as_row(_random(native, instance))
        return _as_row(obj.pass_index)
    if name.startswith(INSTANCER) and instance.is_instance:
        row = _property_row(instance.parent, name.removeprefix(INSTANCER))
        if row != _ABSENT:
            return row
    return _property_row(obj, name.split(":", 1)[1])
