"""Nodes that tell where a hit is: coordinates, geometry, object, camera, path. Handlers as in
node_values.
"""

from __future__ import annotations

from .attributes import INSTANCER, OBJECT, OBJECT_INFO
from .lamp_nodes import lamp_coordinate, lamp_geometry


def camel(name: str) -> str:
    """MULTIPLY_ADD as the native side writes it: MultiplyAdd."""
    return "".join(part.capitalize() for part in name.split("_"))


def uv(f, name: str = ""):
    if f.lamp is not None:
        return lamp_coordinate(f, f.lamp, "UV")
    return f.program.op("Uv", [], 3, f.program.name_index(name))


def coordinate(f, name: str):
    of_lamp = lamp_coordinate(f, f.lamp, name) if f.lamp is not None else None
    if of_lamp is not None:
        return of_lamp
    return f.program.op("Coordinate", [], 3, f.native.CoordinateOutput[name])


def _texture_coordinate(f, node, scope, socket):
    if node.from_instancer:
        f.unsupported(node, "'From Instancer'")
    if socket.identifier == "Object" and node.object is not None:
        f.unsupported(node, "another object's space")
    if socket.identifier == "UV":
        return uv(f)
    return coordinate(f, socket.identifier)


def _uv_map(f, node, scope, socket):
    if node.from_instancer:
        f.unsupported(node, "'From Instancer'")
    return uv(f, node.uv_map)


def surface_normal(f):
    """The normal that a surface has before its nodes change it: displacement may have."""
    displaced = f.program.default_normal
    if displaced.operand != f.native.DEFAULT_OPERAND:
        return displaced
    return f.program.op("Geometry", [], 3, f.native.GeometryOutput["Normal"])


_GEOMETRY = {
    "Position": 3,
    "Normal": 3,
    "Tangent": 3,
    "True Normal": 3,
    "Incoming": 3,
    "Parametric": 3,
    "Backfacing": 1,
}


def _geometry(f, node, scope, socket):
    size = _GEOMETRY.get(socket.identifier)
    if size is None:
        return None
    of_lamp = lamp_geometry(f, f.lamp, socket.identifier) if f.lamp is not None else None
    if of_lamp is not None:
        return of_lamp
    if socket.identifier == "Normal":
        return surface_normal(f)
    mode = f.native.GeometryOutput[socket.identifier.replace(" ", "")]
    return f.program.op("Geometry", [], size, mode)


_AXES = {"X": 0, "Y": 1, "Z": 2}


def _tangent(f, node, scope, socket):
    if node.direction_type == "RADIAL":
        return f.program.op("Tangent", [], 3, _AXES[node.axis])
    f.program.reads_uv = True
    name = f.program.name_of(node.uv_map) + 1 if node.uv_map else 0
    return f.program.op("Tangent", [], 3, 3 + 4 * name)


def _named_output(code: str, enumeration: str, sizes: dict):
    """A node whose outputs are the modes of one operation."""

    def handler(f, node, scope, socket):
        name = socket.identifier.replace(" ", "")
        modes = getattr(f.native, enumeration)
        if name not in modes:
            return None
        return f.program.op(code, [], sizes.get(name, 1), modes[name])

    return handler


def _object_info(f, node, scope, socket):
    name = socket.identifier
    if name == "Location":
        return f.program.op("ObjectInfo", [], 3, f.native.ObjectInfoOutput["Location"])
    if name == "Material Index":
        return f.program.constant(f.material_index)
    what = {"Object Index": "Index", "Alpha": "Color"}.get(name, name)
    value = instance_attribute(f, OBJECT_INFO + what)
    if name == "Alpha":
        return f.program.component(value, 3)
    return f.program.slice(value, 3 if name == "Color" else 1)


def instance_attribute(f, name: str):
    f.program.instance_attributes.add(name)
    return f.program.op("InstanceAttribute", [], 5, f.program.name_index(name))


def _mesh_attribute(f, name: str):
    f.program.mesh_attributes.add(name)
    return f.program.op("Attribute", [], 5, f.program.name_of(name))


_ATTRIBUTE_PARTS = {"Color": (0, 3), "Vector": (0, 3), "Alpha": (3, 1), "Fac": (4, 1)}


def _attribute(f, node, scope, socket):
    kind = node.attribute_type
    if kind == "GEOMETRY":
        value = _mesh_attribute(f, node.attribute_name)
    elif kind in {"OBJECT", "INSTANCER"}:
        prefix = OBJECT if kind == "OBJECT" else INSTANCER
        value = instance_attribute(f, prefix + node.attribute_name)
    else:
        return None
    return f.program.part(value, *_ATTRIBUTE_PARTS[socket.identifier])


def _color_attribute(f, node, scope, socket):
    value = _mesh_attribute(f, node.layer_name)
    return f.program.part(value, *_ATTRIBUTE_PARTS[socket.identifier])


def vector_or(f, node, scope, default):
    """The Vector input, or a texture's own coordinates."""
    return f.input(node, scope, "Vector", 3) if f.linked(node, scope, "Vector") else default()


def direction(f):
    if f.is_world:
        return coordinate(f, "Generated")
    return f.program.op("Geometry", [], 3, f.native.GeometryOutput["Position"])


def vector_or_generated(f, node, scope):
    return vector_or(f, node, scope, lambda: coordinate(f, "Generated"))


COORDINATES = {
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeCameraData": _named_output("CameraData", "CameraDataOutput", {"ViewVector": 3}),
    "ShaderNodeLightPath": _named_output("LightPath", "LightPathOutput", {}),
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeTangent": _tangent,
    "ShaderNodeVertexColor": _color_attribute,
}
