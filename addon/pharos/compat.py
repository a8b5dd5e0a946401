"""Every difference between Blender versions that the add-on has to know."""

from __future__ import annotations

import ctypes

import bpy
import numpy as np

VERSION = bpy.app.version
_FLAT_PASSES = VERSION >= (4, 0, 0)
_CORNER_NORMALS = VERSION >= (4, 1, 0)
_FAST_ATTRIBUTES = VERSION >= (3, 6, 0)
_WORTH_POINTERS = 1000  # fewer elements are as fast without
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


def mesh_positions(mesh) -> np.ndarray:
    count = len(mesh.vertices)
    if _FAST_ATTRIBUTES and "position" in mesh.attributes:
        return _read(mesh.attributes["position"].data, "vector", count, 3)
    return _read(mesh.vertices, "co", count, 3)


def _in_memory(collection, name: str, integers: int, components: int) -> np.ndarray | None:
    """The first `components` of so many 32-bit integers that each element is made of, read where
    they lie: foreach_get asks for each one by itself. None where they do not lie as expected.
    """
    count, stride = len(collection), 4 * integers
    if count < _WORTH_POINTERS:
        return None
    begin = collection[0].as_pointer()
    probes = [*range(1, count, count // 7 + 1), count - 1]
    if any(collection[i].as_pointer() != begin + stride * i for i in probes):
        return None
    memory = (ctypes.c_int32 * (integers * count)).from_address(begin)
    values = np.frombuffer(memory, np.int32).reshape(count, integers)[:, :components]
    for i in probes:
        if np.any(values[i] != np.atleast_1d(getattr(collection[i], name))):
            return None
    return np.ascontiguousarray(values)  # Blender's memory is not kept


def corner_vertices(mesh) -> np.ndarray:
    count = len(mesh.loops)
    if _FAST_ATTRIBUTES and ".corner_vert" in mesh.attributes:
        return _read(mesh.attributes[".corner_vert"].data, "value", count, 1, np.int32)
    found = _in_memory(mesh.loops, "vertex_index", 2, 1)  # and the edge
    if found is not None:
        return found.ravel()
    return _read(mesh.loops, "vertex_index", count, 1, np.int32)


def triangle_corners(mesh) -> np.ndarray:
    """Loop indices of each triangle."""
    mesh.calc_loop_triangles()
    # In 3.x the polygon follows.
    found = _in_memory(mesh.loop_triangles, "loops", 3 if _FLAT_PASSES else 4, 3)
    if found is not None:
        return found
    return _read(mesh.loop_triangles, "loops", len(mesh.loop_triangles), 3, np.int32)


def triangle_polygons(mesh) -> np.ndarray:
    count = len(mesh.loop_triangles)
    if hasattr(mesh, "loop_triangle_polygons"):
        return _read(mesh.loop_triangle_polygons, "value", count, 1, np.int32)
    return _read(mesh.loop_triangles, "polygon_index", count, 1, np.int32)


def polygon_materials(mesh) -> np.ndarray:
    return _read(mesh.polygons, "material_index", len(mesh.polygons), 1, np.int32)


def polygon_smooth(mesh) -> np.ndarray:
    return _read(mesh.polygons, "use_smooth", len(mesh.polygons), 1, np.bool_)


def vertex_normals(mesh) -> np.ndarray:
    return _read(mesh.vertex_normals, "vector", len(mesh.vertices), 3)


def normal_domain(mesh) -> str:
    """'FACE', 'POINT' or 'CORNER': the cheapest domain that holds the mesh's normals."""
    if _CORNER_NORMALS:
        return mesh.normals_domain
    if mesh.use_auto_smooth or mesh.has_custom_normals:
        return "CORNER"
    smooth = polygon_smooth(mesh)
    if smooth.all():
        return "POINT"
    return "CORNER" if smooth.any() else "FACE"


def corner_normals(mesh) -> np.ndarray:
    if _CORNER_NORMALS:
        return _read(mesh.corner_normals, "vector", len(mesh.loops), 3)
    mesh.calc_normals_split()
    normals = _read(mesh.loops, "normal", len(mesh.loops), 3)
    mesh.free_normals_split()
    return normals


def uv_coordinates(layer, corner_count: int) -> np.ndarray:
    if hasattr(layer, "uv"):
        return _read(layer.uv, "vector", corner_count, 2)
    return _read(layer.data, "uv", corner_count, 2)


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
