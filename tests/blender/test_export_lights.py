"""Lamps and worlds: Blender's values, unconverted; node trees of lamps; what is named."""
# hosts: blender bpy

import bpy
import harness


def _lamp(kind: str, **fields):
    harness.new_scene()
    harness.add_camera()
    light = bpy.data.lights.new("Lamp", kind)
    for name, value in fields.items():
        setattr(light, name, value)
    obj = harness.link(bpy.data.objects.new("Lamp", light))
    obj.location = (1.0, 2.0, 3.0)
    return light, obj


def _kind(light) -> str:
    return str(light.type).split(".")[-1]


def test_point():
    _lamp("POINT", energy=100.0, color=(1.0, 0.5, 0.25), shadow_soft_size=0.3)
    (out,) = harness.exported().lights
    assert _kind(out) == "Point" and harness.close(out.strength, (100.0, 50.0, 25.0), 1e-4)
    assert harness.close(out.radius, 0.3) and [row[3] for row in out.to_world] == [1, 2, 3, 1]


def test_spot():
    _lamp("SPOT", energy=10.0, spot_size=0.7, spot_blend=0.2, shadow_soft_size=0.0)
    (out,) = harness.exported().lights
    assert _kind(out) == "Spot"
    assert harness.close((out.spot_angle, out.spot_blend, out.radius), (0.7, 0.2, 0.0))


def test_area_shapes():
    shapes = {
        "SQUARE": (2.0, 2.0),
        "RECTANGLE": (2.0, 3.0),
        "DISK": (2.0, 2.0),
        "ELLIPSE": (2.0, 3.0),
    }
    for shape, size in shapes.items():
        _lamp("AREA", energy=5.0, shape=shape, size=2.0, size_y=3.0, spread=1.0)
        (out,) = harness.exported().lights
        round_shape = shape in {"DISK", "ELLIPSE"}
        assert str(out.shape).endswith("Ellipse" if round_shape else "Rectangle"), shape
        assert (out.size_u, out.size_v) == size and harness.close(out.spread, 1.0), shape


def test_sun():
    _lamp("SUN", energy=3.0, angle=0.1)
    (out,) = harness.exported().lights
    assert _kind(out) == "Sun" and harness.close(out.angle, 0.1)
    assert harness.close(out.strength, (3.0, 3.0, 3.0))


def test_newer_fields():
    light, _ = _lamp("POINT", energy=2.0)
    if not hasattr(light, "exposure"):
        raise harness.Skip("this version has no exposure of lights")
    light.exposure, light.normalize, light.use_soft_falloff = 3.0, False, False
    (out,) = harness.exported().lights
    assert harness.close(out.strength, (16.0, 16.0, 16.0))
    assert not out.normalize and not out.soft_falloff
    light.use_temperature, light.temperature = True, 3000.0
    (out,) = harness.exported().lights
    expected = [16.0 * value for value in light.temperature_color]
    assert harness.close(out.strength, expected, 1e-4), (out.strength, expected)


def test_nodes_multiply():
    light, _ = _lamp("POINT", energy=2.0)
    light.use_nodes = True
    emission = next(n for n in light.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 3.0
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    (out,) = harness.exported().lights
    assert harness.close(out.strength, (6.0, 3.0, 0.0)), out.strength


def test_visibility_and_flags():
    light, obj = _lamp("AREA")
    obj.visible_camera = obj.visible_glossy = False
    light.cycles.use_multiple_importance_sampling = False
    light.cycles.max_bounces = 3
    (out,) = harness.exported().lights
    module = harness.native()
    assert not out.visibility & (module.VISIBLE_CAMERA | module.VISIBLE_GLOSSY)
    assert out.visibility & module.VISIBLE_DIFFUSE
    assert not out.use_mis and out.max_bounces == 3


def test_portals_have_a_shape_and_no_strength():
    light, _ = _lamp("AREA")
    light.cycles.is_portal, light.size = True, 3.0
    (out,) = harness.exported().lights
    assert out.is_portal and out.size_u == 3.0
    assert tuple(out.strength) == (0.0, 0.0, 0.0)
    assert harness.report() == [], harness.report()


def test_world_colour():
    harness.new_scene()
    harness.add_camera()
    harness.set_world((0.1, 0.2, 0.3))
    program = harness.exported().world.program
    assert harness.ops_of(program) == ["Background"]
    assert harness.operand(program, 0, 1, 3) == [0.1, 0.2, 0.3]


def test_world_image():
    scene = harness.new_scene()
    harness.add_camera()
    world = scene.world
    world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    texture = harness.node(world, "ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.new("Sky", 4, 2, float_buffer=True)
    harness.connect(world, texture.outputs[0], background.inputs[0])
    out = harness.exported()
    assert harness.ops_of(out.world.program) == ["Coordinate", "EnvironmentImage", "Background"]
    assert len(out.images) == 1 and (out.images[0].width, out.images[0].height) == (4, 2)


def test_no_world():
    scene = harness.new_scene()
    harness.add_camera()
    scene.world = None
    assert harness.exported().world.program.ops == []


harness.main(globals())
