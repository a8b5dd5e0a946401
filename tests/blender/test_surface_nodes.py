"""What nodes tell of the surface: attributes, object info, bump. Against Cycles of the same host.

Values change over a pixel, and the engines sample it in other places: differences are bounded by
what that explains.
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_SIDE = 8
_PIXELS = 32
# Name: type, domain, field, components.
_ATTRIBUTES = {
    "float point": ("FLOAT", "POINT", "value", 1),
    "vector point": ("FLOAT_VECTOR", "POINT", "vector", 3),
    "color corner": ("FLOAT_COLOR", "CORNER", "color", 4),
    "byte corner": ("BYTE_COLOR", "CORNER", "color", 4),
    "color point": ("FLOAT_COLOR", "POINT", "color", 4),
    "float face": ("FLOAT", "FACE", "value", 1),
    "int face": ("INT", "FACE", "value", 1),
}


def _grid():
    """8 x 8 quads over [0, 8]^2, a gentle wave high."""
    rows, columns = np.mgrid[0 : _SIDE + 1, 0 : _SIDE + 1]
    height = 0.1 * np.sin(rows * 0.7) * np.cos(columns * 0.9)
    vertices = np.stack([columns, rows, height], axis=-1).reshape(-1, 3)
    first = (np.arange(_SIDE)[:, None] * (_SIDE + 1) + np.arange(_SIDE)).ravel()
    faces = first[:, None] + np.array([0, 1, _SIDE + 2, _SIDE + 1])
    mesh = harness.make_mesh("Grid", vertices.tolist(), faces.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    corners = vertices[faces.ravel(), :2] / _SIDE
    layer.data.foreach_set("uv", corners.astype(np.float32).ravel())
    return mesh


def _prepared(samples: int = 64):
    """A material, the socket that shows a colour, and the object."""
    harness.new_scene(_PIXELS, _PIXELS, samples)
    mesh = _grid()
    _add_attributes(mesh)
    settings(samples)
    owner = harness.material()
    emitter = harness.node(owner, "ShaderNodeEmission", Strength=1.0)
    harness.connect(owner, emitter.outputs[0], harness.surface(owner))
    obj = harness.add_object(mesh, owner)
    harness.add_camera((_SIDE / 2, _SIDE / 2, 10.0), type="ORTHO", ortho_scale=_SIDE)
    return owner, emitter.inputs[0], obj


def _compare(tolerance: float = 0.02, least_range: float = 0.05) -> None:
    for tree in (owner.node_tree for owner in bpy.data.materials if owner.node_tree):
        for link in tree.links:
            if link.to_node.bl_idname == "ShaderNodeEmission":
                harness.covers(link.from_node.bl_idname)
    pictures = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures.append(harness.render(engine)[..., :3])
    error = np.abs(pictures[0] - pictures[1])
    harness.say(f"MEASURED largest {error.max():.2e}, mean {error.mean():.2e}")
    assert np.ptp(pictures[0]) >= least_range, "the picture shows nothing"
    # Edges are hit by one engine and missed by the other: a fiftieth is left out.
    ordered = np.sort(error.ravel())[: int(0.98 * error.size)]
    assert ordered[-1] < tolerance, ordered[-20:]
    assert ordered.mean() < tolerance / 5.0, ordered.mean()
    assert harness.report() == [], harness.report()


def _add_attributes(mesh) -> None:
    random = np.random.default_rng(3)
    for name, (kind, domain, field, size) in _ATTRIBUTES.items():
        attribute = mesh.attributes.new(name, kind, domain)
        values = random.uniform(0.0, 1.0, len(attribute.data) * size)
        values = np.round(values * 3).astype(np.int32) if kind == "INT" else values
        attribute.data.foreach_set(field, values)


def test_mesh_attributes():
    for name in _ATTRIBUTES:
        for output in ("Color", "Fac"):
            owner, target, _ = _prepared()
            node = harness.node(owner, "ShaderNodeAttribute")
            node.attribute_name = name
            harness.connect(owner, node.outputs[output], target)
            _compare(0.05)


def test_color_attribute():
    for named in (True, False):
        owner, target, obj = _prepared()
        obj.data.color_attributes.render_color_index = 1
        node = harness.node(owner, "ShaderNodeVertexColor")
        node.layer_name = "byte corner" if named else ""
        harness.connect(owner, node.outputs["Color"], target)
        _compare(0.05)


def test_uv_map_as_attribute():
    owner, target, _ = _prepared()
    node = harness.node(owner, "ShaderNodeAttribute")
    node.attribute_name = "UVMap"
    harness.connect(owner, node.outputs["Vector"], target)
    _compare()


def test_object_info():
    outputs = ("Color", "Object Index", "Random", "Material Index", "Location")
    if harness.VERSION >= (3, 3, 0):
        outputs += ("Alpha",)
    for output in outputs:
        owner, target, obj = _prepared(samples=1)
        obj.name = "Something"
        obj.color, obj.pass_index = (0.2, 0.4, 0.8, 0.3), 3
        obj.location = (0.1, 0.2, 0.3)
        owner.pass_index = 2
        copy = harness.add_object(obj.data, name="Other", location=(5.0, 0.0, 1.0))
        copy.color = (0.9, 0.1, 0.5, 0.6)
        node = harness.node(owner, "ShaderNodeObjectInfo")
        harness.connect(owner, node.outputs[output], target)
        _compare(0.1, 0.0 if output == "Material Index" else 0.05)


def test_object_attribute():
    owner, target, obj = _prepared(samples=1)
    obj["strength"] = 0.375
    node = harness.node(owner, "ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "OBJECT", "strength"
    harness.connect(owner, node.outputs["Fac"], target)
    _compare(1e-3, 0.0)
    assert harness.close(harness.render("again")[8, 8, :3], [0.375] * 3)


def _shown_normal(owner, normal, target) -> None:
    """A normal as a colour in [0, 1]."""
    encode = harness.node(owner, "ShaderNodeVectorMath")
    encode.operation = "MULTIPLY_ADD"
    encode.inputs[1].default_value = encode.inputs[2].default_value = (0.5, 0.5, 0.5)
    harness.connect(owner, normal, encode.inputs[0])
    harness.connect(owner, encode.outputs[0], target)


def _bump(owner, coordinate: str, inverted: bool = False):
    place = harness.node(owner, "ShaderNodeTexCoord")
    wave = harness.node(owner, "ShaderNodeTexWave", Scale=0.06, Distortion=0.0)
    if coordinate in {"UV", "Generated"}:
        wave.inputs["Scale"].default_value = 0.5
    wave.bands_direction = "DIAGONAL"
    harness.connect(owner, place.outputs[coordinate], wave.inputs["Vector"])
    bump = harness.node(owner, "ShaderNodeBump", Strength=0.8, Distance=1.5)
    bump.invert = inverted
    harness.connect(owner, wave.outputs["Fac"], bump.inputs["Height"])
    return bump.outputs["Normal"]


def test_bump():
    for coordinate in ("Object", "UV", "Generated"):
        for inverted in (False, True):
            owner, target, obj = _prepared()
            obj.data.polygons.foreach_set("use_smooth", [True] * _SIDE * _SIDE)
            _shown_normal(owner, _bump(owner, coordinate, inverted), target)
            _compare(0.05)


def test_bump_of_an_attribute_and_perspective():
    owner, target, obj = _prepared()
    mesh = obj.data
    attribute = mesh.attributes.new("height", "FLOAT", "POINT")
    co = np.empty(len(mesh.vertices) * 3)
    mesh.vertices.foreach_get("co", co)
    attribute.data.foreach_set("value", np.sin(co.reshape(-1, 3)[:, 0]))
    node = harness.node(owner, "ShaderNodeAttribute")
    node.attribute_name = "height"
    bump = harness.node(owner, "ShaderNodeBump", Distance=0.5)
    harness.connect(owner, node.outputs["Fac"], bump.inputs["Height"])
    _shown_normal(owner, bump.outputs[0], target)
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.lens = "PERSP", 40.0
    camera.rotation_euler, camera.location = (0.4, 0.2, 0.1), (5.0, -1.0, 8.0)
    _compare(0.1)


def test_displacement_as_bump():
    owner, target, _ = _prepared()
    geometry = harness.node(owner, "ShaderNodeNewGeometry")
    place = harness.node(owner, "ShaderNodeTexCoord")
    wave = harness.node(owner, "ShaderNodeTexWave", Scale=0.06)
    displace = harness.node(owner, "ShaderNodeDisplacement", Scale=0.7, Midlevel=0.2)
    harness.connect(owner, place.outputs["Object"], wave.inputs["Vector"])
    harness.connect(owner, wave.outputs["Fac"], displace.inputs["Height"])
    output = owner.node_tree.get_output_node("ALL")
    harness.connect(owner, displace.outputs[0], output.inputs["Displacement"])
    _shown_normal(owner, geometry.outputs["Normal"], target)
    _compare(0.05)


harness.main(globals())
