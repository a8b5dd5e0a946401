"""Objects of a depsgraph: every geometry once, every place where it stands as an instance."""

from __future__ import annotations

from itertools import islice
from typing import NamedTuple

import numpy as np

from .. import compat
from .attributes import instance_value
from .library import digest
from .lights import light_fields
from .meshes import evaluated_mesh, gather_mesh
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

    index: int  # of those in the description
    attributes: frozenset


class _Run(NamedTuple):
    """Instances that follow each other and show the same, up to the next run."""

    first: int  # place in depsgraph.object_instances
    surface: int  # or _NONE


_LAMP = object()
_NONE = -1  # no surface
_POLL_INTERVAL = 256  # instances between two questions whether to stop


class InstanceExporter:
    """Walks depsgraph.object_instances once; nothing of an instance outlives its step there."""

    def __init__(self, context):
        self._context = context
        self._native = context.native
        self._visibility = Visibility(
            context.native, context.scene, context.view_layer, context.report
        )
        self._kinds: dict[tuple, object] = {}  # by data, object and instancer
        self._meshes: dict[tuple, int | None] = {}
        self._sent: dict[int, int] = {}  # index in the description by version
        self._names: list[str] = []  # of surfaces
        self._pass_indices: list[int] = []
        self._rows: list[tuple[int, int, int]] = []  # mesh, material set, visibility
        self._attributes: dict[str, dict[int, tuple]] = {}  # by name and place
        self._runs: list[_Run] = []

    def run(self) -> None:
        instances = self._context.depsgraph.object_instances
        self._add_instances(instances, self._walk(instances))

    def _walk(self, instances) -> int:
        """Finds the runs; how many instances there are. Nearly all the time goes into what Blender
        is asked for: of an instance like the one before, two things.
        """
        lasting = compat.LASTING_OBJECTS
        last_object = last_parent = kind = shown = each = None
        place, walked = -1, None
        numbered = enumerate(instances)
        while place != walked:
            if self._context.should_stop():
                raise Cancelled
            walked = place
            for place, instance in islice(numbered, _POLL_INTERVAL):
                obj, parent = instance.object, instance.parent
                if obj is not last_object or parent is not last_parent or not lasting:
                    last_object, last_parent = obj, parent
                    kind = self._kind(instance, obj, parent)
                    surface = _NONE if kind is None or kind is _LAMP else kind.index
                    if surface != shown:
                        self._runs.append(_Run(place, surface))
                        shown = surface
                    each = self._each(kind)
                if each is not None:
                    each(instance, kind, place)
        return place + 1

    def _each(self, kind):
        """What is done with each instance of a kind, beside counting it; None: nothing."""
        if kind is _LAMP:
            return self._add_light
        return self._note_attributes if kind is not None and kind.attributes else None

    def _kind(self, instance, obj, parent):
        """What an instance shows: _LAMP, a surface, None. What is new is exported, unless the user
        stops that.
        """
        # What stands in for an object while it is instanced is always at the same place in memory.
        data = obj.data
        key = (
            compat.address(data) if data is not None else 0,
            compat.address(obj.original),
            compat.address(parent) if parent is not None else 0,
        )
        if key not in self._kinds:
            if self._context.should_stop():
                raise Cancelled
            self._kinds[key] = self._first_of(instance, obj) if instance.show_self else None
        return self._kinds[key]

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

    def _add_light(self, instance, _kind, _place: int) -> None:
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
        self._names.append(obj.name)
        self._pass_indices.append(obj.pass_index)
        self._rows.append((mesh, materials.index, bits))
        return _Surface(len(self._rows) - 1, materials.instance_attributes)

    def _note_attributes(self, instance, surface: _Surface, place: int) -> None:
        for name in surface.attributes:
            values = self._attributes.setdefault(name, {})
            values[place] = instance_value(self._native, instance, name)

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
        name = obj.data.name
        with evaluated_mesh(obj) as mesh:
            if mesh is None:
                return None
            needs = (slots, uses_uv, attributes)
            gathered = gather_mesh(self._native, name, mesh, needs, self._context.report)
            if gathered is None:
                return None
            self._context.progress(obj.name)
        return self._add_mesh(name, gathered, place)

    def _add_mesh(self, name: str, mesh, place) -> int:
        description, library = self._context.description, self._context.library
        if library is None:
            return description.add_mesh(mesh)
        version, known = library.meshes.of(digest(mesh.content), place)
        if known:
            return self._add_kept(name, version)
        self._sent[version] = description.add_mesh(mesh, version)
        return self._sent[version]

    def _add_instances(self, instances, count: int) -> None:
        """All at once, `count` being the number of what was walked."""
        if not self._rows:
            return
        firsts = np.array([run.first for run in self._runs] + [count])
        shown = np.repeat([run.surface for run in self._runs], np.diff(firsts))
        places = np.flatnonzero(shown != _NONE)
        # A length of these would be found by walking them.
        matrices = np.empty((count, 16), np.float32)
        instances.foreach_get("matrix_world", matrices.ravel())
        if len(places) != count:
            shown, matrices = shown[places], matrices[places]
        self._context.passes.object_indices += np.take(self._pass_indices, shown).tolist()
        self._context.description.add_instances(
            names=self._names,
            surfaces=np.array(self._rows, np.uint32),
            surface_of=shown.astype(np.uint32),
            matrices=matrices,
        )
        for name, values in self._attributes.items():
            table = np.zeros((len(places), 4), np.float32)
            table[np.searchsorted(places, list(values))] = list(values.values())
            self._context.description.add_instance_attribute(name, table)
