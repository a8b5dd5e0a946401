"""Node trees: weights of mixed shaders, groups, reroutes, mutes, conversions, what is named."""
# hosts: blender bpy

import bpy
import harness


def _flattened(owner):
    """The program of a material on a plane."""
    out = harness.exported()
    (found,) = [m for m in out.materials if m.name == owner.name]
    return found.program


def _prepared(name: str = "Material"):
    harness.new_scene()
    harness.add_camera()
    owner = harness.material(name)
    harness.add_object(harness.plane_mesh(), owner)
    return owner


def test_every_closure_node():
    kinds = {
        "ShaderNodeBsdfDiffuse": "Diffuse",
        "ShaderNodeBsdfGlossy": "Glossy",
        "ShaderNodeBsdfGlass": "Glass",
        "ShaderNodeBsdfRefraction": "Refraction",
        "ShaderNodeBsdfTransparent": "Transparent",
        "ShaderNodeBsdfTranslucent": "Translucent",
        "ShaderNodeEmission": "Emission",
    }
    for kind, code in kinds.items():
        owner = _prepared()
        shader = harness.node(owner, kind, Color=(0.1, 0.2, 0.3, 1.0))
        harness.connect(owner, shader.outputs[0], harness.surface(owner))
        program = _flattened(owner)
        assert harness.ops_of(program) == [code], (kind, harness.ops_of(program))
        assert harness.operand(program, 0, 0, 3) == [1.0, 1.0, 1.0]
        assert harness.operand(program, 0, 1, 3) == [0.1, 0.2, 0.3]
        assert harness.report() == [], harness.report()


def test_principled():
    owner = _prepared()
    shader = harness.node(owner, "ShaderNodeBsdfPrincipled", Roughness=0.25, Alpha=0.5)
    name = "Emission" if harness.VERSION < (4, 0, 0) else "Emission Color"
    shader.inputs[name].default_value = (1.0, 0.5, 0.25, 1.0)
    shader.inputs["Emission Strength"].default_value = 2.0
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    module = harness.native()
    if harness.VERSION < (4, 0, 0):
        assert harness.ops_of(program) == ["Transparent", "Emission", "PrincipledV1"]
        assert harness.operand(program, 0, 0, 3) == [0.5, 0.5, 0.5]
        assert harness.operand(program, 1, 1, 3) == [1.0, 0.5, 0.25]
        assert harness.operand(program, 2, 7, 1) == [0.25]
        assert len(program.ops[2][3]) == 1 + module.PRINCIPLED_V1_OPERANDS
    else:
        assert harness.ops_of(program) == ["PrincipledV2"]
        assert harness.operand(program, 0, 3, 1) == [0.25]
        assert harness.operand(program, 0, 19, 3) == [1.0, 0.5, 0.25]
        assert harness.operand(program, 0, 20, 1) == [2.0]
        assert harness.operand(program, 0, 23, 1) == [0.5]
        assert len(program.ops[0][3]) == 1 + module.PRINCIPLED_V2_OPERANDS


def test_mix_and_add_weights():
    owner = _prepared()
    mix = harness.node(owner, "ShaderNodeMixShader", Fac=0.25)
    add = harness.node(owner, "ShaderNodeAddShader")
    shaders = [harness.node(owner, "ShaderNodeBsdfDiffuse") for _ in range(3)]
    harness.connect(owner, shaders[0].outputs[0], mix.inputs[1])
    harness.connect(owner, add.outputs[0], mix.inputs[2])
    harness.connect(owner, shaders[1].outputs[0], add.inputs[0])
    harness.connect(owner, shaders[2].outputs[0], add.inputs[1])
    harness.connect(owner, mix.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Diffuse"] * 3
    weights = [harness.operand(program, i, 0, 3)[0] for i in range(3)]
    assert weights == [0.75, 0.25, 0.25], weights
    mix.inputs[0].default_value = 1.0
    assert len(_flattened(owner).ops) == 2  # a weight of zero leaves nothing


def test_textured_mix_factor():
    owner = _prepared()
    mix = harness.node(owner, "ShaderNodeMixShader")
    weight = harness.node(owner, "ShaderNodeLayerWeight")
    harness.connect(owner, weight.outputs[1], mix.inputs[0])
    for i in (1, 2):
        shader = harness.node(owner, "ShaderNodeEmission")
        harness.connect(owner, shader.outputs[0], mix.inputs[i])
    harness.connect(owner, mix.outputs[0], harness.surface(owner))
    ops = harness.ops_of(_flattened(owner))
    assert ops.count("Emission") == 2 and ops.count("LayerWeight") == 1, ops


def test_group_reroute_and_mute():
    owner = _prepared()
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    if hasattr(tree, "interface"):
        tree.interface.new_socket("Shade", in_out="INPUT", socket_type="NodeSocketColor")
        tree.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketShader")
    else:
        tree.inputs.new("NodeSocketColor", "Shade")
        tree.outputs.new("NodeSocketShader", "Result")
    entry, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    diffuse, gamma = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeGamma")
    reroute = tree.nodes.new("NodeReroute")
    gamma.mute = True
    tree.links.new(entry.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], gamma.inputs[0])
    tree.links.new(gamma.outputs[0], diffuse.inputs[0])
    tree.links.new(diffuse.outputs[0], leave.inputs[0])
    groups = []
    add = harness.node(owner, "ShaderNodeAddShader")
    for i, color in enumerate(((0.1, 0.2, 0.3, 1.0), (0.4, 0.5, 0.6, 1.0))):
        group = owner.node_tree.nodes.new("ShaderNodeGroup")
        group.node_tree = tree
        group.inputs[0].default_value = color
        harness.connect(owner, group.outputs[0], add.inputs[i])
        groups.append(group)
    harness.connect(owner, add.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Diffuse"] * 2, harness.ops_of(program)
    colors = [harness.operand(program, i, 1, 3) for i in range(2)]
    assert colors == [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], colors


def test_implicit_conversions():
    owner = _prepared()
    shader = harness.node(owner, "ShaderNodeBsdfGlossy")
    geometry = harness.node(owner, "ShaderNodeNewGeometry")
    color = harness.node(owner, "ShaderNodeRGB")
    color.outputs[0].default_value = (1.0, 0.0, 0.0, 1.0)
    harness.connect(owner, geometry.outputs["Backfacing"], shader.inputs["Color"])
    harness.connect(owner, color.outputs[0], shader.inputs["Roughness"])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Geometry", "ScalarToVector", "Glossy"]
    assert harness.operand(program, 2, 2, 1) == [0.2126]
    harness.connect(owner, geometry.outputs["Position"], shader.inputs["Roughness"])
    assert "VectorAverage" in harness.ops_of(_flattened(owner))


def test_colour_as_shader_emits():
    owner = _prepared()
    color = harness.node(owner, "ShaderNodeRGB")
    color.outputs[0].default_value = (1.0, 0.5, 0.0, 1.0)
    harness.connect(owner, color.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Emission"]
    assert harness.operand(program, 0, 1, 3) == [1.0, 0.5, 0.0]


def test_unknown_nodes_are_named_and_have_their_default():
    owner = _prepared("Strange")
    shader = harness.node(owner, "ShaderNodeBsdfDiffuse")
    noise = harness.node(owner, "ShaderNodeTexPointDensity")
    harness.connect(owner, noise.outputs["Color"], shader.inputs["Color"])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Diffuse"]
    lines = harness.report()
    assert any(line.startswith("Strange: ") and "Point Density" in line for line in lines), lines


def test_image_sources():
    owner = _prepared()
    shader = harness.node(owner, "ShaderNodeBsdfDiffuse")
    texture = harness.node(owner, "ShaderNodeTexImage")
    texture.interpolation, texture.extension = "Closest", "EXTEND"
    harness.connect(owner, texture.outputs[0], shader.inputs[0])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    image = bpy.data.images.new("Made", 3, 2)
    image.pixels[0:4] = (1.0, 0.5, 0.25, 1.0)
    texture.image = image
    out = harness.exported()
    assert (out.images[0].width, out.images[0].height) == (3, 2)
    assert harness.close(out.images[0].pixels.ravel()[:3], (1.0, 0.5, 0.25), 3e-3)
    assert str(out.images[0].color_space).endswith("Srgb")
    use = next(m for m in out.materials if m.name == owner.name).program.images[0]
    assert str(use.interpolation).endswith("Closest") and str(use.extension).endswith("Extend")

    path = harness.TEMPORARY / "picture.png"
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    texture.image = bpy.data.images.load(str(path))
    texture.image.colorspace_settings.name = "Non-Color"
    out = harness.exported()
    first = out.images[0]
    assert first.byte_count == path.stat().st_size  # a dump embeds files
    assert str(first.color_space).endswith("Data"), first.color_space
    texture.image.pack()
    out = harness.exported()
    assert out.images[0].path == "" and out.images[0].byte_count == path.stat().st_size
    texture.image.unpack(method="REMOVE")
    texture.image.filepath = str(harness.TEMPORARY / "gone.png")
    assert harness.exported().images[0].path == texture.image.filepath
    texture.image = None
    program = _flattened(owner)
    assert program.images[0].image == harness.native().NONE


def test_without_nodes():
    owner = _prepared()
    if harness.VERSION >= (5, 0, 0):
        raise harness.Skip("materials always have nodes")
    owner.use_nodes = False
    owner.diffuse_color = (0.1, 0.2, 0.3, 1.0)
    program = _flattened(owner)
    assert harness.ops_of(program) == ["Diffuse"]
    assert harness.operand(program, 0, 1, 3) == [0.1, 0.2, 0.3]


def test_every_value_node_flattens():
    """No known node raises or goes unnamed, whatever its settings."""
    values = __import__("pharos.export.node_values", fromlist=["VALUES"]).VALUES
    module = harness.native()
    for kind in values:
        owner = _prepared()
        try:
            made = harness.node(owner, kind)
        except RuntimeError:
            continue  # not in this version
        shader = harness.node(owner, "ShaderNodeEmission")
        harness.connect(owner, shader.outputs[0], harness.surface(owner))
        for output in made.outputs:
            if not output.enabled or output.type == "ROTATION":
                continue
            harness.connect(owner, output, shader.inputs[0])
            program = _flattened(owner)
            assert program.ops and program.ops[-1][0] == module.NodeOpCode["Emission"], kind


def test_modes_of_nodes():
    """Every mode of the nodes with modes has a number or is named."""
    cases = {
        "ShaderNodeMath": "operation",
        "ShaderNodeVectorMath": "operation",
        "ShaderNodeMixRGB": "blend_type",
        "ShaderNodeMapping": "vector_type",
        "ShaderNodeMapRange": "interpolation_type",
        "ShaderNodeVectorRotate": "rotation_type",
        "ShaderNodeTexGradient": "gradient_type",
        "ShaderNodeNormalMap": "space",
        "ShaderNodeSeparateColor": "mode",
        "ShaderNodeCombineColor": "mode",
    }
    for kind, name in cases.items():
        owner = _prepared()
        made = harness.node(owner, kind)
        shader = harness.node(owner, "ShaderNodeEmission")
        harness.connect(owner, shader.outputs[0], harness.surface(owner))
        for item in made.bl_rna.properties[name].enum_items:
            setattr(made, name, item.identifier)
            output = next(o for o in made.outputs if o.enabled)
            harness.connect(owner, output, shader.inputs[0])
            _flattened(owner)
            named = [line for line in harness.report() if "BLENDER_" not in line]
            assert named == [], (kind, item.identifier, named)


def test_ring_of_links():
    owner = _prepared()
    a, b = (harness.node(owner, "ShaderNodeGamma") for _ in range(2))
    harness.connect(owner, a.outputs[0], b.inputs[0])
    harness.connect(owner, b.outputs[0], a.inputs[0])
    shader = harness.node(owner, "ShaderNodeEmission")
    harness.connect(owner, b.outputs[0], shader.inputs[0])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    assert "Emission" in harness.ops_of(_flattened(owner))


harness.main(globals())
