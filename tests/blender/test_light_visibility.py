"""Which rays see a light: ray visibility of lamps, glowing meshes and the world by the kind of
lobe, bounces, chance hits, against Cycles of the same host.
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_RECEIVERS = {
    "diffuse": ("ShaderNodeBsdfDiffuse", {}),
    "glossy": ("ShaderNodeBsdfGlossy", {"Roughness": 0.5}),
    "translucent": ("ShaderNodeBsdfTranslucent", {}),
    "refraction": ("ShaderNodeBsdfRefraction", {"Roughness": 0.5, "IOR": 1.2}),
}
_KINDS = ("diffuse", "glossy", "transmission")


def _strip(owner_kind: str, inputs: dict, place: int):
    owner = harness.material(owner_kind)
    shader = harness.node(owner, owner_kind, Color=(0.8, 0.7, 0.6, 1.0), **inputs)
    if hasattr(shader, "distribution"):
        shader.distribution = "GGX"
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    card = harness.add_object(harness.plane_mesh(owner_kind, half=0.5), owner)
    card.location = (place - 1.5, 0.0, 0.0)


def _scene(samples: int):
    """Four cards of different lobes side by side, from above; lights are above and below."""
    scene = harness.new_scene(16, 4, samples)
    settings(samples)
    cycles = scene.cycles
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 4
    cycles.transmission_bounces = 4
    scene.pharos.follow_cycles = True
    for place, (kind, inputs) in enumerate(_RECEIVERS.values()):
        _strip(kind, inputs, place)
    harness.add_camera((0.0, 0.0, 8.0), type="ORTHO", ortho_scale=4.0)
    return scene


def _add_lamps(kind: str, **fields):
    lamps = []
    for height in (2.0, -2.0):
        light = bpy.data.lights.new("Lamp", kind)
        light.energy = 60.0
        for name, value in fields.items():
            setattr(light, name, value)
        lamp = harness.link(bpy.data.objects.new("Lamp", light))
        lamp.location = (0.3, 0.4, height)
        lamp.rotation_euler = (0.0 if height > 0.0 else np.pi, 0.0, 0.0)
        lamps.append(lamp)
    return lamps


def _add_meshes():
    glow = harness.emission((1.0, 0.8, 0.6), 4.0, "Glow")
    cards = []
    for height in (2.0, -2.0):
        card = harness.add_object(harness.plane_mesh("Light", half=0.7), glow)
        card.location = (0.3, 0.4, height)
        card.visible_camera = False
        cards.append(card)
    return cards


def _compare(name: str, tolerance: float = 0.02) -> None:
    """By card, since each has a lobe of its own."""
    cards = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        picture = harness.render(engine)[..., :3]
        cards.append(picture.reshape(4, 4, 4, 3).mean(axis=(0, 2)))
    theirs, ours = cards
    bpy.context.scene.pharos.follow_cycles = False
    error = np.abs(ours - theirs).max(axis=-1) / max(theirs.mean(), 0.02)
    harness.say(f"MEASURED {name}: by card {np.round(error, 4)}")
    assert error.max() < tolerance, (name, error, ours, theirs)
    assert harness.report() == [], harness.report()


def _hide(objects, kinds) -> None:
    for thing in objects:
        for kind in kinds:
            setattr(thing, f"visible_{kind}", False)


def test_lamps_by_lobe():
    for kind, fields in (("AREA", {"size": 1.0}), ("POINT", {"shadow_soft_size": 0.0})):
        for hidden in _KINDS:
            _scene(256)
            _hide(_add_lamps(kind, **fields), (hidden,))
            _compare(f"{kind} not for {hidden}", 0.03)


def test_meshes_by_lobe():
    for hidden in _KINDS:
        _scene(400)
        _hide(_add_meshes(), (hidden,))
        _compare(f"mesh not for {hidden}", 0.05)


def test_world_by_lobe():
    for hidden in _KINDS:
        scene = _scene(400)
        scene.world.color = (0.5, 0.6, 0.7)
        setattr(scene.world.cycles_visibility, hidden, False)
        _compare(f"world not for {hidden}")


def test_no_bounces_and_no_chance_hits():
    for limit in (0, 1):
        for kind, fields in (("AREA", {"size": 1.0}), ("POINT", {"shadow_soft_size": 0.2})):
            _scene(256)
            for lamp in _add_lamps(kind, **fields):
                lamp.data.cycles.max_bounces = limit
            _compare(f"{kind} with {limit} bounces")
    _scene(400)
    for lamp in _add_lamps("AREA", size=1.0):
        lamp.data.cycles.use_multiple_importance_sampling = False
    _compare("area without chance hits")


def test_materials_without_light_sampling():
    _scene(2000)
    _add_meshes()
    glow = bpy.data.materials["Glow"]
    if hasattr(glow.cycles, "emission_sampling"):
        glow.cycles.emission_sampling = "NONE"
    else:
        glow.cycles.sample_as_light = False
    _compare("mesh by chance hits alone", 0.03)


harness.main(globals())
