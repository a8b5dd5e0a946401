"""The few things every scene of ours is made of: boxes, lathed shapes, materials, lamps, a camera.

Units are metres and watts, z is up. Materials use only plain shaders with constant inputs, so that
every engine under comparison renders the same thing.
"""

import math

import bmesh
import bpy
from mathutils import Matrix, Vector

RESOLUTION = 256
SAMPLES = 64
BOUNCES = 12


def clear():
    """Removes what the start-up file brought along."""
    data = bpy.data
    for blocks in (data.objects, data.meshes, data.lights, data.cameras, data.materials,
                   data.images, data.worlds, data.brushes, data.linestyles, data.palettes):
        data.batch_remove(list(blocks))


def finish(path):
    """Settings that all scenes share, then the file."""
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x = render.resolution_y = RESOLUTION
    render.resolution_percentage = 100
    render.filter_size = 1.0
    render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Filmic"
    scene.view_settings.look = "None"
    _set_cycles(scene.cycles)
    if hasattr(scene, "pharos"):
        render.engine = "PHAROS"
        _set_pharos(scene.pharos)
    else:
        render.engine = "CYCLES"
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=True, relative_remap=False)


def _set_pharos(pharos):
    pharos.samples = SAMPLES
    pharos.pixel_filter, pharos.filter_width = "BOX", 1.0
    pharos.max_bounces = BOUNCES
    for kind in ("diffuse", "glossy", "transmission", "transparent"):
        setattr(pharos, f"{kind}_bounces", BOUNCES)


def _set_cycles(cycles):
    """The same conditions for every engine: no trick that trades bias for noise."""
    cycles.samples = SAMPLES
    cycles.preview_samples = SAMPLES
    cycles.use_adaptive_sampling = False
    cycles.use_preview_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_preview_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.sample_clamp_direct = 0.0
    cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = True
    cycles.caustics_refractive = True
    cycles.max_bounces = BOUNCES
    for kind in ("diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)


# ---- materials


def shader(name, kind, **inputs):
    """A material of one shader node, as in shader("red", "BsdfDiffuse", Color=(.6, .1, .1))."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    node = nodes.new("ShaderNode" + kind)
    for key, value in inputs.items():
        rgba = (*value, 1.0) if isinstance(value, tuple) else value
        node.inputs[key].default_value = rgba
    output = nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    material.diffuse_color = (*inputs.get("Color", (0.8, 0.8, 0.8))[:3], 1.0)
    return material


def diffuse(name, r, g, b):
    return shader(name, "BsdfDiffuse", Color=(r, g, b))


def glossy(name, r, g, b, roughness):
    material = shader(name, "BsdfGlossy", Color=(r, g, b), Roughness=roughness)
    material.node_tree.nodes["Glossy BSDF"].distribution = "GGX"
    return material


def glass(name, ior=1.45, roughness=0.0, tint=(1.0, 1.0, 1.0)):
    material = shader(name, "BsdfGlass", Color=tint, Roughness=roughness, IOR=ior)
    material.node_tree.nodes["Glass BSDF"].distribution = "GGX"
    return material


# ---- shapes


def add(name, mesh, material, location=(0, 0, 0), rotation=(0, 0, 0)):
    thing = bpy.data.objects.new(name, mesh)
    thing.location = location
    thing.rotation_euler = rotation
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _mesh(name, build):
    mesh = bpy.data.meshes.new(name)
    work = bmesh.new()
    build(work)
    work.to_mesh(mesh)
    work.free()
    return mesh


def box(name, low, high, material, turn=0.0):
    """An axis-aligned box between two corners, turned about its own vertical axis (degrees)."""
    low, high = Vector(low), Vector(high)
    scale = Matrix.Diagonal((*(high - low), 1.0))
    mesh = _mesh(name, lambda work: bmesh.ops.create_cube(work, size=1.0, matrix=scale))
    return add(name, mesh, material, (low + high) / 2, (0, 0, math.radians(turn)))


def quad(name, corners, material):
    """Four corners, counter-clockwise seen from the front."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return add(name, mesh, material)


def lathe(name, profile, material, location=(0, 0, 0), steps=64):
    """A profile of (radius, height) turned about the z axis; smooth; radius 0 closes it."""
    mesh = bpy.data.meshes.new(name)
    rings, faces = len(profile), []
    corners = [(r * math.cos(2 * math.pi * s / steps), r * math.sin(2 * math.pi * s / steps), z)
               for s in range(steps) for r, z in profile]
    for s in range(steps):
        a, b = s * rings, (s + 1) % steps * rings
        faces += [(a + i, b + i, b + i + 1, a + i + 1) for i in range(rings - 1)]
    mesh.from_pydata(corners, [], faces)
    work = bmesh.new()
    work.from_mesh(mesh)
    bmesh.ops.remove_doubles(work, verts=work.verts, dist=1e-6)
    work.to_mesh(mesh)
    work.free()
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return add(name, mesh, material, location)


def sphere(name, radius, centre, material, subdivisions=4):
    mesh = _mesh(name, lambda work: bmesh.ops.create_icosphere(
        work, subdivisions=subdivisions, radius=radius))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return add(name, mesh, material, centre)


def monkey(name, size, location, material, turn=0.0, levels=3):
    """Blender's test head, subdivided by a modifier: many triangles in a small file."""
    scale = Matrix.Diagonal((size, size, size, 1.0))
    mesh = _mesh(name, lambda work: bmesh.ops.create_monkey(work, matrix=scale))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    thing = add(name, mesh, material, location, (0, 0, math.radians(turn)))
    subdivision = thing.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = levels
    return thing


def room(name, low, high, walls, openings=()):
    """A room's six inner faces; `walls` maps floor, ceiling, left, right, front, back to materials.

    Faces named in `openings` are left out.
    """
    (x0, y0, z0), (x1, y1, z1) = low, high
    faces = {
        "floor": [(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)],
        "ceiling": [(x0, y0, z1), (x0, y1, z1), (x1, y1, z1), (x1, y0, z1)],
        "left": [(x0, y0, z0), (x0, y1, z0), (x0, y1, z1), (x0, y0, z1)],
        "right": [(x1, y0, z0), (x1, y0, z1), (x1, y1, z1), (x1, y1, z0)],
        "front": [(x0, y0, z0), (x0, y0, z1), (x1, y0, z1), (x1, y0, z0)],
        "back": [(x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1)],
    }
    for face, corners in faces.items():
        if face not in openings:
            quad(f"{name} {face}", corners, walls[face])


# ---- light and camera


def area_lamp(name, watts, size, location, rotation=(0, 0, 0), colour=(1, 1, 1)):
    """A rectangle lamp facing down before it is rotated (degrees)."""
    lamp = bpy.data.lights.new(name, "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = size
    lamp.energy = watts
    lamp.color = colour
    thing = bpy.data.objects.new(name, lamp)
    thing.location = location
    thing.rotation_euler = [math.radians(angle) for angle in rotation]
    bpy.context.scene.collection.objects.link(thing)
    return thing


def world(colour, strength):
    """A world of one colour; returns its node tree for those who want more."""
    block = bpy.data.worlds.new("World")
    block.use_nodes = True
    background = block.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*colour, 1.0)
    background.inputs["Strength"].default_value = strength
    bpy.context.scene.world = block
    return block.node_tree


def camera(location, target, lens):
    block = bpy.data.cameras.new("Camera")
    block.lens = lens
    block.clip_start = 0.01
    thing = bpy.data.objects.new("Camera", block)
    thing.location = location
    aim = Vector(target) - Vector(location)
    thing.rotation_euler = aim.to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.scene.camera = thing
    return thing
