"""Image and environment textures. Handlers as in node_values."""

from __future__ import annotations

from .node_coordinates import camel, direction, uv, vector_or


def _image_use(f, node, projection: str) -> int:
    return f.program.add_image_use(
        image=f.images.index(node.image, node.image_user),
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


IMAGES = {
    "ShaderNodeTexImage": _image,
    "ShaderNodeTexEnvironment": _environment,
}
