"""True displacement against Cycles of the same host: where vertices go, and how they are shaded."""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_SIDE = 24  # quads along a side


def _grid(smooth: bool):
    """A square of small quads with a UV map."""
    places = np.linspace(-1.0, 1.0, _SIDE + 1)
    vertices = [(x, y, 0.1 * x * x) for y in places for x in places]
    row = _SIDE + 1
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    faces = [
        tuple((y + b) * row + x + a for a, b in corners) for y in range(_SIDE) for x in range(_SIDE)
    ]
    mesh = harness.make_mesh("Grid", vertices, faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    layer = mesh.uv_layers.new(name="UVMap")
    for loop, corner in zip(mesh.loops, layer.data):
        x, y, _ = vertices[loop.vertex_index]
        corner.uv = (0.5 * x + 0.5, 0.5 * y + 0.5)
    return mesh


def _method(owner, name: str) -> None:
    if hasattr(owner, "displacement_method"):
        owner.displacement_method = name
    else:
        owner.cycles.displacement_method = name


def _waves(owner):
    """A height from UV, between 0 and 1."""
    uv = harness.node(owner, "ShaderNodeUVMap")
    wave = harness.node(owner, "ShaderNodeTexWave", Scale=0.6, Distortion=2.0, Detail=1.0)
    harness.connect(owner, uv.outputs[0], wave.inputs[0])
    return wave.outputs["Color"]


def _heights(owner, space: str):
    node = harness.node(owner, "ShaderNodeDisplacement", Midlevel=0.3, Scale=0.35)
    node.space = space
    harness.connect(owner, _waves(owner), node.inputs["Height"])
    return node.outputs[0]


def _vectors(owner, space: str):
    node = harness.node(owner, "ShaderNodeVectorDisplacement", Midlevel=0.5, Scale=0.3)
    node.space = space
    where = harness.node(owner, "ShaderNodeTexNoise", Scale=1.3, Detail=0.0)
    uv = harness.node(owner, "ShaderNodeUVMap")
    harness.connect(owner, uv.outputs[0], where.inputs["Vector"])
    harness.connect(owner, where.outputs["Color"], node.inputs["Vector"])
    return node.outputs[0]


def _scene(method: str, smooth: bool, build, space: str, samples: int):
    scene = harness.new_scene(24, 24, samples)
    settings(samples)
    scene.cycles.light_sampling_threshold = 0.0
    scene.pharos.follow_cycles = True
    owner = harness.material()
    _method(owner, method)
    shader = harness.node(owner, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.6, 0.4, 1.0))
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    output = owner.node_tree.get_output_node("ALL")
    harness.connect(owner, build(owner, space), output.inputs["Displacement"])
    grid = harness.add_object(_grid(smooth), owner)
    grid.rotation_euler, grid.scale = (-0.5, 0.0, 0.4), (1.2, 0.9, 1.5)
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 3.0, 0.05
    sun = harness.link(bpy.data.objects.new("Sun", light))
    sun.rotation_euler = (0.9, 0.3, 0.0)
    harness.add_camera((0.0, 0.0, 6.0), type="ORTHO", ortho_scale=2.6)
    return scene


def _compare(name: str, tolerance: float, found=()) -> None:
    scene, layer = bpy.context.scene, bpy.context.view_layer
    pictures = []
    layer.use_pass_z = layer.use_pass_normal = True
    try:
        for engine in ("CYCLES", "PHAROS"):
            scene.render.engine = engine
            pictures.append(harness.render_layers(engine))
    finally:
        layer.use_pass_z = layer.use_pass_normal = False
        scene.pharos.follow_cycles = False
    theirs, ours = pictures
    deep = np.abs(ours["Depth.Z"] - theirs["Depth.Z"])
    solid = theirs["Depth.Z"] < 1e9
    # Depth is that of one sample within the pixel.
    assert np.mean(deep[solid] > 0.15) < 0.06, (name, np.mean(deep[solid] > 0.15))
    worst = 0.0
    for channel in ("Combined.R", "Normal.X", "Normal.Y", "Normal.Z"):
        a, b = (p[channel].reshape(6, 4, 6, 4).mean(axis=(1, 3)) for p in pictures)
        worst = max(worst, np.abs(a - b).max() / np.abs(theirs[channel]).max())
    harness.say(f"MEASURED {name}: blocks {worst:.4f}")
    assert worst < tolerance, (name, worst)
    assert harness.report() == list(found), harness.report()


def test_vertices_go_where_cycles_moves_them():
    for smooth in (True, False):
        for space in ("OBJECT", "WORLD"):
            _scene("DISPLACEMENT", smooth, _heights, space, 64)
            _compare(f"height {space} smooth {smooth}", 0.03)
            _scene("DISPLACEMENT", smooth, _vectors, space, 64)
            _compare(f"vector {space} smooth {smooth}", 0.03)


def test_displacement_with_bump():
    """Vertices move, what they cannot hold is missing and named: a third of a block at most."""
    _scene("BOTH", True, _heights, "OBJECT", 64)
    from pharos.export.nodes import NO_BUMP_BESIDE_DISPLACEMENT

    _compare("both", 0.4, [f"Material: {NO_BUMP_BESIDE_DISPLACEMENT}"])


def test_what_is_not_moved_is_named():
    _scene("DISPLACEMENT", True, _vectors, "TANGENT", 1)
    harness.render()
    bpy.context.scene.pharos.follow_cycles = False
    assert len(harness.report()) == 1 and "tangent space" in harness.report()[0], harness.report()


def test_shared_meshes_move_once_for_each_set_of_materials():
    _scene("DISPLACEMENT", True, _heights, "OBJECT", 1)
    grid = bpy.data.objects["Grid"]
    for i in range(3):
        other = harness.link(bpy.data.objects.new(f"Other{i}", grid.data))
        other.location = (0.0, 0.0, -1.0 - i)
    out = harness.exported()
    bpy.context.scene.pharos.follow_cycles = False
    assert out.mesh_count == 1 and len(out.instances) == 4
    assert harness.ops_of(out.materials[0].displacement)[-1] == "AovValue"


harness.main(globals())
