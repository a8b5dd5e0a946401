"""Small scenes of one feature each, by equivalence with Cycles of the same host.

Both engines render each scene with several seeds. With 95 % confidence every block of 8 x 8 pixels
differs by less than 2 %, the whole picture by less than 1 %; where that cannot be told, because the
standard error is over 0.5 %, the test fails as well.
"""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_PIXELS, _BLOCK = 16, 8
_SEEDS = 4
_SURE = 1.96
_TINT = (0.8, 0.5, 0.3, 1.0)


def _shaded(kind: str = "ShaderNodeBsdfDiffuse", distribution: str = "GGX", **inputs):
    owner = harness.material()
    shader = harness.node(owner, kind, **inputs)
    if hasattr(shader, "distribution"):
        shader.distribution = distribution
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    return owner, shader


def _lamp(kind: str = "AREA", energy: float = 60.0, **fields):
    light = bpy.data.lights.new(kind, kind)
    light.energy = energy
    for name, value in fields.items():
        setattr(light, name, value)
    lamp = harness.link(bpy.data.objects.new(kind, light))
    lamp.location, lamp.rotation_euler = (0.4, -0.3, 2.6), (0.15, 0.1, 0.0)
    return lamp


def _yard(make=lambda: _shaded(Color=_TINT)[0], sky=(0.25, 0.35, 0.5)):
    """A grey floor and a block of the material that `make` makes under a sky; returns the block."""
    scene = harness.new_scene(_PIXELS, _PIXELS)
    settings()
    cycles = scene.cycles
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    for name in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{name}_bounces", 4)
    harness.add_camera(location=(0.0, -4.0, 2.2), rotation=(1.1, 0.0, 0.0))
    grey = _shaded(Color=(0.6, 0.6, 0.6, 1.0))[0]
    harness.add_object(harness.plane_mesh("Floor", half=3.0), grey)
    # Off the floor: Cycles loses paths that start on two faces at one place.
    block = harness.add_object(harness.cube_mesh("Block"), make(), location=(0.0, 0.3, 0.75))
    block.scale, block.rotation_euler = (0.7, 0.6, 0.7), (0.0, 0.0, 0.5)
    harness.set_world(sky)
    return block


def _seeds_of(engine: str, samples: int) -> np.ndarray:
    """Pictures of all seeds: (seed, height, width, 3)."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.samples = samples
    pictures = []
    for seed in range(_SEEDS):
        scene.cycles.seed = 17 * seed + 1
        pictures.append(harness.render(engine)[..., :3])
    return np.array(pictures)


def _difference(theirs: np.ndarray, ours: np.ndarray) -> tuple[float, float]:
    """Relative difference of the means of two sets of values, and its standard error."""
    error = np.sqrt((theirs.var(ddof=1) + ours.var(ddof=1)) / len(ours))
    return (ours.mean() - theirs.mean()) / theirs.mean(), error / theirs.mean()


def _check(name: str, samples: int = 256) -> None:
    bpy.context.scene.pharos.follow_cycles = True
    theirs, ours = (_seeds_of(engine, samples).mean(axis=-1) for engine in ("CYCLES", "PHAROS"))
    bpy.context.scene.pharos.follow_cycles = False
    whole, error = _difference(theirs.mean(axis=(1, 2)), ours.mean(axis=(1, 2)))
    blocks = []
    for y in range(0, _PIXELS, _BLOCK):
        for x in range(0, _PIXELS, _BLOCK):
            part = (slice(None), slice(y, y + _BLOCK), slice(x, x + _BLOCK))
            blocks.append(_difference(theirs[part].mean(axis=(1, 2)), ours[part].mean(axis=(1, 2))))
    worst = max(abs(d) + _SURE * e for d, e in blocks)
    harness.say(
        f"MEASURED {name}: {100 * whole:+.2f} % +- {100 * error:.2f} %, worst block "
        f"{100 * worst:.2f} %"
    )
    assert error < 0.005, (name, error)
    assert abs(whole) + _SURE * error < 0.01, (name, whole, error)
    assert worst < 0.02, (name, blocks)


def test_lamps():
    for kind, fields in (
        ("AREA", {"shape": "DISK", "size": 0.7}),
        ("POINT", {"shadow_soft_size": 0.2}),
        ("SPOT", {"spot_size": 1.2, "spot_blend": 0.3, "energy": 300.0}),
        ("SUN", {"angle": 0.2, "energy": 2.0}),
    ):
        _yard()
        _lamp(kind, **fields)
        _check(f"lamp {kind}")


def test_worlds():
    _yard()
    _check("one colour")
    _yard()
    _sky_shown(_surroundings)
    _check("picture of surroundings", 512)


def _sky_shown(make):
    """A world of the node that `make` makes of the world's tree; returns the background."""
    world = bpy.context.scene.world
    world.use_nodes = True
    tree = world.node_tree
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(make(tree).outputs[0], background.inputs[0])
    return background


def _nishita(tree, disc: bool):
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "NISHITA"
    sky.sun_elevation, sky.sun_rotation, sky.sun_disc = 0.5, 2.2, disc
    return sky


def test_sky():
    """Light from one side: which one, is the sun's rotation."""
    for disc in (False, True):
        _yard()
        shown = _sky_shown(lambda tree, disc=disc: _nishita(tree, disc))
        shown.inputs["Strength"].default_value = 0.05
        _check(f"sky with{'' if disc else 'out'} the sun", 512)


def _roof(half: float, hole: float, height: float) -> None:
    """A square sheet over the yard with a square hole."""
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = [(x * size, y * size, 0.0) for size in (half, hole) for x, y in signs]
    faces = [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
    mesh = harness.make_mesh("Roof", corners, faces)
    grey = _shaded(Color=(0.5, 0.5, 0.5, 1.0))[0]
    harness.add_object(mesh, grey, location=(0.0, 0.0, height))


def _surroundings(tree):
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.new("surroundings", 16, 8)
    picture.image.generated_type = "COLOR_GRID"
    return picture


def test_portals():
    """A hole in a roof, with portals that face the yard, that lie and that look away."""
    for name in ("one colour", "picture"):
        _yard()
        _roof(3.0, 0.8, 3.2)
        for y, turn in ((0.0, 0.0), (-3.5, 1.3), (2.0, 3.14159)):
            opening = _lamp("AREA", size=1.6, energy=0.0 if turn else 50.0)
            opening.data.cycles.is_portal = True
            opening.location, opening.rotation_euler = (0.0, y, 3.2), (turn, 0.0, 0.0)
        if name == "picture":
            _sky_shown(_surroundings)
        _check(f"portals {name}", 512)
        assert harness.report() == [], harness.report()


def test_lobes():
    for kind, inputs in (
        ("ShaderNodeBsdfGlossy", {"Roughness": 0.3}),
        ("ShaderNodeBsdfGlass", {"Roughness": 0.4, "IOR": 1.4}),
        ("ShaderNodeBsdfTranslucent", {}),
        ("ShaderNodeBsdfRefraction", {"Roughness": 0.5, "IOR": 1.3, "distribution": "BECKMANN"}),
        ("ShaderNodeBsdfPrincipled", {"Metallic": 0.4, "Roughness": 0.35}),
    ):
        name = "Base_Color" if kind.endswith("Principled") else "Color"
        inputs = inputs | {name: _TINT}
        _yard(lambda k=kind, i=inputs: _shaded(k, **i)[0])
        _lamp("AREA", size=1.5)
        _check(kind[14:], 512)


def _textured(kind: str, fields=None, **inputs):
    owner, shader = _shaded()
    node = harness.node(owner, kind, **inputs)
    for name, value in (fields or {}).items():
        setattr(node, name, value)
    harness.connect(owner, node.outputs[0], shader.inputs[0])
    return owner, node, shader


def _pictured():
    owner, node, _ = _textured("ShaderNodeTexImage", {"projection": "BOX"})
    node.image = bpy.data.images.new("grid", 32, 32)
    node.image.generated_type = "COLOR_GRID"
    where = harness.node(owner, "ShaderNodeTexCoord")
    harness.connect(owner, where.outputs["Object"], node.inputs[0])
    return owner


def test_textures():
    _yard(lambda: _textured("ShaderNodeTexNoise", Scale=3.0)[0])
    _check("noise")
    _yard(_pictured)
    _check("picture on a box")


def _checkered():
    owner = harness.material()
    mix = harness.node(owner, "ShaderNodeMixShader")
    checks = harness.node(owner, "ShaderNodeTexChecker", Scale=5.0)
    clear, solid = (
        harness.node(owner, f"ShaderNodeBsdf{kind}", Color=(0.9, 0.7, 0.6, 1.0))
        for kind in ("Transparent", "Diffuse")
    )
    harness.connect(owner, checks.outputs["Fac"], mix.inputs[0])
    harness.connect(owner, clear.outputs[0], mix.inputs[1])
    harness.connect(owner, solid.outputs[0], mix.inputs[2])
    harness.connect(owner, mix.outputs[0], harness.surface(owner))
    return owner


def test_alpha_in_shadow():
    """A checkered sheet lets light through."""
    _yard()
    sheet = harness.add_object(harness.plane_mesh("Sheet", half=1.2), _checkered())
    sheet.location = (0.2, 0.1, 1.8)
    _lamp("POINT", shadow_soft_size=0.1, energy=100.0)
    _check("alpha in shadow", 512)


def test_glowing_mesh():
    _yard(sky=(0.02, 0.02, 0.02))
    glow = harness.add_object(harness.cube_mesh("Glow"), harness.emission((1.0, 0.7, 0.4), 8.0))
    glow.scale, glow.location = (0.3, 0.3, 0.1), (0.3, -0.5, 2.4)
    _check("glowing mesh", 512)


def _bumpy():
    owner, node, shader = _textured("ShaderNodeTexVoronoi", Scale=2.0)
    bump = harness.node(owner, "ShaderNodeBump", Strength=0.6, Distance=0.1)
    harness.connect(owner, node.outputs[0], bump.inputs["Height"])
    harness.connect(owner, bump.outputs[0], shader.inputs["Normal"])
    shader.inputs[0].default_value = _TINT
    for link in list(shader.inputs[0].links):
        owner.node_tree.links.remove(link)
    return owner


def test_bump():
    _yard(_bumpy)
    _lamp("AREA")
    _check("bump")


def test_cameras():
    _yard()
    _lamp("AREA")
    camera = bpy.context.scene.camera.data
    camera.dof.use_dof, camera.dof.focus_distance = True, 2.5
    camera.dof.aperture_fstop, camera.dof.aperture_blades = 0.2, 6
    _check("depth of field")
    camera.dof.use_dof = False
    camera.type, camera.ortho_scale, camera.shift_x = "ORTHO", 4.0, 0.1
    _check("orthographic")


def test_transforms_and_instances():
    block = _yard()
    block.scale = (-0.7, 0.6, 0.9)
    parent = harness.link(bpy.data.objects.new("Parent", None))
    parent.scale = (1.4, 0.6, 1.0)
    block.parent = parent
    block.rotation_euler = (0.3, 0.4, 0.5)
    group = bpy.data.collections.new("Group")
    child = bpy.data.objects.new("Child", block.data)
    child.scale = (0.2, 0.2, 0.2)
    group.objects.link(child)
    for i in range(3):
        spot = harness.link(bpy.data.objects.new(f"Spot{i}", None))
        spot.instance_type, spot.instance_collection = "COLLECTION", group
        spot.location = (i - 1.0, -1.0, 0.3)
    _lamp("AREA")
    _check("sheared, mirrored, instanced")


def test_curves_and_text():
    block = _yard()
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.size = "Ax", 0.1, 1.2
    letters = harness.link(bpy.data.objects.new("Text", text))
    letters.location, letters.rotation_euler = (-0.9, -0.8, 0.1), (1.3, 0.0, 0.1)
    letters.data.materials.append(block.data.materials[0])
    balls = bpy.data.metaballs.new("Balls")
    balls.elements.new().co, balls.elements.new().co = (0.0, 0.0, 0.0), (0.7, 0.0, 0.2)
    drops = harness.link(bpy.data.objects.new("Balls", balls))
    drops.location, drops.scale = (0.8, -0.9, 0.3), (0.3, 0.3, 0.3)
    _lamp("AREA")
    _check("text and metaballs")


def test_film():
    _yard()
    scene = bpy.context.scene
    scene.render.film_transparent, scene.cycles.film_exposure = True, 1.7
    try:
        _check("transparent film")
    finally:
        scene.render.film_transparent, scene.cycles.film_exposure = False, 1.0


harness.main(globals())
