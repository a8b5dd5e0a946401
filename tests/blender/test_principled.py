"""Principled BSDF against Cycles of the same host: inputs over their range, alone and together."""
# hosts: blender bpy

import harness
from ball_look import look

_NEW = harness.VERSION >= (4, 0, 0)
_KIND = "ShaderNodeBsdfPrincipled"
_TINT = (0.8, 0.5, 0.3, 1.0)
_OTHER = (0.3, 0.7, 0.9, 1.0)
_BASE = {"Base_Color": _TINT, "Roughness": 0.4}
# Input, values, and what else must be on for it to be seen.
_BOTH = (
    ("Base Color", (_OTHER, (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0)), {}),
    ("Metallic", (0.5, 1.0), {}),
    ("Roughness", (0.1, 0.7, 1.0), {}),
    ("IOR", (1.1, 2.2), {}),
    ("Anisotropic", (0.5, 1.0), {"Metallic": 1.0}),
    ("Anisotropic Rotation", (0.15, 0.6), {"Metallic": 1.0, "Anisotropic": 0.8}),
    ("Alpha", (0.0, 0.4), {}),
    ("Emission Strength", (0.7,), {}),
)
_OLD_INPUTS = (
    ("Specular", (0.0, 1.0), {}),
    ("Specular Tint", (0.5, 1.0), {}),
    ("Sheen", (0.6, 1.0), {}),
    ("Sheen Tint", (0.0, 1.0), {"Sheen": 1.0}),
    ("Clearcoat", (0.5, 1.0), {"Clearcoat_Roughness": 0.3}),
    ("Clearcoat Roughness", (0.2, 0.5), {"Clearcoat": 1.0}),
    ("Transmission", (0.4, 0.8), {}),
    ("Transmission Roughness", (0.3,), {"Transmission": 0.7}),
)
_NEW_INPUTS = (
    ("Diffuse Roughness", (0.5, 1.0), {}),
    ("Specular IOR Level", (0.0, 1.0), {}),
    ("Specular Tint", (_OTHER,), {}),
    ("Sheen Weight", (0.6, 1.0), {}),
    ("Sheen Roughness", (0.2, 0.8), {"Sheen_Weight": 0.8}),
    ("Sheen Tint", (_OTHER,), {"Sheen_Weight": 0.8}),
    ("Coat Weight", (0.5, 1.0), {}),
    ("Coat Roughness", (0.2, 0.6), {"Coat_Weight": 1.0}),
    ("Coat IOR", (1.2, 2.0), {"Coat_Weight": 1.0}),
    ("Coat Tint", (_OTHER,), {"Coat_Weight": 1.0}),
    ("Transmission Weight", (0.4, 0.8), {}),
    ("Thin Film Thickness", (200.0, 700.0), {}),
    ("Thin Film IOR", (1.6, 2.2), {"Thin_Film_Thickness": 400.0}),
)
# The transformed cosine of the sheen is a fit of our own; light through glass is noise.
_ROUGHLY = {"Sheen Weight", "Sheen Roughness", "Sheen Tint", "Transmission Weight"}
_ROUGHLY |= {"Transmission", "Transmission Roughness"}
# Cycles 3.x loses light under a narrow clearcoat (4 % of a white ball's at roughness 0.03), less
# under a wider one; ours keeps it.
_ROUGHLY |= {"Clearcoat", "Clearcoat Roughness"}


def _sweep(table, distribution: str) -> None:
    for name, values, others in table:
        for value in values:
            inputs = _BASE | others | {name.replace(" ", "_"): value}
            if name == "Emission Strength":
                inputs["Emission_Color" if _NEW else "Emission"] = _OTHER
            tolerance = 0.06 if name in _ROUGHLY else 0.03
            if distribution == "MULTI_GGX" and not _NEW:
                # Cycles 3.x walks between facets at random. Ours gives back what that walk does,
                # but within the lobe, where the walk spreads it: the roughest metal is 3.4 % off.
                tolerance = 0.11
            fields = {"distribution": distribution}
            look(f"{name} {value}", _KIND, fields, tolerance, **inputs)


def test_each_input():
    table = _BOTH + (_NEW_INPUTS if _NEW else _OLD_INPUTS)
    node = harness.node(harness.material(), _KIND)
    names = {socket.identifier for socket in node.inputs}
    _sweep([entry for entry in table if entry[0] in names], "GGX")


def test_multiple_scattering():
    table = (("Roughness", (0.3, 1.0), {}), ("Roughness", (0.5, 1.0), {"Metallic": 1.0}))
    _sweep(table, "MULTI_GGX")


def test_everything_at_once():
    old = {"Specular": 0.7, "Sheen": 0.4, "Clearcoat": 0.6, "Transmission": 0.2}
    new = {"Sheen_Weight": 0.3, "Coat_Weight": 0.6, "Transmission_Weight": 0.2}
    inputs = _BASE | (new if _NEW else old) | {"Metallic": 0.3, "Alpha": 0.9}
    look("everything", _KIND, {"distribution": "GGX"}, 0.06, **inputs)


harness.main(globals())
