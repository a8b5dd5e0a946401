"""Materials and material sets of one description, each added once."""

from __future__ import annotations

from .. import compat
from .nodes import flatten_material


class MaterialTable:
    """Indices of materials and of the sets that instances refer to."""

    def __init__(self, native, description, images, report, override=None):
        self._native = native
        self._description = description
        self._images = images
        self._report = report
        self._override = override
        self._materials: dict[int, tuple[int, bool]] = {}
        self._sets: dict[tuple[int, ...], int] = {}
        self.pass_indices: list[int] = []  # of each material added

    def _material(self, material) -> tuple[int, bool]:
        """Index and whether UV maps are needed."""
        if material is None:
            return self._native.NONE, False
        key = material.original.as_pointer()
        if key not in self._materials:
            flat = flatten_material(self._native, self._images, self._report, material)
            index = self._description.add_material(
                name=material.name,
                program=flat.program,
                emission_sampling=compat.material_samples_emission(material),
            )
            self._materials[key] = index, flat.uses_uv
            self.pass_indices.append(material.pass_index)
        return self._materials[key]

    def set_of(self, obj) -> tuple[int, bool]:
        """The material set of an object's slots, and whether its mesh needs UV maps."""
        slots = [slot.material for slot in obj.material_slots] or [None]
        if self._override is not None:
            slots = [self._override] * len(slots)
        found = [self._material(material) for material in slots]
        key = tuple(index for index, _ in found)
        if key not in self._sets:
            self._sets[key] = self._description.add_material_set(list(key))
        return self._sets[key], any(uses_uv for _, uses_uv in found)
