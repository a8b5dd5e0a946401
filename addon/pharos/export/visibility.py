"""Ray visibility of objects, of their instancers and of the collections they are in."""

from __future__ import annotations

from .. import compat


def _any_layer_collection(layer_collection, attribute: str) -> bool:
    return getattr(layer_collection, attribute) or any(
        _any_layer_collection(child, attribute) for child in layer_collection.children
    )


class Visibility:
    """Visibility bits of one view layer's objects."""

    def __init__(self, native, scene, view_layer, report):
        self._view_layer = view_layer
        self._report = report
        self._bits = (
            ("visible_camera", native.VISIBLE_CAMERA),
            ("visible_diffuse", native.VISIBLE_DIFFUSE),
            ("visible_glossy", native.VISIBLE_GLOSSY),
            ("visible_transmission", native.VISIBLE_TRANSMISSION),
            ("visible_shadow", native.VISIBLE_SHADOW),
        )
        self._camera_bit = native.VISIBLE_CAMERA
        cycles = getattr(scene, "cycles", None)
        self._subdivides = getattr(cycles, "feature_set", "") == "EXPERIMENTAL"
        root = view_layer.layer_collection
        self._asks_indirect = _any_layer_collection(root, "indirect_only")
        self._asks_holdout = _any_layer_collection(root, "holdout")

    def _object_bits(self, obj) -> int:
        bits = sum(bit for name, bit in self._bits if getattr(obj, name))
        if self._asks_indirect and obj.indirect_only_get(view_layer=self._view_layer):
            bits &= ~self._camera_bit
        return bits

    def name_unsupported(self, obj) -> None:
        """Report what a surface should do besides hiding from rays."""
        if obj.is_holdout or (self._asks_holdout and obj.holdout_get(view_layer=self._view_layer)):
            self._report.warn(obj.name, "Holdout is not supported.", "OBJECT")
        if obj.is_shadow_catcher:
            self._report.warn(obj.name, "Shadow catcher is not supported.", "OBJECT")
        if compat.terminator_shading_offset(obj) > 0.0:
            self._report.warn(obj.name, "The terminator's shading offset is not used.", "OBJECT")
        if self._subdivides and getattr(obj.cycles, "use_adaptive_subdivision", False):
            self._report.warn(obj.name, "Adaptive subdivision is not supported.", "OBJECT")

    def of(self, instance) -> int:
        """Bits of a depsgraph instance: an instancer hides what it instances."""
        bits = self._object_bits(instance.object)
        if instance.is_instance and instance.parent is not None:
            bits &= self._object_bits(instance.parent)
        return bits
