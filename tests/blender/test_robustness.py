"""Scenes that are broken or odd in what only Blender can make: all of them render."""
# hosts: blender bpy

from contextlib import suppress

import bpy
import harness
import numpy as np

_ODD = []


def _renders(what: str) -> np.ndarray:
    pixels = harness.render("odd")
    assert np.isfinite(pixels).all(), what
    _ODD.append(what)
    return pixels


def _card(material):
    """Once the material is made: a new scene removes all there are."""
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), material)


def _nested(depth: int):
    """An emission inside so many groups."""
    tree = bpy.data.node_groups.new("Level0", "ShaderNodeTree")
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs[0].default_value = (0.25, 0.5, 0.75, 1.0)
    for level in range(depth + 1):
        output = tree.nodes.new("NodeGroupOutput")
        if hasattr(tree, "interface"):
            tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        else:
            tree.outputs.new("NodeSocketShader", "Shader")
        inner = next(n for n in tree.nodes if n is not output and n.outputs)
        tree.links.new(inner.outputs[0], output.inputs[0])
        if level == depth:
            return tree
        outer = bpy.data.node_groups.new(f"Level{level + 1}", "ShaderNodeTree")
        outer.nodes.new("ShaderNodeGroup").node_tree = tree
        tree = outer
    return tree


def test_groups_nested_fifty_deep():
    harness.new_scene(8, 8, 2)
    material = harness.material("Nested")
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = _nested(50)
    harness.connect(material, group.outputs[0], harness.surface(material))
    _card(material)
    pixels = _renders("groups nested 50 deep")
    assert harness.close(pixels[..., :3], (0.25, 0.5, 0.75), 1e-5), pixels[4, 4]


def test_empty_trees():
    harness.new_scene(8, 8, 2)
    material = harness.material("Empty")
    material.node_tree.nodes.clear()
    _card(material)
    bpy.context.scene.world.use_nodes = True
    bpy.context.scene.world.node_tree.nodes.clear()
    assert not _renders("empty node trees")[..., :3].any()


def test_cyclic_links():
    harness.new_scene(8, 8, 2)
    material = harness.material("Cyclic")
    first, second = (harness.node(material, "ShaderNodeMath") for _ in range(2))
    shader = harness.node(material, "ShaderNodeEmission")
    harness.connect(material, first.outputs[0], second.inputs[0])
    harness.connect(material, second.outputs[0], first.inputs[0])
    harness.connect(material, second.outputs[0], shader.inputs["Strength"])
    harness.connect(material, shader.outputs[0], harness.surface(material))
    _card(material)
    _renders("cyclic links")


def test_muted_nodes():
    harness.new_scene(8, 8, 2)
    material = harness.emission((0.2, 0.4, 0.6))
    for node in material.node_tree.nodes:
        node.mute = node.bl_idname == "ShaderNodeEmission"
    _card(material)
    _renders("muted nodes")


def test_group_without_a_tree():
    harness.new_scene(8, 8, 2)
    material = harness.material("Missing")
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    assert group.node_tree is None
    _card(material)
    _renders("a group without a tree")


def test_missing_library():
    harness.new_scene(8, 8, 2)
    path = harness.TEMPORARY / "library.blend"
    bpy.data.libraries.write(str(path), {harness.emission(name="Linked")}, fake_user=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, target):
        target.materials = ["Linked"]
    linked = target.materials[0]
    _card(linked)
    _renders("a linked material")
    path.unlink()
    with suppress(RuntimeError):
        linked.library.reload()
    _renders("a missing library")


def test_addon_disabled_and_enabled_between_renders():
    harness.new_scene(8, 8, 2)
    _card(harness.emission((0.2, 0.4, 0.6)))
    module = harness.native()
    session = module.RenderSession(harness.exported(), 2)
    import addon_utils

    addon_utils.disable("pharos")
    session.cancel()
    assert session.wait(60.0)
    del session
    harness.enable_addon()
    bpy.context.scene.render.engine = "PHAROS"
    assert harness.close(_renders("add-on off and on")[..., :3], (0.2, 0.4, 0.6), 1e-5)


def test_say():
    harness.say(f"STRESS odd scenes in Blender that did not render|{len(_ODD)}|0|0")
    assert len(_ODD) >= 7, _ODD


harness.main(globals())
