"""The list of what makes a picture slow, and its pass."""
# hosts: blender bpy

import bpy
import harness


def test_objects_and_lights_are_listed():
    scene = harness.new_scene(24, 24, 16)
    white = harness.material("White")
    shader = harness.node(white, "ShaderNodeBsdfDiffuse")
    harness.connect(white, shader.outputs[0], harness.surface(white))
    harness.add_object(harness.plane_mesh("Floor", 2.0), white)
    light = bpy.data.lights.new("Lamp", "AREA")
    light.energy, light.size = 50.0, 2.0
    lamp = harness.link(bpy.data.objects.new("Wide Lamp", light))
    lamp.location = (0.0, 0.5, 1.0)
    harness.add_camera(location=(0.0, 0.0, 4.0))
    layer = bpy.context.view_layer
    layer.pharos.use_pass_effort = False
    harness.render("without")
    assert len(scene.pharos.slow) == 0
    layer.pharos.use_pass_effort = True
    passes = harness.render_layers("slow")
    rows = [(row.kind, row.name, round(row.share, 2)) for row in scene.pharos.slow]
    assert rows == [("OBJECT", "Floor", 1.0), ("LIGHT", "Wide Lamp", 1.0)], rows
    name = next(name for name in passes if "Effort" in name)
    assert passes[name].max() > 0.0, passes[name]
    layer.pharos.use_pass_effort = False


harness.main(globals())
