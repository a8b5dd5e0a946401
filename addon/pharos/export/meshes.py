"""Evaluated meshes: what Blender holds of them, for the native module to gather triangles from."""

from __future__ import annotations

from contextlib import contextmanager

from .. import compat
from .attributes import read_attributes

_DOMAINS = {"FACE": "Face", "POINT": "Vertex", "CORNER": "Corner"}


@contextmanager
def evaluated_mesh(obj):
    """The mesh of an evaluated object, also while it is edited; None where it has no surface."""
    if not obj.data.is_editmode:
        yield obj.data
        return
    try:
        mesh = obj.to_mesh()
    except RuntimeError:
        mesh = None
    try:
        yield mesh
    finally:
        if mesh is not None:
            obj.to_mesh_clear()


def _slots(mesh, slot_count: int):
    """The slot of each polygon; None where all have the first."""
    slots = compat.polygon_materials(mesh) if slot_count > 1 else None
    return slots if slots is not None and slots.any() else None


def _uv_maps(mesh) -> list:
    """The map that is rendered by default comes first."""
    layers = sorted(mesh.uv_layers, key=lambda layer: not layer.active_render)
    count = len(mesh.loops)
    return [(layer.name, compat.uv_coordinates(layer, count)) for layer in layers]


def gather_mesh(native, name: str, mesh, needs, report):
    """The native module's Mesh, None without faces. `needs`: number of slots, whether with UV maps,
    names of attributes. Raises ValueError with the name for a mesh that contradicts itself.
    """
    slot_count, with_uv, names = needs
    corners = compat.triangle_corners(mesh)
    if not len(corners):
        return None
    normals = compat.mesh_normals(mesh)
    slots = _slots(mesh, slot_count)
    attributes = read_attributes(mesh, names, report) if names else []
    by_polygon = any(domain == "FACE" for _, domain, _ in attributes)
    by_polygon = by_polygon or slots is not None or normals.smooth is not None
    return native.gather_mesh(
        name,
        positions=compat.mesh_positions(mesh),
        corner_vertices=compat.corner_vertices(mesh),
        triangle_corners=corners,
        triangle_polygons=compat.triangle_polygons(mesh) if by_polygon else None,
        normal_domain=getattr(native.NormalDomain, _DOMAINS[normals.domain]),
        normals=normals.rows,
        smooth=normals.smooth,
        material_slot=slots,
        last_slot=min(max(slot_count, 1), 1 << 16) - 1,
        uv_maps=_uv_maps(mesh) if with_uv else [],
        attributes=[
            (attribute, getattr(native.NormalDomain, _DOMAINS[domain]), rows)
            for attribute, domain, rows in attributes
        ],
    )
