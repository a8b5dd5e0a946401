"""Node trees of lamps against Cycles of the same host: seen in a mirror (chance hits), and on a
diffuse wall (next-event estimation).
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_NEW = harness.VERSION >= (4, 4, 0)
_LAMPS = {
    "AREA": {"size": 1.6, "size_y": 1.0, "shape": "RECTANGLE"},
    "POINT": {"shadow_soft_size": 0.5},
    "SPOT": {"shadow_soft_size": 0.5, "spot_size": 2.6, "spot_blend": 0.4},
    "SUN": {"angle": 1.0},
}


def _mirror_or_wall(mirror: bool):
    owner = harness.material("Receiver")
    kind = "ShaderNodeBsdfGlossy" if mirror else "ShaderNodeBsdfDiffuse"
    shader = harness.node(owner, kind, Color=(0.9, 0.9, 0.9, 1.0), Roughness=0.0)
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    return owner


def _scene(kind: str, mirror: bool, build, samples: int = 64, sphere: bool = False):
    """`build(tree)` returns what the lamp's Emission is coloured with."""
    scene = harness.new_scene(12, 12, samples)
    settings(samples)
    scene.cycles.light_sampling_threshold = 0.0
    scene.cycles.caustics_reflective = True
    scene.pharos.follow_cycles = True
    harness.add_object(harness.plane_mesh(half=4.0), _mirror_or_wall(mirror))
    harness.add_camera((0.0, 0.0, 6.0), type="ORTHO", ortho_scale=1.5)
    light = bpy.data.lights.new("Lamp", kind)
    light.energy = 1.0 if kind == "SUN" else 30.0
    for name, value in _LAMPS[kind].items():
        setattr(light, name, value)
    if hasattr(light, "use_soft_falloff"):
        light.use_soft_falloff = not sphere
    light.use_nodes = True
    tree = light.node_tree
    emitter = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
    output = build(tree)
    harness.covers(output.node.bl_idname)
    tree.links.new(output, emitter.inputs[0])
    lamp = harness.link(bpy.data.objects.new("Lamp", light))
    lamp.location, lamp.rotation_euler = (0.15, 0.1, 1.5), (0.15, -0.2, 0.6)
    return scene


def _render() -> dict[str, np.ndarray]:
    pictures = {}
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures[engine] = harness.render(engine)[..., :3]
    bpy.context.scene.pharos.follow_cycles = False
    assert harness.report() == [], harness.report()
    return pictures


def _compare(name: str, tolerance: float = 0.01) -> None:
    pictures = _render()
    a, b = (p.reshape(3, 4, 3, 4, 3).mean(axis=(1, 3)) for p in pictures.values())
    assert np.abs(a).mean() > 1e-3, "the picture is black"
    error = np.abs(a - b).max() / np.abs(a).mean()
    mean = np.abs(b.mean(axis=(0, 1)) - a.mean(axis=(0, 1))).max() / np.abs(a).mean()
    harness.say(f"MEASURED {name}: blocks {error:.4f}, mean {mean:.4f}")
    assert mean < tolerance and error < 4.0 * tolerance, (name, mean, error, a, b)


def _shifted(tree, output):
    """Coordinates made positive, each between 0 and 1 or so."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "MULTIPLY_ADD"
    node.inputs[1].default_value, node.inputs[2].default_value = (0.3,) * 3, (1.0,) * 3
    tree.links.new(output, node.inputs[0])
    return node.outputs[0]


def _coordinate(kind: str, name: str):
    def build(tree):
        return _shifted(tree, tree.nodes.new(kind).outputs[name])

    return build


_OUTPUTS = [("ShaderNodeTexCoord", n) for n in ("Generated", "Normal", "UV", "Object")]
_OUTPUTS += [("ShaderNodeNewGeometry", n) for n in ("Position", "Normal", "Incoming", "Parametric")]


def test_coordinates_in_a_mirror():
    for kind in _LAMPS:
        for node, name in _OUTPUTS:
            if not _NEW and (node, name) == ("ShaderNodeTexCoord", "Normal"):
                continue  # Cycles 3 gives rays another one than light samples
            _scene(kind, True, _coordinate(node, name))
            _compare(f"{kind} {node[10:]} {name}")


def test_coordinates_on_a_wall():
    for kind in _LAMPS:
        for name in ("UV", "Normal", "Object"):
            _scene(kind, False, _coordinate("ShaderNodeTexCoord", name), 400)
            _compare(f"{kind} {name} on a wall")


def test_spheres():
    if not _NEW:
        raise harness.Skip("bulbs are discs")
    for mirror in (True, False):
        for node, name in (("ShaderNodeTexCoord", "Normal"), ("ShaderNodeNewGeometry", "Position")):
            _scene("POINT", mirror, _coordinate(node, name), 400, sphere=True)
            _compare(f"sphere {name} {mirror}")


def _falloff(output: str, smooth: float):
    def build(tree):
        node = tree.nodes.new("ShaderNodeLightFalloff")
        node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 0.8, smooth
        return node.outputs[output]

    return build


def test_light_falloff():
    for output in ("Quadratic", "Linear", "Constant"):
        for smooth in (0.0, 2.0):
            _scene("POINT", False, _falloff(output, smooth), 400)
            _compare(f"falloff {output} {smooth}")


def _picture(tree):
    image = bpy.data.images.new("gobo", 8, 8)
    image.generated_type = "COLOR_GRID"
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension = image, "EXTEND"
    if not _NEW:
        where = tree.nodes.new("ShaderNodeNewGeometry")
        tree.links.new(where.outputs["Parametric"], node.inputs[0])
    return node.outputs[0]


def _warm(tree):
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = 4000.0
    return node.outputs[0]


def test_pictures_and_black_bodies():
    for kind in ("AREA", "SPOT"):
        for mirror in (True, False):
            if _NEW or kind == "AREA":
                _scene(kind, mirror, _picture, 400)
                _compare(f"{kind} picture {mirror}")
    _scene("AREA", False, _warm, 200)
    _compare("blackbody", 0.02)
    assert harness.exported().lights[0].program == harness.native().NONE


harness.main(globals())
