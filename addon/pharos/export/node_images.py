"""Image and environment textures. Handlers as in node_values."""

from __future__ import annotations

from .node_coordinates import camel, direction, uv, vector_or


def _image_use(f, node, projection: str) -> int:
    # A box is looked at through the first tile alone, as in Cycles.
    tiles = f.images.tiles(node.image, node.image_user) if projection != "BOX" else []
    return f.program.add_image_use(
        image=tiles[0].image if tiles else f.images.index(node.image, node.image_user),
        tiles=tiles,
        interpolation=getattr(f.native.ImageInterpolation, camel(node.interpolation)),
        extension=_extension(f, node),
        projection=getattr(f.native.ImageProjection, camel(projection)),
        projection_blend=getattr(node, "projection_blend", 0.0),
    )


def _extension(f, node):
    name = camel(getattr(node, "extension", "REPEAT"))
    extension = getattr(f.native.ImageExtension, name, None)
    if extension is None:
        f.unsupported(node, f"extension {node.extension!r}")
        extension = f.native.ImageExtension.Repeat
    return extension


def _memoised_image(f, node, scope, make):
    """Colour and alpha of a node share one operation."""
    key = (scope.path, node.name, f.program.step)
    if key not in f.image_values:
        f.image_values[key] = make()
    return f.image_values[key]


def _image(f, node, scope, socket):
    def make():
        vector = vector_or(f, node, scope, lambda: uv(f))
        return f.program.op("Image", [vector], 4, _image_use(f, node, node.projection))

    value = _memoised_image(f, node, scope, make)
    return f.program.component(value, 3) if socket.identifier == "Alpha" else value


def _environment(f, node, scope, socket):
    def make():
        vector = vector_or(f, node, scope, lambda: direction(f))
        return f.program.op("EnvironmentImage", [vector], 4, _image_use(f, node, node.projection))

    return _memoised_image(f, node, scope, make)


_SKIES = {"PREETHAM": 0.0, "HOSEK_WILKIE": 0.0}


def _sky(f, node, scope, socket):
    kind = node.sky_type
    if kind == "HOSEK_WILKIE":
        f.unsupported(node, "the sky of Hosek and Wilkie (that of Preetham is shown)")
    elif kind not in _SKIES and f.version >= 500:
        f.inform(node, "The scattered sky is that of Blender 4.")
    vector = vector_or(f, node, scope, lambda: direction(f))
    single = kind not in _SKIES
    # Dust became aerosols in Blender 5.
    dust = node.dust_density if hasattr(node, "dust_density") else node.aerosol_density
    rows = [
        (_SKIES.get(kind, 1.0), node.turbidity, node.sun_elevation, node.sun_rotation),
        (node.altitude, node.air_density, dust, node.ozone_density),
        (node.sun_disc, node.sun_size, node.sun_intensity, 0.0),
        (*((0.0, 0.0, 1.0) if single else node.sun_direction), 0.0),
    ]
    return f.program.op("Sky", [vector], 3, f.program.add_table(rows))


IMAGES = {
    "ShaderNodeTexImage": _image,
    "ShaderNodeTexEnvironment": _environment,
    "ShaderNodeTexSky": _sky,
}
