"""Every difference between Blender versions that the add-on has to know."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import bpy
import numpy as np

VERSION = bpy.app.version
_FLAT_PASSES = VERSION >= (4, 0, 0)
_CORNER_NORMALS = VERSION >= (4, 1, 0)
_FAST_ATTRIBUTES = VERSION >= (3, 6, 0)
_WORTH_POINTERS = 1000  # fewer elements are as fast without
# An object of a depsgraph is presented as one Python object all the time; one that stands in for it
# while it is instanced, with data of its own perhaps, as another one every time.
LASTING_OBJECTS = VERSION < (5, 0, 0)
address = bpy.types.bpy_struct.as_pointer  # to look it up on each thing takes four times as long
SHORT_PASS_NAMES = VERSION < (5, 0, 0)


def version_number() -> int:
    """Major * 100 + minor: the formulas of the look follow it."""
    return VERSION[0] * 100 + VERSION[1]


def set_pass_pixels(render_pass, pixels: np.ndarray) -> None:
    """`pixels`: float32 (n, channels), bottom row first."""
    render_pass.rect.foreach_set(pixels.ravel() if _FLAT_PASSES else pixels)


def _read(collection, name: str, count: int, components: int, dtype=np.float32) -> np.ndarray:
    out = np.empty(count * components, dtype)
    if count:
        collection.foreach_get(name, out)
    return out.reshape(count, components) if components > 1 else out


def _layout(size: int, **fields) -> np.dtype:
    """An element of so many bytes: place and kind of the properties that begin there."""
    places, kinds = zip(*fields.values())
    return np.dtype(
        {"names": list(fields), "formats": list(kinds), "offsets": list(places), "itemsize": size}
    )


# Elements of 3.x whose values foreach_get asks for one by one. Names are those of properties, but
# for `flag`: bit 0 of a polygon's is its smoothness.
_VERTEX = _layout(16, co=(0, "3<f4"))
_VERTEX_NORMAL = _layout(12, vector=(0, "3<f4"))
_LOOP = _layout(8, vertex_index=(0, "<u4"))
_UV = _layout(12, uv=(0, "2<f4"))
_POLYGON = _layout(12, loop_start=(0, "<i4"), loop_total=(4, "<i4"), flag=(10, "u1"))
_TRIANGLE = (
    _layout(12, loops=(0, "3<u4"))
    if _FLAT_PASSES
    else _layout(16, loops=(0, "3<u4"), polygon_index=(12, "<u4"))
)


def _in_memory(collection, layout: np.dtype) -> np.ndarray | None:
    """Elements where they lie in Blender's memory, valid as long as these are; None where they do
    not lie as expected: some, spread over all, are compared with what Blender says of them.
    """
    count, stride = len(collection), layout.itemsize
    if count < _WORTH_POINTERS:
        return None
    begin = collection[0].as_pointer()
    probes = [*range(1, count, count // 7 + 1), count - 1]
    if any(collection[i].as_pointer() != begin + stride * i for i in probes):
        return None
    memory = (ctypes.c_uint8 * (stride * count)).from_address(begin)
    values = np.frombuffer(memory, layout)
    for i in probes:
        for name in layout.names:
            said = collection[i].use_smooth if name == "flag" else getattr(collection[i], name)
            found = values[name][i] & 1 if name == "flag" else values[name][i]
            if np.any(found != np.atleast_1d(said)):
                return None
    return values


def mesh_positions(mesh) -> np.ndarray:
    """(vertices, 3) float32; this and what follows may lie in the mesh."""
    count = len(mesh.vertices)
    if _FAST_ATTRIBUTES and "position" in mesh.attributes:
        return _read(mesh.attributes["position"].data, "vector", count, 3)
    found = _in_memory(mesh.vertices, _VERTEX)
    return _read(mesh.vertices, "co", count, 3) if found is None else found["co"]


def corner_vertices(mesh) -> np.ndarray:
    """uint32: the vertex of each corner."""
    count = len(mesh.loops)
    if _FAST_ATTRIBUTES and ".corner_vert" in mesh.attributes:
        values = _read(mesh.attributes[".corner_vert"].data, "value", count, 1, np.int32)
        return values.view(np.uint32)
    found = _in_memory(mesh.loops, _LOOP)
    if found is not None:
        return found["vertex_index"]
    return _read(mesh.loops, "vertex_index", count, 1, np.int32).view(np.uint32)


def triangle_corners(mesh) -> np.ndarray:
    """(triangles, 3) uint32: corners of the mesh."""
    mesh.calc_loop_triangles()
    found = _in_memory(mesh.loop_triangles, _TRIANGLE)
    if found is not None:
        return found["loops"]
    count = len(mesh.loop_triangles)
    return _read(mesh.loop_triangles, "loops", count, 3, np.int32).view(np.uint32)


def triangle_polygons(mesh) -> np.ndarray:
    """uint32: the polygon of each triangle, once there are triangles."""
    count = len(mesh.loop_triangles)
    if hasattr(mesh, "loop_triangle_polygons"):
        values = _read(mesh.loop_triangle_polygons, "value", count, 1, np.int32)
        return values.view(np.uint32)
    found = None if _FLAT_PASSES else _in_memory(mesh.loop_triangles, _TRIANGLE)
    if found is not None:
        return found["polygon_index"]
    return _read(mesh.loop_triangles, "polygon_index", count, 1, np.int32).view(np.uint32)


def polygon_materials(mesh) -> np.ndarray | None:
    """int32: the slot of each polygon; None: the first of all."""
    slots = mesh.attributes.get("material_index")
    if slots is None or slots.domain != "FACE" or slots.data_type != "INT":
        return None
    return _read(slots.data, "value", len(mesh.polygons), 1, np.int32)


def _polygon_smooth(mesh) -> np.ndarray | None:
    """Whether each polygon is smooth; None: all are."""
    count = len(mesh.polygons)
    if _CORNER_NORMALS:
        sharp = mesh.attributes.get("sharp_face")
        if sharp is None or sharp.domain != "FACE" or sharp.data_type != "BOOLEAN":
            return None
        return ~_read(sharp.data, "value", count, 1, np.bool_)
    found = _in_memory(mesh.polygons, _POLYGON)
    if found is not None:
        return (found["flag"] & 1).view(np.bool_)
    return _read(mesh.polygons, "use_smooth", count, 1, np.bool_)


def _vertex_normals(mesh) -> np.ndarray:
    found = None if _FAST_ATTRIBUTES else _in_memory(mesh.vertex_normals, _VERTEX_NORMAL)
    if found is not None:
        return found["vector"]
    return _read(mesh.vertex_normals, "vector", len(mesh.vertices), 3)


def _corner_normals(mesh) -> np.ndarray:
    if _CORNER_NORMALS:
        return _read(mesh.corner_normals, "vector", len(mesh.loops), 3)
    mesh.calc_normals_split()
    normals = _read(mesh.loops, "normal", len(mesh.loops), 3)
    mesh.free_normals_split()
    return normals


def _normal_domain(mesh, smooth: np.ndarray | None) -> str:
    if _CORNER_NORMALS:
        return mesh.normals_domain
    if mesh.use_auto_smooth or mesh.has_custom_normals:
        return "CORNER"
    if smooth is None or smooth.all():
        return "POINT"
    return "CORNER" if smooth.any() else "FACE"


class Normals(NamedTuple):
    """In the cheapest domain that holds a mesh's normals: 'FACE', 'POINT' or 'CORNER'."""

    domain: str
    rows: np.ndarray | None  # (vertices or corners, 3) float32
    smooth: np.ndarray | None  # of polygons, beside normals of corners; None: all are


def mesh_normals(mesh) -> Normals:
    smooth = None if _CORNER_NORMALS and mesh.normals_domain != "CORNER" else _polygon_smooth(mesh)
    domain = _normal_domain(mesh, smooth)
    if domain == "FACE":
        return Normals(domain, None, None)
    if domain == "POINT":
        return Normals(domain, _vertex_normals(mesh), None)
    return Normals(domain, _corner_normals(mesh), smooth)


def uv_coordinates(layer, corner_count: int) -> np.ndarray:
    """(corners, 2) float32."""
    if hasattr(layer, "uv"):
        return _read(layer.uv, "vector", corner_count, 2)
    found = _in_memory(layer.data, _UV)
    return _read(layer.data, "uv", corner_count, 2) if found is None else found["uv"]


def always_uses_nodes(owner) -> bool:
    """Materials and worlds have no look without nodes since 5.0."""
    return VERSION >= (5, 0, 0) and not isinstance(owner, bpy.types.Light)


def light_strength(light) -> np.ndarray:
    """Colour x watts (a sun's: W/m2), with what newer versions add."""
    strength = np.array(light.color, np.float64) * light.energy
    if getattr(light, "use_temperature", False):
        strength *= np.array(light.temperature_color, np.float64)
    return strength * 2.0 ** getattr(light, "exposure", 0.0)


def light_casts_shadow(light) -> bool:
    cycles = getattr(light, "cycles", None)
    if cycles is not None and hasattr(cycles, "cast_shadow"):
        return cycles.cast_shadow
    return light.use_shadow


def material_samples_emission(material) -> bool:
    """Whether next-event estimation goes towards a material's emission."""
    cycles = getattr(material, "cycles", None)
    if hasattr(cycles, "emission_sampling"):
        return cycles.emission_sampling != "NONE"
    return getattr(cycles, "sample_as_light", True)


def terminator_shading_offset(obj) -> float:
    """How far shading reaches beyond the terminator of coarse smooth meshes."""
    if hasattr(obj, "shadow_terminator_shading_offset"):
        return obj.shadow_terminator_shading_offset
    return getattr(getattr(obj, "cycles", None), "shadow_terminator_offset", 0.0)


def ignored_of_material(material) -> list[str]:
    """What a material asks for besides its nodes and is not done."""
    said = []
    in_cycles = not hasattr(material, "use_transparent_shadow")
    owner = getattr(material, "cycles", None) if in_cycles else material
    if not getattr(owner, "use_transparent_shadow", True):
        said.append("Shadows are transparent where the surface is.")
    if not getattr(material, "use_bump_map_correction", True):
        said.append("Bump map correction is always on.")
    return said


def aov_name(node) -> str:
    """The pass that an AOV Output node writes."""
    return node.aov_name if hasattr(node, "aov_name") else node.name


def displacement_method(material) -> str:
    """'BUMP', 'DISPLACEMENT' or 'BOTH'."""
    if hasattr(material, "displacement_method"):
        return material.displacement_method
    return getattr(getattr(material, "cycles", None), "displacement_method", "BUMP")
