"""Evaluated meshes as arrays: triangles, normals of the cheapest domain, materials, UV maps."""

from __future__ import annotations

from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from .. import compat

_DOMAINS = {"FACE": "Face", "POINT": "Vertex", "CORNER": "Corner"}


class MeshArrays(NamedTuple):
    """What add_mesh takes."""

    positions: np.ndarray
    triangles: np.ndarray
    domain: str
    normals: np.ndarray | None
    material_indices: np.ndarray | None
    uv_maps: list
    attributes: tuple = ()


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


def face_normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit geometric normals; zero for degenerate triangles."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    with np.errstate(all="ignore"):
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.where(length > 0.0, normals / length, 0.0).astype(np.float32)


def _corner_normals(mesh, positions, triangles, corners) -> np.ndarray:
    """Corner normals, flat triangles with their own plane's as they are not interpolated."""
    normals = compat.corner_normals(mesh)[corners]
    smooth = compat.polygon_smooth(mesh)
    if not smooth.all():
        flat = ~smooth[compat.triangle_polygons(mesh)]
        normals[flat] = face_normals(positions, triangles[flat])[:, None, :]
    return normals.reshape(-1, 3)


def _normals(mesh, positions, triangles, corners):
    domain = compat.normal_domain(mesh)
    if domain == "FACE":
        return domain, None
    if domain == "POINT":
        return domain, compat.vertex_normals(mesh)
    return domain, _corner_normals(mesh, positions, triangles, corners)


def _material_indices(mesh, slot_count: int) -> np.ndarray | None:
    if slot_count < 2:
        return None
    per_polygon = compat.polygon_materials(mesh)
    if not per_polygon.any():
        return None
    clamped = np.clip(per_polygon, 0, slot_count - 1).astype(np.uint16)
    return clamped[compat.triangle_polygons(mesh)]


def _uv_maps(mesh, corners: np.ndarray) -> list:
    """The map that is rendered by default comes first."""
    layers = sorted(mesh.uv_layers, key=lambda layer: not layer.active_render)
    count = len(mesh.loops)
    flat = corners.ravel()
    found = []
    for layer in layers:
        # Both coordinates at once, as one number of 64 bits.
        pairs = compat.uv_coordinates(layer, count).view(np.int64).ravel()
        found.append((layer.name, pairs.take(flat).view(np.float32).reshape(-1, 2)))
    return found


def read_mesh(mesh, slot_count: int, with_uv: bool) -> MeshArrays | None:
    """None for a mesh without faces."""
    corners = compat.triangle_corners(mesh)
    if not len(corners):
        return None
    positions = compat.mesh_positions(mesh)
    triangles = compat.corner_vertices(mesh)[corners]
    domain, normals = _normals(mesh, positions, triangles, corners)
    return MeshArrays(
        positions,
        triangles,
        _DOMAINS[domain],
        normals,
        _material_indices(mesh, slot_count),
        _uv_maps(mesh, corners) if with_uv else [],
    )


def add_mesh(native, description, name: str, arrays: MeshArrays, version: int = 0) -> int:
    return description.add_mesh(
        name=name,
        version=version,
        positions=arrays.positions,
        triangles=arrays.triangles,
        normal_domain=getattr(native.NormalDomain, arrays.domain),
        normals=arrays.normals,
        material_indices=arrays.material_indices,
        uv_maps=arrays.uv_maps,
        attributes=[
            (name, getattr(native.NormalDomain, _DOMAINS[where]), values)
            for name, where, values in arrays.attributes
        ],
    )
