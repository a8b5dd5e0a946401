"""The Light Path node against Cycles: what kinds of rays a lit scene's surfaces and world see."""
# hosts: blender bpy

import bpy
import harness
import numpy as np
from node_sheet import settings

_OUTPUTS = (
    "Is Camera Ray",
    "Is Shadow Ray",
    "Is Diffuse Ray",
    "Is Glossy Ray",
    "Is Singular Ray",
    "Is Reflection Ray",
    "Is Transmission Ray",
    "Ray Length",
    "Ray Depth",
    "Diffuse Depth",
    "Glossy Depth",
    "Transparent Depth",
    "Transmission Depth",
)


def _shaders():
    """Floors that send each kind of ray on."""
    kinds = {
        "ShaderNodeBsdfDiffuse": {},
        "ShaderNodeBsdfGlossy": {"Roughness": 0.3},
        "ShaderNodeBsdfGlass": {"Roughness": 0.0},
        "ShaderNodeBsdfTransparent": {},
        "ShaderNodeBsdfTranslucent": {},
        "ShaderNodeBsdfRefraction": {"Roughness": 0.2},
    }
    for kind, inputs in kinds.items():
        owner = harness.material(kind)
        shader = harness.node(owner, kind, Color=(0.8, 0.8, 0.8, 1.0), **inputs)
        if hasattr(shader, "distribution"):
            shader.distribution = "GGX"
        harness.connect(owner, shader.outputs[0], harness.surface(owner))
        yield owner


def _scene(samples: int = 64):
    scene = harness.new_scene(24, 16, samples)
    settings(samples)
    scene.pharos.follow_cycles = True
    harness.add_camera((0.0, 0.0, 6.0), type="ORTHO", ortho_scale=6.0)
    for i, owner in enumerate(_shaders()):
        tile = harness.add_object(harness.plane_mesh(half=0.5), owner)
        tile.location = (i % 3 * 1.5 - 1.5, i // 3 * 1.5 - 0.75, 0.0)
        tile.rotation_euler = (0.3, 0.2, 0.0)
    return scene


def _compare(name: str, tolerance: float = 0.03) -> None:
    pictures = []
    for engine in ("CYCLES", "PHAROS"):
        bpy.context.scene.render.engine = engine
        pictures.append(harness.render(engine)[..., :3])
    # Blocks of 4 x 4 pixels: noise and edges even out.
    a, b = (p.reshape(4, 4, 6, 4, 3).mean(axis=(1, 3)) for p in pictures)
    error = np.abs(a - b) / np.maximum(a, 1.0)
    harness.say(f"MEASURED {name}: {error.max():.3f}")
    assert error.max() < tolerance, (name, error.max(), a[..., 0], b[..., 0])
    assert harness.report() == [], harness.report()


def test_world_asks_for_the_path():
    for output in _OUTPUTS:
        if output == "Ray Length":
            continue  # a ray that hits nothing has no length
        scene = _scene()
        world = scene.world
        world.use_nodes = True
        world.node_tree.nodes.clear()
        world.node_tree.nodes.new("ShaderNodeOutputWorld")
        background = harness.node(world, "ShaderNodeBackground")
        path = harness.node(world, "ShaderNodeLightPath")
        harness.connect(world, path.outputs[output], background.inputs["Color"])
        harness.connect(world, background.outputs[0], harness.surface(world))
        _compare(f"world {output}")


def test_surfaces_ask_for_the_path():
    for output in _OUTPUTS:
        _scene()
        owner = harness.material("Ceiling")
        emitter = harness.node(owner, "ShaderNodeEmission")
        path = harness.node(owner, "ShaderNodeLightPath")
        harness.connect(owner, path.outputs[output], emitter.inputs["Color"])
        harness.connect(owner, emitter.outputs[0], harness.surface(owner))
        # Light samples are no rays of any kind: how much they count is each engine's choice.
        if hasattr(owner.cycles, "emission_sampling"):
            owner.cycles.emission_sampling = "NONE"
        else:
            owner.cycles.sample_as_light = False
        below = harness.add_object(harness.plane_mesh(half=9.0), owner)
        below.location = (0.0, 0.0, -2.0)
        _compare(f"surface {output}", 0.05)


harness.main(globals())
