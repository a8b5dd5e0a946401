"""The passes of a picture: names here, in Blender and in files, and which a view layer asks for."""

from __future__ import annotations

from typing import NamedTuple

from . import compat


class Pass(NamedTuple):
    """One pass; `switch` is an attribute of the view layer, or of its `pharos` settings."""

    film_pass: str  # enumerator of native.FilmPass; empty for what materials write
    name: str  # in files, and in Blender unless it calls the pass otherwise
    channels: str
    kind: str  # VALUE, VECTOR or COLOR
    switch: str = ""
    short_name: str = ""  # in Blender before 5.0
    aov: int = -1  # place among the passes that materials write

    @property
    def blender_name(self) -> str:
        """The name in Blender's render result."""
        return self.short_name if self.short_name and compat.SHORT_PASS_NAMES else self.name

    @property
    def built_in(self) -> bool:
        """Whether Blender makes room for it by itself."""
        return self.aov < 0 and not self.switch.startswith("pharos.")


def _light_passes():
    """Light by the lobes of the first hit, under Cycles' names."""
    for lobe, short in (("Diffuse", "Diff"), ("Glossy", "Gloss"), ("Transmission", "Trans")):
        for part in ("Direct", "Indirect", "Color"):
            yield Pass(
                f"{lobe}{part}",
                f"{lobe} {part}",
                "RGB",
                "COLOR",
                f"use_pass_{lobe}_{part}".lower(),
                short + part[:3],
            )


PASSES = (
    Pass("Combined", "Combined", "RGBA", "COLOR"),
    Pass("Depth", "Depth", "Z", "VALUE", "use_pass_z"),
    Pass("Mist", "Mist", "Z", "VALUE", "use_pass_mist"),
    Pass("Position", "Position", "XYZ", "VECTOR", "use_pass_position"),
    Pass("Normal", "Normal", "XYZ", "VECTOR", "use_pass_normal"),
    Pass("Uv", "UV", "UVA", "VECTOR", "use_pass_uv"),
    Pass("ObjectIndex", "Object Index", "X", "VALUE", "use_pass_object_index", "IndexOB"),
    Pass("MaterialIndex", "Material Index", "X", "VALUE", "use_pass_material_index", "IndexMA"),
    Pass("Emission", "Emission", "RGB", "COLOR", "use_pass_emit", "Emit"),
    Pass("Environment", "Environment", "RGB", "COLOR", "use_pass_environment", "Env"),
    *_light_passes(),
    Pass("DenoisingNormal", "Denoising Normal", "XYZ", "VECTOR", "pharos.use_pass_denoising"),
    Pass("DenoisingAlbedo", "Denoising Albedo", "RGB", "COLOR", "pharos.use_pass_denoising"),
    Pass("SampleCount", "Debug Sample Count", "X", "VALUE", "pharos.use_pass_sample_count"),
    Pass("Effort", "Effort", "X", "VALUE", "pharos.use_pass_effort"),
    Pass("GuideDirection", "Guide Direction", "XYZ", "VECTOR", "pharos.use_pass_guide_direction"),
    Pass("GuideKappa", "Guide Kappa", "X", "VALUE", "pharos.use_pass_guide_kappa"),
    Pass("GuideIrradiance", "Guide Irradiance", "X", "VALUE", "pharos.use_pass_guide_irradiance"),
    Pass("GuideShare", "Guide Share", "X", "VALUE", "pharos.use_pass_guide_share"),
)

# Switches of Cycles that ask for the same.
_CYCLES_SWITCHES = {
    "pharos.use_pass_denoising": "denoising_store_passes",
    "pharos.use_pass_sample_count": "pass_debug_sample_count",
}
# Switches of view layers, and of Cycles there, that ask for what Pharos does not deliver.
_UNSUPPORTED = {
    "use_pass_vector": "Vector",
    "use_pass_shadow": "Shadow",
    "use_pass_ambient_occlusion": "Ambient Occlusion",
    **{
        f"use_pass_subsurface_{part}": f"Subsurface {part.capitalize()}"
        for part in ("direct", "indirect", "color")
    },
    **{
        f"use_pass_cryptomatte_{kind}": f"Cryptomatte {kind.capitalize()}"
        for kind in ("object", "material", "asset")
    },
}
_UNSUPPORTED_CYCLES = {
    "use_pass_volume_direct": "Volume Direct",
    "use_pass_volume_indirect": "Volume Indirect",
    "use_pass_shadow_catcher": "Shadow Catcher",
}
_MIST_EXPONENTS = {"LINEAR": 1.0, "QUADRATIC": 2.0, "INVERSE_QUADRATIC": 0.5}


def _is_wanted(view_layer, switch: str) -> bool:
    if switch.startswith("pharos."):
        cycles = getattr(view_layer, "cycles", None)
        asked = getattr(cycles, _CYCLES_SWITCHES.get(switch, ""), False)
        return asked or getattr(view_layer.pharos, switch.removeprefix("pharos."))
    return bool(switch) and getattr(view_layer, switch)


def _aov_passes(view_layer) -> list[Pass]:
    """What AOV Output nodes may write."""
    kinds = {"COLOR": ("RGBA", "COLOR"), "VALUE": ("X", "VALUE")}
    aovs = [aov for aov in view_layer.aovs if aov.is_valid]
    return [Pass("", aov.name, *kinds[aov.type], aov=i) for i, aov in enumerate(aovs)]


def wanted_passes(view_layer) -> list[Pass]:
    """Passes beside Combined that a view layer asks for."""
    asked = [entry for entry in PASSES if _is_wanted(view_layer, entry.switch)]
    return asked + _aov_passes(view_layer)


def film_passes(view_layer) -> list[Pass]:
    """All that may be read of a render of a view layer."""
    return [*PASSES, *_aov_passes(view_layer)]


def name_unsupported_passes(view_layer, report) -> None:
    """Put the passes that stay black, and those that are missing, into the report."""
    cycles = getattr(view_layer, "cycles", None)
    names = [n for switch, n in _UNSUPPORTED.items() if getattr(view_layer, switch, False)]
    names += [n for switch, n in _UNSUPPORTED_CYCLES.items() if getattr(cycles, switch, False)]
    names += [f"Light Group {group.name}" for group in getattr(view_layer, "lightgroups", ())]
    for name in names:
        report.warn(view_layer.name, f"Pass {name!r} is not supported.", "VIEW_LAYER")


class PassRequest:
    """What the export has to know of the passes of a render; by default: none is wanted."""

    def __init__(self, wanted: list[Pass] = ()):
        self._names = {entry.film_pass for entry in wanted if entry.aov < 0}
        self._aovs = [(entry.name, entry.kind == "COLOR") for entry in wanted if entry.aov >= 0]
        self.object_indices: list[int] = []
        self.material_indices: list[int] = []

    @property
    def needs_uv(self) -> bool:
        return "Uv" in self._names

    @property
    def aovs(self) -> dict[tuple[str, bool], int]:
        """Places of the passes that materials write, by name and whether they are colours."""
        return {key: i for i, key in enumerate(self._aovs)}

    def fields(self, native, world) -> dict:
        """Arguments of set_passes, once the scene is exported."""
        bits = sum(native.pass_bit(getattr(native.FilmPass, name)) for name in self._names)
        fields = {"wanted": bits}
        if self._aovs:
            fields["aovs"] = [native.AovDescription(*aov) for aov in self._aovs]
        if "ObjectIndex" in self._names:
            fields["object_indices"] = self.object_indices
        if "MaterialIndex" in self._names:
            fields["material_indices"] = self.material_indices
        if "Mist" in self._names and world is not None:
            mist = world.mist_settings
            fields |= {
                "mist_start": mist.start,
                "mist_depth": mist.depth,
                "mist_falloff": _MIST_EXPONENTS[mist.falloff],
            }
        return fields
