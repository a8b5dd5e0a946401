"""Shader nodes: what each appends to a program. A handler gets (flattener, node, scope, weight)."""

from __future__ import annotations

_DISTRIBUTIONS = {
    "SHARP": "Sharp",
    "BECKMANN": "Beckmann",
    "GGX": "Ggx",
    "MULTI_GGX": "MultiGgx",
    "ASHIKHMIN_SHIRLEY": "AshikhminShirley",
}

# Inputs of the two Principled versions in the order of native/materials/node_program.h: identifier
# and size; size 0 is a normal or tangent.
_PRINCIPLED_V1 = (
    ("Base Color", 3),
    ("Subsurface", 1),
    ("Subsurface Color", 3),
    ("Metallic", 1),
    ("Specular", 1),
    ("Specular Tint", 1),
    ("Roughness", 1),
    ("Anisotropic", 1),
    ("Anisotropic Rotation", 1),
    ("Sheen", 1),
    ("Sheen Tint", 1),
    ("Clearcoat", 1),
    ("Clearcoat Roughness", 1),
    ("IOR", 1),
    ("Transmission", 1),
    ("Transmission Roughness", 1),
    ("Normal", 0),
    ("Clearcoat Normal", 0),
    ("Tangent", 0),
)
_PRINCIPLED_V2 = (
    ("Base Color", 3),
    ("Metallic", 1),
    ("Roughness", 1),
    ("IOR", 1),
    ("Diffuse Roughness", 1),
    ("Subsurface Weight", 1),
    ("Specular IOR Level", 1),
    ("Specular Tint", 3),
    ("Anisotropic", 1),
    ("Anisotropic Rotation", 1),
    ("Transmission Weight", 1),
    ("Coat Weight", 1),
    ("Coat Roughness", 1),
    ("Coat IOR", 1),
    ("Coat Tint", 3),
    ("Sheen Weight", 1),
    ("Sheen Roughness", 1),
    ("Sheen Tint", 3),
    ("Emission Color", 3),
    ("Emission Strength", 1),
    ("Thin Film Thickness", 1),
    ("Thin Film IOR", 1),
    ("Alpha", 1),
    ("Normal", 0),
    ("Coat Normal", 0),
    ("Tangent", 0),
)

# Features that are missing or approximated: input and how the report names it.
_NOT_YET = {
    "Subsurface": "subsurface scattering (diffuse instead)",
    "Subsurface Weight": "subsurface scattering (diffuse instead)",
}


def _distribution(f, node) -> int:
    name = _DISTRIBUTIONS.get(getattr(node, "distribution", "GGX"))
    if name is None:
        f.unsupported(node, f"distribution {node.distribution!r}")
        name = "Ggx"
    return f.native.Distribution[name]


def _name_missing_features(f, node, scope) -> None:
    """Report features that are switched on and will not be seen."""
    for socket in node.inputs:
        feature = _NOT_YET.get(socket.identifier)
        if feature is None:
            continue
        if f.linked(node, scope, socket.identifier) or socket.default_value != 0.0:
            f.unsupported(node, feature)


def _principled_operands(f, node, scope, table) -> list:
    return [
        f.input(node, scope, name, size) if size else f.normal(node, scope, name)
        for name, size in table
    ]


def _principled_v1(f, node, scope, weight) -> None:
    """Alpha mixes with a transparent surface; emission is added below it."""
    program = f.program
    alpha = f.input(node, scope, "Alpha", 1)
    if alpha.known != (1.0,):
        alpha = program.clamped(alpha)
        transparent = program.product(weight, program.complement(alpha))
        f.closure("Transparent", transparent, [program.constant(1.0, 1.0, 1.0)])
        weight = program.product(weight, alpha)
    color = f.input(node, scope, "Emission", 3)
    strength = f.input(node, scope, "Emission Strength", 1)
    if color.known != (0.0, 0.0, 0.0) and strength.known != (0.0,):
        f.closure("Emission", weight, [color, strength])
    operands = _principled_operands(f, node, scope, _PRINCIPLED_V1)
    f.closure("PrincipledV1", weight, operands, _distribution(f, node))


def _principled(f, node, scope, weight) -> None:
    _name_missing_features(f, node, scope)
    if any(socket.identifier == "Specular" for socket in node.inputs):
        _principled_v1(f, node, scope, weight)
        return
    operands = _principled_operands(f, node, scope, _PRINCIPLED_V2)
    f.closure("PrincipledV2", weight, operands, _distribution(f, node))


def _mix(f, node, scope, weight) -> None:
    first, second = node.inputs[1].identifier, node.inputs[2].identifier
    factor = f.program.clamped(f.input(node, scope, node.inputs[0].identifier, 1))
    f.shader(node, scope, first, f.program.product(weight, f.program.complement(factor)))
    f.shader(node, scope, second, f.program.product(weight, factor))


def _add(f, node, scope, weight) -> None:
    for socket in node.inputs:
        f.shader(node, scope, socket.identifier, weight)


def _inputs(f, node, scope, table) -> list:
    return _principled_operands(f, node, scope, table)


def _simple(code: str, table, with_distribution: bool = False):
    """A node whose inputs are the closure's operands."""

    def handler(f, node, scope, weight) -> None:
        _name_missing_features(f, node, scope)
        mode = _distribution(f, node) if with_distribution else 0
        f.closure(code, weight, _inputs(f, node, scope, table), mode)

    return handler


def _glossy(f, node, scope, weight) -> None:
    """Isotropic where nothing says otherwise: the cheaper closure."""
    amount = f.input(node, scope, "Anisotropy", 1)
    if amount.known == (0.0,):
        _ROUND_GLOSSY(f, node, scope, weight)
    else:
        _ANISOTROPIC(f, node, scope, weight)


def _metallic(f, node, scope, weight) -> None:
    """By the colours of an edge-tinted metal, or by complex indices of refraction."""
    _name_missing_features(f, node, scope)
    physical = node.fresnel_type == "PHYSICAL_CONDUCTOR"
    names = ("IOR", "Extinction") if physical else ("Base Color", "Edge Tint")
    operands = _inputs(f, node, scope, [(name, 3) for name in names] + list(_ANISOTROPY))
    mode = _distribution(f, node) | (f.native.PHYSICAL_BIT if physical else 0)
    f.closure("Metallic", weight, operands, mode)


def _toon(f, node, scope, weight) -> None:
    operands = _inputs(f, node, scope, (_COLOR, ("Size", 1), ("Smooth", 1), _NORMAL))
    f.closure("Toon", weight, operands, 1 if node.component == "GLOSSY" else 0)


def _sheen(f, node, scope, weight) -> None:
    code = "Velvet" if node.distribution == "ASHIKHMIN" else "Sheen"
    f.closure(code, weight, _inputs(f, node, scope, (_COLOR, _ROUGHNESS, _NORMAL)))


def _approximated(code: str, table, constants=()):
    """A node rendered as another closure, and said so."""

    def handler(f, node, scope, weight) -> None:
        f.unsupported(node, f"rendered as {code.lower()}; the node itself")
        operands = _inputs(f, node, scope, table) + [f.program.constant(c) for c in constants]
        f.closure(code, weight, [*operands, f.normal(node, scope)])

    return handler


def _nothing(f, node, scope, weight) -> None:
    f.unsupported(node)


_COLOR = ("Color", 3)
_ROUGHNESS = ("Roughness", 1)
_NORMAL = ("Normal", 0)
_ANISOTROPY = (_ROUGHNESS, ("Anisotropy", 1), ("Rotation", 1), ("Tangent", 0), _NORMAL)
_ROUND_GLOSSY = _simple("Glossy", (_COLOR, _ROUGHNESS, _NORMAL), with_distribution=True)
_ANISOTROPIC = _simple("Anisotropic", (_COLOR, *_ANISOTROPY), with_distribution=True)

CLOSURES = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
    "ShaderNodeBsdfDiffuse": _simple("Diffuse", (_COLOR, _ROUGHNESS, _NORMAL)),
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlass": _simple(
        "Glass", (_COLOR, _ROUGHNESS, ("IOR", 1), _NORMAL), with_distribution=True
    ),
    "ShaderNodeBsdfRefraction": _simple(
        "Refraction", (_COLOR, _ROUGHNESS, ("IOR", 1), _NORMAL), with_distribution=True
    ),
    "ShaderNodeBsdfTransparent": _simple("Transparent", (_COLOR,)),
    "ShaderNodeBsdfTranslucent": _simple("Translucent", (_COLOR, _NORMAL)),
    "ShaderNodeEmission": _simple("Emission", (_COLOR, ("Strength", 1))),
    "ShaderNodeBackground": _simple("Background", (_COLOR, ("Strength", 1))),
    "ShaderNodeSubsurfaceScattering": _approximated("Diffuse", (_COLOR,), (0.0,)),
    "ShaderNodeBsdfVelvet": _simple("Velvet", (_COLOR, ("Sigma", 1), _NORMAL)),
    "ShaderNodeBsdfSheen": _sheen,
    "ShaderNodeBsdfToon": _toon,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeBsdfHair": _approximated("Glossy", (_COLOR, ("RoughnessU", 1))),
    "ShaderNodeBsdfHairPrincipled": _approximated("Glossy", (_COLOR, _ROUGHNESS)),
    "ShaderNodeHoldout": _nothing,
}
