"""Passes: the same names, channels and values as Cycles of the same host; the guide's own."""
# hosts: blender bpy

import bpy
import harness
import numpy as np

_SWITCHES = {
    "Depth": "use_pass_z",
    "Mist": "use_pass_mist",
    "Position": "use_pass_position",
    "Normal": "use_pass_normal",
    "UV": "use_pass_uv",
    "Object": "use_pass_object_index",
    "Material": "use_pass_material_index",
    "Emission": "use_pass_emit",
    "Environment": "use_pass_environment",
}
# Passes of the first sample move within a pixel.
_TOLERANCE = {"Position": 0.2}
_GUIDE = ("direction", "kappa", "irradiance", "share")


def _switch(on: bool, names=tuple(_SWITCHES)) -> None:
    for name in names:
        setattr(bpy.context.view_layer, _SWITCHES[name], on)


def _cycles(samples: int) -> None:
    scene = bpy.context.scene
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", samples, "BOX"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.film_exposure, cycles.seed = 1.0, 0
    scene.pharos.follow_cycles = True


def _still_life(samples: int = 16):
    """A block with a UV map that glows, behind half of a pane, before a coloured world."""
    scene = harness.new_scene(24, 16, samples)
    harness.add_camera(location=(0, -5, 1.0), rotation=(1.4, 0.0, 0.0))
    glow = harness.emission((0.9, 0.5, 0.2), 1.5, "Glow")
    glow.pass_index = 5
    block = harness.cube_mesh()
    layer = block.uv_layers.new(name="UVMap")
    for i, corner in enumerate(layer.data):
        corner.uv = (0.25 * (i % 4), 0.125 * (i // 4 % 8))
    harness.add_object(block, glow).pass_index = 3
    pane = harness.material("Pane")
    clear = harness.node(pane, "ShaderNodeBsdfTransparent", Color=(0.6, 0.8, 0.9, 1.0))
    harness.connect(pane, clear.outputs[0], harness.surface(pane))
    pane.pass_index = 8
    held = harness.add_object(harness.plane_mesh("Held"), pane, location=(1.0, -2.0, 1.0))
    held.rotation_euler, held.pass_index = (1.5, 0.0, 0.0), 9
    harness.set_world((0.1, 0.3, 0.6))
    mist = scene.world.mist_settings
    mist.start, mist.depth, mist.falloff = 2.0, 6.0, "QUADRATIC"
    _cycles(samples)
    return scene


def _both(name: str) -> tuple[dict, dict]:
    pictures = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures.append(harness.render_layers(f"{name}_{engine}"))
    return tuple(pictures)


def _compare(theirs: dict, ours: dict, edges: float) -> None:
    """Equal but for noise at edges: at most that share of pixels differs by more than the
    tolerance, relative to the channel's range."""
    assert set(theirs) == set(ours), set(theirs) ^ set(ours)
    for channel, expected in theirs.items():
        far = np.abs(expected) > 1e9
        assert np.mean(far != (np.abs(ours[channel]) > 1e9)) <= edges, channel
        both = ~far & (np.abs(ours[channel]) < 1e9)
        tolerance = _TOLERANCE.get(channel.split(".")[0], 0.01)
        tolerance *= max(1.0, np.abs(expected[both]).max())
        wrong = np.abs(ours[channel] - expected)[both] > tolerance
        assert wrong.mean() <= edges, (channel, wrong.mean())


def test_values_are_those_of_cycles():
    scene = _still_life(64)
    _switch(True)
    try:
        theirs, ours = _both("passes")
    finally:
        _switch(False)
    _compare(theirs, ours, 0.08)
    long_names = harness.VERSION >= (5, 0, 0)
    light = ("Emission.R", "Environment.B") if long_names else ("Emit.R", "Env.B")
    for channel in (*light, "Mist.Z"):
        error = abs(ours[channel].mean() / theirs[channel].mean() - 1.0)
        assert error < 0.01, (channel, error)
    scene.pharos.follow_cycles = False


def _aov_output(tree, name: str, value: float, color=None):
    """An AOV Output node; its colour comes from `color`, a socket, or is grey."""
    node = tree.nodes.new("ShaderNodeOutputAOV")
    setattr(node, "aov_name" if hasattr(node, "aov_name") else "name", name)
    node.inputs["Color"].default_value = (0.5, 0.6, 0.7, 0.8)
    node.inputs["Value"].default_value = value
    if color is not None:
        tree.links.new(color, node.inputs["Color"])


def _aov_group():
    """A node group whose AOV node writes what comes into the group."""
    group = bpy.data.node_groups.new("Writes", "ShaderNodeTree")
    if hasattr(group, "interface"):
        group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    else:
        group.inputs.new("NodeSocketColor", "Tint")
    start = group.nodes.new("NodeGroupInput")
    _aov_output(group, "Grouped", 2.0, start.outputs[0])
    return group


def _still_life_with_aovs():
    scene = _still_life(64)
    materials = bpy.data.materials
    glow, pane = materials["Glow"], materials["Pane"]
    place = harness.node(glow, "ShaderNodeNewGeometry")
    _aov_output(glow.node_tree, "Where", 3.0, place.outputs["Position"])
    inside = harness.node(glow, "ShaderNodeGroup")
    inside.node_tree = _aov_group()
    inside.inputs[0].default_value = (0.9, 0.2, 0.4, 1.0)
    _aov_output(pane.node_tree, "Where", 5.0)  # mostly clear: what is behind it adds
    world = scene.world
    world.use_nodes = True
    _aov_output(world.node_tree, "Number", 7.0)
    for name, kind in (("Where", "COLOR"), ("Number", "VALUE"), ("Grouped", "COLOR")):
        aov = bpy.context.view_layer.aovs.add()
        aov.name, aov.type = name, kind
    _aov_output(glow.node_tree, "Number", -3.0)
    return scene


def test_passes_of_materials_are_those_of_cycles():
    scene = _still_life_with_aovs()
    try:
        theirs, ours = _both("aovs")
        out = harness.exported()
        assert harness.report() == [], harness.report()
    finally:
        while bpy.context.view_layer.aovs:
            bpy.ops.scene.view_layer_remove_aov()
        scene.pharos.follow_cycles = False
    expected = {f"{name}.{c}" for name in ("Where", "Grouped") for c in "RGBA"} | {"Number.X"}
    assert expected <= set(ours), set(ours)
    _compare(theirs, ours, 0.08)
    for channel in expected:
        error = abs(ours[channel].mean() - theirs[channel].mean())
        assert error < 0.01 * np.abs(theirs[channel]).mean(), (channel, error)
        assert np.ptp(ours[channel]) > 0.1 or channel.endswith("A"), channel
    assert [aov.name for aov in out.passes.aovs] == ["Where", "Number", "Grouped"]
    assert not any("Aov" in op for op in _ops_of_a_scene_without_aovs())


def _ops_of_a_scene_without_aovs() -> list[str]:
    out = harness.exported()
    return [op for material in out.materials for op in harness.ops_of(material.program)]


def test_transparent_film_and_mist_shapes():
    scene = _still_life(16)
    scene.render.film_transparent = True
    _switch(True, ("Mist", "Emission", "Environment"))
    try:
        for falloff in ("LINEAR", "INVERSE_QUADRATIC"):
            scene.world.mist_settings.falloff = falloff
            _compare(*_both(falloff), 0.12)
    finally:
        _switch(False)
        scene.render.film_transparent = False
    scene.pharos.follow_cycles = False


def _corner(samples: int):
    """Diffuse, glossy and glass before a lit wall, each visible on its own."""
    scene = harness.new_scene(24, 12, samples)
    harness.add_camera(location=(0, -5, 1.0), rotation=(1.4, 0.0, 0.0))
    shaders = (
        ("ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.5, 0.3, 1.0)}),
        ("ShaderNodeBsdfGlossy", {"Color": (0.4, 0.7, 0.9, 1.0), "Roughness": 0.3}),
        ("ShaderNodeBsdfRefraction", {"Color": (0.9, 0.9, 0.5, 1.0), "Roughness": 0.3, "IOR": 1.3}),
    )
    for place, (kind, inputs) in enumerate(shaders):
        owner = harness.material(kind)
        shader = harness.node(owner, kind, **inputs)
        harness.connect(owner, shader.outputs[0], harness.surface(owner))
        card = harness.add_object(harness.plane_mesh(kind, half=0.5), owner)
        card.location, card.rotation_euler = (1.2 * place - 1.2, 0.0, 0.6), (1.2, 0.0, 0.0)
    harness.add_object(
        harness.plane_mesh("Back", half=3.0), bpy.data.materials["ShaderNodeBsdfDiffuse"]
    ).location = (0.0, 1.0, -0.5)
    light = bpy.data.lights.new("Lamp", "AREA")
    light.energy = 60.0
    harness.link(bpy.data.objects.new("Lamp", light)).location = (0.5, -1.0, 3.0)
    harness.set_world((0.3, 0.4, 0.5))
    _cycles(samples)
    for name in ("max", "diffuse", "glossy", "transmission"):
        setattr(scene.cycles, f"{name}_bounces", 3)
    scene.cycles.light_sampling_threshold = 0.0
    # Caustics would be noise here.
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    return scene


def test_light_by_lobes_is_that_of_cycles():
    scene = _corner(1024)
    layer = bpy.context.view_layer
    switches = [
        f"use_pass_{lobe}_{part}"
        for lobe in ("diffuse", "glossy", "transmission")
        for part in ("direct", "indirect", "color")
    ]
    for switch in switches:
        setattr(layer, switch, True)
    try:
        theirs, ours = _both("light")
    finally:
        for switch in switches:
            setattr(layer, switch, False)
        scene.pharos.follow_cycles = False
        scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
    assert set(theirs) == set(ours) and len(ours) == 4 + 27, set(ours) ^ set(theirs)
    for channel, expected in theirs.items():
        indirect = "Ind" in channel
        error = abs(ours[channel].mean() - expected.mean())
        limit = (0.06 if indirect else 0.02) * expected.mean() + 5e-4
        assert error < limit, (channel, ours[channel].mean(), expected.mean())
        assert indirect or expected.mean() > 0.005, channel


def test_passes_cost_nothing_unless_wanted():
    _still_life(1)
    out = harness.exported()
    assert out.passes.wanted == 0
    assert out.passes.object_indices == [] and out.passes.material_indices == []
    assert not out_meshes_have_uv(out)
    _switch(True)
    try:
        out = harness.exported()
    finally:
        _switch(False)
    assert sorted(out.passes.object_indices) == [3, 9]
    assert sorted(out.passes.material_indices) == [5, 8]
    assert out_meshes_have_uv(out)


def out_meshes_have_uv(out) -> bool:
    return any(out.mesh(i)["uv_maps"] for i in range(out.mesh_count))


def _room(guiding: str):
    """A room lit by a lamp in a corner."""
    scene = harness.new_scene(24, 16, 24)
    harness.add_camera(location=(0.0, -0.8, 0.0), rotation=(1.57, 0.0, 0.0))
    owner = harness.material()
    diffuse = harness.node(owner, "ShaderNodeBsdfDiffuse", Color=(0.7, 0.7, 0.7, 1.0))
    harness.connect(owner, diffuse.outputs[0], harness.surface(owner))
    harness.add_object(harness.cube_mesh(), owner)
    light = bpy.data.lights.new("Lamp", "POINT")
    light.energy, light.shadow_soft_size = 20.0, 0.1
    harness.link(bpy.data.objects.new("Lamp", light)).location = (0.7, 0.7, 0.7)
    scene.pharos.guiding = guiding
    return scene


def _guide_layers(guiding: str) -> dict:
    scene = _room(guiding)
    own = bpy.context.view_layer.pharos
    for name in _GUIDE:
        setattr(own, f"use_pass_guide_{name}", True)
    try:
        return harness.render_layers(f"guide_{guiding}")
    finally:
        for name in _GUIDE:
            setattr(own, f"use_pass_guide_{name}", False)
        scene.pharos.guiding = "OFF"


def test_guide_passes():
    layers = _guide_layers("SLIDES")
    direction = np.stack([layers[f"Guide Direction.{axis}"] for axis in "XYZ"])
    assert harness.close(np.linalg.norm(direction, axis=0), 1.0, 1e-4)
    assert layers["Guide Kappa.X"].min() > 0.0 and layers["Guide Irradiance.X"].min() > 0.0
    assert harness.close(layers["Guide Share.X"], 0.5)


def test_guide_passes_without_guiding_are_black():
    layers = _guide_layers("OFF")
    guide = [pixels for name, pixels in layers.items() if name.startswith("Guide ")]
    assert len(guide) == 6 and not np.any(guide)


def test_unsupported_passes_are_named():
    harness.new_scene(8, 8, 1)
    harness.add_camera()
    layer = bpy.context.view_layer
    layer.use_pass_subsurface_direct = layer.use_pass_vector = layer.use_pass_mist = True
    try:
        harness.render()
        named = [line.split(": ", 1)[1] for line in harness.report()]
    finally:
        layer.use_pass_subsurface_direct = layer.use_pass_vector = layer.use_pass_mist = False
    names = ("Vector", "Subsurface Direct")
    assert named == [f"Pass {name!r} is not supported." for name in names], named


def test_names_agree_with_the_native_module():
    passes = __import__("pharos.passes", fromlist=["PASSES"]).PASSES
    module = harness.native()
    for entry in passes:
        film_pass = getattr(module.FilmPass, entry.film_pass)
        assert module.film_pass_channels(film_pass) == len(entry.channels), entry
    assert len({entry.film_pass for entry in passes}) == len(module.FilmPass.__members__)


harness.main(globals())
