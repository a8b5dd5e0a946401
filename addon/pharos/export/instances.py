"""Objects of a depsgraph: every geometry once, every place where it stands as an instance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .attributes import instance_value, read_attributes
from .library import digest
from .lights import light_fields
from .meshes import add_mesh, evaluated_mesh, read_mesh
from .visibility import Visibility

# Object types that are silently no surfaces.
_SILENT_TYPES = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE", "LIGHT"}
# What becomes a mesh by evaluation is presented as an instance of that mesh, beside the object.
_SILENT_TYPES |= {"CURVE", "FONT", "META", "SURFACE"}
_UNSUPPORTED_TYPES = {
    "CURVES": "Hair curves are",
    "POINTCLOUD": "Point clouds are",
    "VOLUME": "Volumes are",
    "GPENCIL": "Grease pencil objects are",
    "GREASEPENCIL": "Grease pencil objects are",
}


class Cancelled(Exception):
    """The user stopped the export."""


class _Surface(NamedTuple):
    """A mesh as one object shows it."""

    row: tuple[int, int, int]  # mesh, material set, visibility
    name: str
    pass_index: int
    attributes: frozenset


_LAMP = object()


class InstanceExporter:
    """Walks depsgraph.object_instances once; nothing of an instance outlives its step there."""

    def __init__(self, context):
        self._context = context
        self._native = context.native
        self._visibility = Visibility(
            context.native, context.scene, context.view_layer, context.report
        )
        self._surfaces: dict[tuple, object] = {}  # by object, data, instancer, hair
        self._meshes: dict[tuple, int | None] = {}
        self._sent: dict[int, int] = {}  # index in the description by version
        self._names: list[str] = []
        self._attributes: dict[str, dict[int, tuple]] = {}  # by name and row
        self._rows: list[tuple[int, int, int, int]] = []  # place in depsgraph, mesh, set, bits

    def run(self) -> None:
        instances = self._context.depsgraph.object_instances
        matrices = np.empty((len(instances), 16), np.float32)
        if len(instances):
            instances.foreach_get("matrix_world", matrices.ravel())
        for place, instance in enumerate(instances):
            if self._context.should_stop():
                raise Cancelled
            if instance.show_self:
                self._visit(instance, place)
        self._add_rows(matrices)

    def _visit(self, instance, place: int) -> None:
        """All but the first instance of an object cost no more than finding that out."""
        obj = instance.object
        parent = instance.parent if instance.is_instance else None
        # What stands in for an object while it is instanced is always at the same place in memory.
        data = obj.data
        key = (
            obj.original.as_pointer(),
            data.as_pointer() if data is not None else 0,
            parent.as_pointer() if parent is not None else 0,
            instance.show_particles,
        )
        if key not in self._surfaces:
            self._surfaces[key] = self._first_of(instance, obj)
        kind = self._surfaces[key]
        if kind is _LAMP:
            self._add_light(instance)
        elif kind is not None:
            self._add_surface(instance, kind, place)

    def _first_of(self, instance, obj):
        """What all instances of an object share: _LAMP, a surface, None; names what is missing."""
        if instance.show_particles:
            self._name_hair(obj)
        if obj.type == "LIGHT":
            return _LAMP
        if obj.type == "MESH":
            return self._surface(instance, obj) if self._context.view_layer.use_solid else None
        if obj.type not in _SILENT_TYPES:
            what = _UNSUPPORTED_TYPES.get(obj.type, f"Objects of type {obj.type} are")
            self._context.report.warn(obj.name, f"{what} not supported.", "OBJECT")
        return None

    def _name_hair(self, obj) -> None:
        for system in obj.particle_systems:
            settings = system.settings
            if settings.type == "HAIR" and settings.render_type == "PATH":
                message = f"Hair {system.name!r} is not supported."
                self._context.report.warn(obj.name, message, "OBJECT")

    def _add_light(self, instance) -> None:
        obj = instance.object
        self._context.description.add_light(
            name=obj.name,
            to_world=[list(row) for row in instance.matrix_world],
            visibility=self._visibility.of(instance),
            **light_fields(self._context, obj.data, instance.matrix_world),
        )

    def _surface(self, instance, obj) -> _Surface | None:
        bits = self._visibility.of(instance)
        if not bits:
            return None
        self._visibility.name_unsupported(obj)
        materials = self._context.materials.set_of(obj)
        with_uv = materials.uses_uv or self._context.passes.needs_uv
        mesh = self._mesh_index(obj, with_uv, materials.mesh_attributes)
        if mesh is None:
            return None
        row = (mesh, materials.index, bits)
        return _Surface(row, obj.name, obj.pass_index, materials.instance_attributes)

    def _add_surface(self, instance, surface: _Surface, place: int) -> None:
        self._names.append(surface.name)
        self._context.passes.object_indices.append(surface.pass_index)
        for name in surface.attributes:
            values = self._attributes.setdefault(name, {})
            values[len(self._rows)] = instance_value(self._native, instance, name)
        self._rows.append((place, *surface.row))

    def _mesh_index(self, obj, uses_uv: bool, attributes: frozenset) -> int | None:
        slots = len(obj.material_slots)
        key = (obj.data.as_pointer(), uses_uv, slots, attributes)
        if key not in self._meshes:
            self._meshes[key] = self._kept(obj, slots, uses_uv, attributes)
        return self._meshes[key]

    def _kept(self, obj, slots: int, uses_uv: bool, attributes: frozenset) -> int | None:
        """Without reading it, where a live session has the mesh as it is."""
        library = self._context.library
        if library is None:
            return self._read(obj, slots, uses_uv, attributes, None)
        place = library.mesh_place(obj, slots, uses_uv, attributes)
        version = None if place is None else library.meshes.at(place)
        if version is None:
            return self._read(obj, slots, uses_uv, attributes, place)
        return self._add_kept(obj.data.name, version)

    def _add_kept(self, name: str, version: int) -> int:
        if version not in self._sent:
            self._sent[version] = self._context.description.add_kept_mesh(name, version)
        return self._sent[version]

    def _read(self, obj, slots: int, uses_uv: bool, attributes: frozenset, place) -> int | None:
        with evaluated_mesh(obj) as mesh:
            if mesh is None:
                return None
            arrays = read_mesh(mesh, slots, uses_uv)
            if arrays is None:
                return None
            if attributes:
                found = read_attributes(mesh, attributes, self._context.report)
                arrays = arrays._replace(attributes=found)
            self._context.progress(obj.name)
            return self._add_mesh(obj.data.name, arrays, place)

    def _add_mesh(self, name: str, arrays, place) -> int:
        description, library = self._context.description, self._context.library
        if library is None:
            return add_mesh(self._native, description, name, arrays)
        version, known = library.meshes.of(digest(arrays), place)
        if known:
            return self._add_kept(name, version)
        self._sent[version] = add_mesh(self._native, description, name, arrays, version)
        return self._sent[version]

    def _add_rows(self, matrices: np.ndarray) -> None:
        if not self._rows:
            return
        rows = np.array(self._rows, np.uint32)
        self._context.description.add_instances(
            names=self._names,
            matrices=matrices[rows[:, 0]],
            meshes=rows[:, 1],
            material_sets=rows[:, 2],
            visibility=rows[:, 3],
        )
        for name, values in self._attributes.items():
            table = np.zeros((len(self._rows), 4), np.float32)
            table[list(values)] = list(values.values())
            self._context.description.add_instance_attribute(name, table)
