"""A scene with everything that is not rendered as given: the report is the list below, no more and
no less, and each of its rows leads to what it is about.
"""
# hosts: blender bpy

import bpy
import harness

_BLENDER_4 = harness.VERSION >= (4, 0, 0)
_SCENE = "Everything"

# Nodes with values, one a material named as the node: the output that is read.
_VALUES = {
    "ShaderNodeAmbientOcclusion": "Color",
    "ShaderNodeBevel": "Normal",
    "ShaderNodeWireframe": "Fac",
    "ShaderNodeHairInfo": "Intercept",
    "ShaderNodeParticleInfo": "Age",
    "ShaderNodePointInfo": "Radius",
    "ShaderNodeVolumeInfo": "Color",
    "ShaderNodeTexIES": "Fac",
    "ShaderNodeTexPointDensity": "Color",
    "ShaderNodeShaderToRGB": "Color",
    "ShaderNodeWavelength": "Color",
    **({"ShaderNodeTexGabor": "Value"} if _BLENDER_4 else {}),
}
_HAIR_SHOWN = "rendered as glossy; the node itself"
_SHADERS = {
    "ShaderNodeHoldout": "",
    "ShaderNodeBsdfHair": _HAIR_SHOWN,
    "ShaderNodeBsdfHairPrincipled": _HAIR_SHOWN,
    "ShaderNodeSubsurfaceScattering": "rendered as diffuse; the node itself",
    "ShaderNodeEeveeSpecular": "",
    **({"ShaderNodeBsdfRayPortal": ""} if _BLENDER_4 else {}),
}
# Outputs and settings of nodes that are there otherwise.
_PARTS = {
    ("ShaderNodeNewGeometry", "Pointiness"): "output 'Pointiness'",
    ("ShaderNodeNewGeometry", "Random Per Island"): "output 'Random Per Island'",
}


def _unsupported(made, what: str = "") -> str:
    return f"Node {made.name!r} ({made.bl_label}){what and ': ' + what} is not supported."


class _Expected:
    """Entries by kind, name and message, with the node that a row leads to."""

    def __init__(self):
        self.entries: dict[tuple[str, str, str], str] = {}

    def add(self, kind: str, name: str, message: str, node: str = "") -> None:
        self.entries[kind, name, message] = node


def _shown(owner, shader) -> None:
    harness.connect(owner, shader.outputs[0], harness.surface(owner))


def _value_materials(expected):
    for kind, output in _VALUES.items():
        owner = harness.material(kind)
        made = harness.node(owner, kind)
        _read(owner, made.outputs[output])
        expected.add("MATERIAL", kind, _unsupported(made), made.name)
        yield owner
    for (kind, output), what in _PARTS.items():
        owner = harness.material(f"{kind} {output}")
        made = harness.node(owner, kind)
        _read(owner, made.outputs[output])
        expected.add("MATERIAL", owner.name, _unsupported(made, what), made.name)
        yield owner


def _read(owner, output) -> None:
    shader = harness.node(owner, "ShaderNodeBsdfDiffuse")
    harness.connect(owner, output, shader.inputs["Color"])
    _shown(owner, shader)


def _shader_materials(expected):
    for kind, what in _SHADERS.items():
        owner = harness.material(kind)
        made = harness.node(owner, kind)
        _shown(owner, made)
        expected.add("MATERIAL", kind, _unsupported(made, what), made.name)
        yield owner


def _setting_materials(expected):
    """Nodes with a setting that is missing."""
    owner = harness.material("Principled")
    made = harness.node(owner, "ShaderNodeBsdfPrincipled")
    made.inputs["Subsurface Weight" if _BLENDER_4 else "Subsurface"].default_value = 0.5
    _shown(owner, made)
    what = "subsurface scattering (diffuse instead)"
    expected.add("MATERIAL", owner.name, _unsupported(made, what), made.name)
    yield owner

    owner = harness.material("Coordinates")
    made = harness.node(owner, "ShaderNodeTexCoord")
    made.from_instancer = True
    _read(owner, made.outputs["UV"])
    expected.add("MATERIAL", owner.name, _unsupported(made, "'From Instancer'"), made.name)
    yield owner

    owner = harness.material("Space")
    made = harness.node(owner, "ShaderNodeTexCoord")
    made.object = bpy.context.scene.camera
    _read(owner, made.outputs["Object"])
    expected.add("MATERIAL", owner.name, _unsupported(made, "another object's space"), made.name)
    yield owner

    owner = harness.material("Layer")
    made = harness.node(owner, "ShaderNodeAttribute")
    made.attribute_type = "VIEW_LAYER"
    _read(owner, made.outputs["Color"])
    expected.add("MATERIAL", owner.name, _unsupported(made, "output 'Color'"), made.name)
    yield owner


def _output_materials(expected):
    """What outputs and materials themselves ask for."""
    owner = harness.material("Volume")
    made = harness.node(owner, "ShaderNodeVolumeAbsorption")
    harness.connect(owner, made.outputs[0], owner.node_tree.nodes["Material Output"].inputs[1])
    _shown(owner, harness.node(owner, "ShaderNodeBsdfDiffuse"))
    expected.add("MATERIAL", owner.name, "Volume is not supported.")
    yield owner

    owner = harness.material("Shadow")
    _shown(owner, harness.node(owner, "ShaderNodeBsdfTransparent"))
    (owner if hasattr(owner, "use_transparent_shadow") else owner.cycles).use_transparent_shadow = 0
    expected.add("MATERIAL", owner.name, "Shadows are transparent where the surface is.")
    if hasattr(owner, "use_bump_map_correction"):
        owner.use_bump_map_correction = False
        expected.add("MATERIAL", owner.name, "Bump map correction is always on.")
    yield owner


def _grouped_material(expected):
    """A node two groups deep."""
    trees = [bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Outer", "Inner")]
    for tree in trees:
        if hasattr(tree, "interface"):
            tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
        else:
            tree.outputs.new("NodeSocketColor", "Out")
    made = trees[1].nodes.new("ShaderNodeTexPointDensity")
    source = made.outputs["Color"]
    group = trees[0].nodes.new("ShaderNodeGroup")
    group.node_tree = trees[1]
    for tree, output in ((trees[1], source), (trees[0], group.outputs[0])):
        tree.links.new(output, tree.nodes.new("NodeGroupOutput").inputs[0])
    owner = harness.material("Grouped")
    group = harness.node(owner, "ShaderNodeGroup")
    group.node_tree = trees[0]
    _read(owner, group.outputs[0])
    expected.add("MATERIAL", owner.name, _unsupported(made), made.name)
    return owner


def _image_material(expected):
    owner = harness.material("Picture")
    made = harness.node(owner, "ShaderNodeTexImage")
    made.image = bpy.data.images.new("Wide", 2, 2)
    wide = "ACES2065-1" if _BLENDER_4 else "XYZ"
    made.image.colorspace_settings.name = wide
    _read(owner, made.outputs["Color"])
    message = f"Colour space {wide!r} is read as Srgb."
    expected.add("IMAGE", "Wide", message, made.name)
    return owner


def _add_materials(expected) -> None:
    materials = [
        *_value_materials(expected),
        *_shader_materials(expected),
        *_setting_materials(expected),
        *_output_materials(expected),
        _grouped_material(expected),
        _image_material(expected),
    ]
    for i, owner in enumerate(materials):
        harness.add_object(harness.plane_mesh(f"Plane {i}"), owner, location=(3.0 * i, 0.0, 0.0))
    edges = harness.plane_mesh("Edges")
    edges.attributes.new("Worn", "FLOAT", "EDGE")
    owner = harness.material("Worn")
    made = harness.node(owner, "ShaderNodeAttribute")
    made.attribute_name = "Worn"
    _read(owner, made.outputs["Color"])
    harness.add_object(edges, owner, location=(0.0, 5.0, 0.0))
    expected.add("MESH", "Edges", "Attribute 'Worn' of edges is not supported.")


def _add_objects(expected) -> None:
    harness.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    expected.add("OBJECT", "Fog", "Volumes are not supported.")
    held = harness.add_object(harness.cube_mesh(), name="Held")
    held.is_holdout = held.is_shadow_catcher = True
    expected.add("OBJECT", "Held", "Holdout is not supported.")
    expected.add("OBJECT", "Held", "Shadow catcher is not supported.")
    if hasattr(held, "shadow_terminator_shading_offset"):
        held.shadow_terminator_shading_offset = 0.3
    else:
        held.cycles.shadow_terminator_offset = 0.3
    expected.add("OBJECT", "Held", "The terminator's shading offset is not used.")
    held.cycles.use_adaptive_subdivision = True
    expected.add("OBJECT", "Held", "Adaptive subdivision is not supported.")
    hairy = harness.add_object(harness.plane_mesh("Hairy"), name="Hairy")
    hairy.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hairy.particle_systems[0].name = "Fur"
    hairy.particle_systems[0].settings.type = "HAIR"
    expected.add("OBJECT", "Hairy", "Hair 'Fur' is not supported.")
    if hasattr(bpy.data, "hair_curves"):
        harness.link(bpy.data.objects.new("Strands", bpy.data.hair_curves.new("Strands")))
        expected.add("OBJECT", "Strands", "Hair curves are not supported.")


def _add_lamps(expected) -> None:
    square = bpy.data.lights.new("Square lamp", "SPOT")
    square.use_square = True
    lamp = harness.link(bpy.data.objects.new("Square", square))
    expected.add("LIGHT", "Square lamp", "Spot lights are round.")
    if hasattr(lamp, "light_linking"):
        lamp.light_linking.receiver_collection = bpy.data.collections.new("Lit")
        expected.add("OBJECT", "Square", "Light linking is not supported.")
    shining = bpy.data.lights.new("Shining", "POINT")
    shining.use_nodes = True
    emitter = next(n for n in shining.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
    made = harness.node(shining, "ShaderNodeTexIES")
    harness.connect(shining, made.outputs[0], emitter.inputs["Strength"])
    harness.link(bpy.data.objects.new("Shines", shining))
    expected.add("LIGHT", "Shining", _unsupported(made), made.name)


def _set_world(expected) -> None:
    world = bpy.context.scene.world
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputWorld")
    background = tree.nodes.new("ShaderNodeBackground")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "HOSEK_WILKIE"
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    scatter = tree.nodes.new("ShaderNodeVolumeScatter")
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    world.cycles.max_bounces = 3
    what = "the sky of Hosek and Wilkie (that of Preetham is shown)"
    expected.add("WORLD", world.name, _unsupported(sky, what), sky.name)
    expected.add("WORLD", world.name, "Volume is not supported.")
    expected.add("WORLD", world.name, "Maximum bounces of a world are not used.")


def _set_scene(scene, expected) -> None:
    cycles, render = scene.cycles, scene.render
    scene.pharos.follow_cycles = True
    cycles.samples = 1
    cycles.feature_set = "EXPERIMENTAL"
    cycles.use_denoising = cycles.use_fast_gi = cycles.film_transparent_glass = True
    cycles.sample_clamp_direct, cycles.blur_glossy, cycles.min_light_bounces = 1.0, 1.0, 1
    cycles.use_camera_cull, cycles.texture_limit_render = True, "128"
    render.film_transparent = render.use_motion_blur = render.use_simplify = True
    render.use_freestyle = True
    lines = scene.view_layers[0].freestyle_settings.linesets
    while lines:
        lines.remove(lines[0])  # they take their time
    scene.camera.data.type = "PANO"
    for message in (
        "Motion blur is not supported.",
        "Freestyle is not supported.",
        "The picture is not denoised.",
        "Clamping of samples is not used.",
        "Fast GI approximation is not supported.",
        "Transparent glass is not supported.",
        "Filter glossy is not used.",
        "Minimum bounces are not used.",
        "Culling of objects is not used.",
        "Textures keep their size.",
    ):
        expected.add("SCENE", scene.name, message)
    message = "Panoramic cameras are rendered as perspective ones."
    expected.add("OBJECT", scene.camera.name, message)


def _set_passes(scene, expected) -> None:
    layer = scene.view_layers[0]
    named = {
        "use_pass_vector": "Vector",
        "use_pass_shadow": "Shadow",
        "use_pass_ambient_occlusion": "Ambient Occlusion",
        "use_pass_subsurface_direct": "Subsurface Direct",
        "use_pass_subsurface_indirect": "Subsurface Indirect",
        "use_pass_subsurface_color": "Subsurface Color",
        "use_pass_cryptomatte_object": "Cryptomatte Object",
        "use_pass_cryptomatte_material": "Cryptomatte Material",
        "use_pass_cryptomatte_asset": "Cryptomatte Asset",
    }
    of_cycles = {
        "use_pass_volume_direct": "Volume Direct",
        "use_pass_volume_indirect": "Volume Indirect",
        "use_pass_shadow_catcher": "Shadow Catcher",
    }
    for owner, names in ((layer, named), (layer.cycles, of_cycles)):
        for switch, name in names.items():
            setattr(owner, switch, True)
            expected.add("VIEW_LAYER", layer.name, f"Pass {name!r} is not supported.")
    layer.lightgroups.add(name="Lamps")
    expected.add("VIEW_LAYER", layer.name, "Pass 'Light Group Lamps' is not supported.")


def _build() -> _Expected:
    scene = harness.new_scene(8, 8, 1)
    scene.name = _SCENE
    harness.add_camera()
    expected = _Expected()
    _add_materials(expected)
    _add_objects(expected)
    _add_lamps(expected)
    _set_world(expected)
    _set_scene(scene, expected)
    _set_passes(scene, expected)
    return expected


_EXPECTED: list[_Expected] = []


def test_the_report_is_the_expected_list():
    expected = _build()
    _EXPECTED.append(expected)
    harness.render()
    found = {(e.kind, e.object, e.message) for e in bpy.context.scene.pharos.report}
    wanted = set(expected.entries)
    assert found == wanted, f"missing {wanted - found}, unexpected {found - wanted}"
    assert len(bpy.context.scene.pharos.report) == len(wanted)
    harness.say(f"MEASURED {len(wanted)} entries as expected")


def _active_node(owner):
    """The node that is active in a tree, or in the group that is active there."""
    node = owner.node_tree.nodes.active
    while node is not None and getattr(node, "node_tree", None) is not None:
        node = node.node_tree.nodes.active
    return node


def _check_row(entry, node: str) -> None:
    active = bpy.context.view_layer.objects.active
    selected = [obj for obj in bpy.context.view_layer.objects if obj.select_get()]
    owner = None
    if entry.kind == "OBJECT":
        assert active.name == entry.object, (entry.object, active)
    elif entry.kind == "MESH":
        assert active.data.name == entry.object, (entry.object, active)
    elif entry.kind == "MATERIAL":
        owner = active.active_material
        assert owner.name == entry.object, (entry.object, active)
    elif entry.kind == "IMAGE":
        owner = active.active_material
        assert owner.node_tree.nodes.active.image.name == entry.object
    elif entry.kind == "LIGHT":
        owner = active.data
        assert owner.name == entry.object, (entry.object, active)
    else:
        owner = bpy.context.scene.world
    if entry.kind != "WORLD":
        assert selected == [active], (entry.object, selected)
    if node:
        made = _active_node(owner)
        assert made is not None and made.name == node and made.select, (entry.object, node)
        assert sum(n.select for n in made.id_data.nodes) == 1


def test_rows_select_what_they_are_about():
    entries = list(bpy.context.scene.pharos.report)
    for index, entry in enumerate(entries):
        for obj in bpy.context.view_layer.objects:
            obj.select_set(True)
        if entry.kind in {"SCENE", "VIEW_LAYER"}:
            continue
        done = bpy.ops.pharos.select_reported(index=index)
        assert done == {"FINISHED"}, (entry.object, entry.message)
        assert bpy.context.scene.pharos.report_row == index
        key = entry.kind, entry.object, entry.message
        _check_row(entry, _EXPECTED[0].entries[key])


def test_rows_of_what_is_gone_select_nothing():
    report = bpy.context.scene.pharos.report
    index = next(i for i, entry in enumerate(report) if entry.object == "Fog")
    bpy.data.objects.remove(bpy.data.objects["Fog"])
    active = bpy.context.view_layer.objects.active
    assert bpy.ops.pharos.select_reported(index=index) == {"CANCELLED"}
    assert bpy.ops.pharos.select_reported(index=len(report)) == {"CANCELLED"}
    assert bpy.context.view_layer.objects.active == active


def test_every_node_of_the_host_is_known_or_named():
    """A node that a new Blender brings, and nobody has looked at, fails here."""
    from pharos.export.node_closures import CLOSURES
    from pharos.export.node_values import VALUES

    structure = {"ShaderNodeGroup", "ShaderNodeCustomGroup", "ShaderNodeTree", "ShaderNode"}
    outputs = {f"ShaderNodeOutput{kind}" for kind in ("AOV", "Light", "Material", "World")}
    # Read by the outputs' sockets, or never by a surface.
    sockets = {f"ShaderNode{kind}Displacement" for kind in ("", "Vector")}
    sockets |= {kind for kind in dir(bpy.types) if kind.startswith("ShaderNodeVolume")}
    # Of other engines, of no use without OSL, or without a place in Blender's menus.
    foreign = {"OutputLineStyle", "UVAlongStroke", "Script", "Squeeze"}
    known = {*CLOSURES, *VALUES, *_VALUES, *_SHADERS, *structure, *outputs, *sockets}
    known |= {f"ShaderNode{kind}" for kind in foreign}
    there = {kind for kind in dir(bpy.types) if kind.startswith("ShaderNode")}
    assert there <= known, there - known


harness.main(globals())
