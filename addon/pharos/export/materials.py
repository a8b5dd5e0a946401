"""Materials and material sets of one description, each added once."""

from __future__ import annotations

from typing import NamedTuple

from .. import compat
from .nodes import Flattened, flatten_displacement, flatten_material


class MaterialSet(NamedTuple):
    """Its index, and what its materials read of meshes and instances."""

    index: int
    uses_uv: bool
    mesh_attributes: frozenset
    instance_attributes: frozenset


def _needs_of(flat: Flattened, moves: Flattened | None) -> Flattened:
    """What a material's two programs read."""
    if moves is None:
        return flat._replace(program=None)
    return Flattened(
        None,
        flat.uses_uv or moves.uses_uv,
        flat.mesh_attributes | moves.mesh_attributes,
        flat.instance_attributes | moves.instance_attributes,
    )


class MaterialTable:
    """Indices of materials and of the sets that instances refer to."""

    def __init__(self, context):
        """`context`: the export's, with its images."""
        self._native = context.native
        self._description = context.description
        self._images = context.images
        self._report = context.report
        self._override = context.view_layer.material_override
        self._aovs = context.passes.aovs
        self._materials: dict[int, tuple[int, Flattened | None]] = {}
        self._sets: dict[tuple[int, ...], int] = {}
        self.pass_indices: list[int] = []  # of each material added

    def _material(self, material) -> tuple[int, Flattened | None]:
        """Index and what it needs."""
        if material is None:
            return self._native.NONE, None
        key = material.original.as_pointer()
        if key not in self._materials:
            flat = flatten_material(
                self._native, self._images, self._report, material, self._aovs
            )
            for message in compat.ignored_of_material(material):
                self._report.info(material.name, message, "MATERIAL")
            moves = flatten_displacement(self._native, self._images, self._report, material)
            index = self._description.add_material(
                name=material.name,
                program=flat.program,
                emission_sampling=compat.material_samples_emission(material),
                displacement=moves and moves.program,
            )
            self._materials[key] = index, _needs_of(flat, moves)
            self.pass_indices.append(material.pass_index)
        return self._materials[key]

    def set_of(self, obj) -> MaterialSet:
        """The material set of an object's slots, and what they read."""
        slots = [slot.material for slot in obj.material_slots] or [None]
        if self._override is not None:
            slots = [self._override] * len(slots)
        found = [self._material(material) for material in slots]
        key = tuple(index for index, _ in found)
        if key not in self._sets:
            self._sets[key] = self._description.add_material_set(list(key))
        needs = [flat for _, flat in found if flat is not None]
        return MaterialSet(
            self._sets[key],
            any(flat.uses_uv for flat in needs),
            frozenset().union(*(flat.mesh_attributes for flat in needs)),
            frozenset().union(*(flat.instance_attributes for flat in needs)),
        )
