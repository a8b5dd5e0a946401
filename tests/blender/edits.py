"""Random edits of a scene, as a user makes them: functions edit_*, each given a random generator.

An edit that has nothing to work on returns False. No edit looks at what a renderer makes of it.
"""

from __future__ import annotations

import bpy
import harness
from mathutils import Euler, Vector


def pick(random, things):
    things = list(things)
    return random.choice(things) if things else None


def point(random, size: float = 2.0) -> Vector:
    return Vector([random.uniform(-size, size) for _ in range(3)])


def color(random) -> tuple:
    return tuple(random.uniform(0.05, 1.0) for _ in range(3))


def objects(*types):
    """Objects of the scene by name, so that a seed means the same in every run."""
    found = sorted(bpy.context.scene.objects, key=lambda o: o.name)
    return [o for o in found if not types or o.type in types]


def materials():
    return sorted((m for m in bpy.data.materials if m.use_nodes), key=lambda m: m.name)


def object_mode() -> None:
    active = bpy.context.view_layer.objects.active
    if active is not None and active.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def build_scene(random):
    """A small scene with something of everything that edits touch."""
    scene = harness.new_scene(64, 64, 2)
    scene.pharos.preview_samples = 2
    scene.pharos.max_bounces = 4
    harness.set_world((0.3, 0.35, 0.4))
    scene.world.use_nodes = True
    floor = harness.add_object(harness.plane_mesh("Floor", 4.0), principled("White"))
    floor.location.z = -1.0
    for i in range(3):
        cube = harness.add_object(harness.cube_mesh(f"Mesh {i}"), principled(f"Paint {i}"))
        cube.location, cube.scale = point(random), (0.4, 0.5, 0.6)
    light = bpy.data.lights.new("Lamp", "AREA")
    light.energy, light.size = 200.0, 1.0
    harness.link(bpy.data.objects.new("Lamp", light)).location = (1.0, 1.0, 3.0)
    camera = harness.add_camera((0.0, -6.0, 2.0), (1.2, 0.0, 0.0))
    camera.name = "Camera"
    moving = harness.add_object(harness.cube_mesh("Moving"), principled("Moving"))
    moving.scale = (0.3, 0.3, 0.3)
    for frame in (1, 20):
        moving.location = point(random)
        moving.keyframe_insert("location", frame=frame)
    return scene


def principled(name: str):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    return material


# Objects.


def edit_move(random):
    obj = pick(random, objects())
    obj.location = obj.location + 0.3 * point(random)


def edit_rotate_and_scale(random):
    obj = pick(random, objects("MESH"))
    if obj is None:
        return False
    obj.rotation_euler = Euler(point(random))
    obj.scale = [random.choice((-1, 1)) * random.uniform(0.2, 0.8) for _ in range(3)]


def edit_add(random):
    object_mode()
    kind = random.choice(("cube", "ico_sphere", "plane", "torus", "monkey"))
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(location=point(random))
    obj = bpy.context.view_layer.objects.active
    obj.scale = (0.4, 0.4, 0.4)
    if random.random() < 0.7:
        obj.data.materials.append(pick(random, materials()))


def edit_add_other_surfaces(random):
    object_mode()
    kind = random.choice(("text", "curve", "metaball"))
    if kind == "text":
        bpy.ops.object.text_add(location=point(random))
        bpy.context.object.data.body = random.choice(("Light", "Dark"))
        bpy.context.object.data.extrude = 0.1
    elif kind == "curve":
        bpy.ops.curve.primitive_bezier_circle_add(location=point(random))
        bpy.context.object.data.bevel_depth = random.uniform(0.02, 0.2)
    else:
        bpy.ops.object.metaball_add(type="BALL", radius=0.7, location=point(random))


def edit_curves(random):
    obj = pick(random, objects("CURVE", "FONT"))
    if obj is None:
        return False
    obj.data.extrude = random.uniform(0.0, 0.3)


def edit_delete(random):
    found = objects("MESH", "LIGHT", "CURVE", "FONT", "META", "EMPTY")
    if len(found) < 5:
        return False
    object_mode()
    bpy.data.objects.remove(pick(random, found))


def edit_delete_mesh_too(random):
    found = [o for o in objects("MESH") if o.data.users == 1]
    if len(found) < 4:
        return False
    object_mode()
    bpy.data.meshes.remove(pick(random, found).data)


def edit_duplicate(random):
    obj = pick(random, objects("MESH", "LIGHT"))
    copy = obj.copy()
    if random.random() < 0.5:
        copy.data = obj.data.copy()
    copy.location = point(random)
    bpy.context.scene.collection.objects.link(copy)


def edit_rename(random):
    thing = pick(random, [*objects("MESH"), *(o.data for o in objects("MESH")), *materials()])
    thing.name = f"Renamed {random.randrange(1000)}"


def edit_hide(random):
    obj = pick(random, objects())
    if random.random() < 0.5:
        obj.hide_viewport = not obj.hide_viewport
    else:
        obj.hide_set(not obj.hide_get())


def edit_hide_one_show_another(random):
    """In a single update: what is freed may lie where the other comes to be."""
    found = objects("MESH")
    hidden = [o for o in found if o.hide_viewport]
    shown = [o for o in found if not o.hide_viewport]
    if len(shown) < 2:
        return False
    if hidden:
        pick(random, hidden).hide_viewport = False
    pick(random, shown).hide_viewport = True


def edit_ray_visibility(random):
    obj = pick(random, objects("MESH", "LIGHT"))
    name = random.choice(("visible_camera", "visible_diffuse", "visible_glossy", "visible_shadow"))
    setattr(obj, name, not getattr(obj, name))


def edit_parent(random):
    child, parent = pick(random, objects("MESH")), pick(random, objects("MESH", "EMPTY"))
    if child is None or child == parent or parent.parent == child:
        return False
    child.parent = None if child.parent else parent


def edit_collections(random):
    scene = bpy.context.scene
    made = bpy.data.collections.get("Extra")
    if made is None or made.name not in scene.collection.children:
        made = made or bpy.data.collections.new("Extra")
        scene.collection.children.link(made)
        for obj in objects("MESH")[:2]:
            if obj.name not in made.objects:
                made.objects.link(obj)
        return
    layer = bpy.context.view_layer.layer_collection.children[made.name]
    choice = random.randrange(4)
    if choice == 0:
        layer.exclude = not layer.exclude
    elif choice == 1:
        layer.hide_viewport = not layer.hide_viewport
    elif choice == 2:
        made.hide_viewport = not made.hide_viewport
    else:
        empty = bpy.data.objects.new("Instances", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", made
        empty.location = point(random)
        harness.link(empty)


def edit_instancing(random):
    pair = objects("MESH")
    if len(pair) < 2:
        return False
    parent, child = random.sample(pair, 2)
    if parent.parent == child:
        return False
    child.parent = parent
    parent.instance_type = random.choice(("NONE", "VERTS", "FACES"))


# Meshes.


def edit_vertices(random):
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT"])
    if obj is None or not obj.data.vertices:
        return False
    for _ in range(3):
        vertex = obj.data.vertices[random.randrange(len(obj.data.vertices))]
        vertex.co += 0.3 * point(random)
    obj.data.update()


def edit_swap_meshes(random):
    found = [o for o in objects("MESH") if o.mode == "OBJECT"]
    if len(found) < 2:
        return False
    a, b = random.sample(found, 2)
    a.data = b.data


def edit_rebuild_mesh(random):
    """The same mesh, other content of the same size."""
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT"])
    if obj is None:
        return False
    size = random.uniform(0.5, 1.5)
    source = harness.cube_mesh("Source")
    obj.data.clear_geometry()
    obj.data.from_pydata(
        [size * v.co for v in source.vertices], [], [p.vertices[:] for p in source.polygons]
    )
    obj.data.update()
    bpy.data.meshes.remove(source)


def edit_smooth(random):
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT"])
    smooth = random.random() < 0.5
    obj.data.polygons.foreach_set("use_smooth", [smooth] * len(obj.data.polygons))
    obj.data.update()


def edit_material_indices(random):
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT"])
    obj.data.materials.append(pick(random, materials()))
    count = len(obj.data.materials)
    for polygon in obj.data.polygons:
        polygon.material_index = random.randrange(count)
    obj.data.update()


def edit_modifier(random):
    obj = pick(random, objects("MESH"))
    if obj.modifiers and random.random() < 0.4:
        obj.modifiers.remove(obj.modifiers[0])
        return
    kind = random.choice(("ARRAY", "SUBSURF", "SOLIDIFY", "MIRROR"))
    if len(obj.data.polygons) > 500 or len(obj.modifiers) > 2:
        return False
    modifier = obj.modifiers.new(kind.title(), kind)
    if kind == "SOLIDIFY":
        modifier.thickness = random.uniform(0.02, 0.3)
    elif kind == "ARRAY":
        modifier.count = random.randrange(1, 4)


def edit_modifier_value(random):
    found = [m for o in objects("MESH") for m in o.modifiers if m.type in {"ARRAY", "SOLIDIFY"}]
    modifier = pick(random, found)
    if modifier is None:
        return False
    if random.random() < 0.3:
        modifier.show_viewport = not modifier.show_viewport
    elif modifier.type == "ARRAY":
        modifier.count = random.randrange(1, 5)
    else:
        modifier.thickness = random.uniform(0.02, 0.3)


def edit_shape_key(random):
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT"])
    if obj is None or not obj.data.vertices:
        return False
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis")
        key = obj.shape_key_add(name="Key")
        key.data[0].co += point(random)
    obj.data.shape_keys.key_blocks[1].value = random.random()


def edit_uv(random):
    obj = pick(random, [o for o in objects("MESH") if o.mode == "OBJECT" and o.data.polygons])
    if obj is None:
        return False
    layer = obj.data.uv_layers.active or obj.data.uv_layers.new()
    if layer is None:
        return False
    layer.data[random.randrange(len(layer.data))].uv = (random.random(), random.random())
    obj.data.update()


# Materials, world, lamps.


def principled_node(material):
    return next((n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"), None)


def edit_color(random):
    node = principled_node(pick(random, materials()))
    if node is None:
        return False
    node.inputs["Base Color"].default_value = (*color(random), 1.0)
    node.inputs["Roughness"].default_value = random.random()


def edit_assign_material(random):
    obj = pick(random, objects("MESH", "CURVE", "FONT"))
    if not obj.material_slots:
        obj.data.materials.append(pick(random, materials()))
        return
    slot = pick(random, obj.material_slots)
    if random.random() < 0.3:
        slot.link = "OBJECT" if slot.link == "DATA" else "DATA"
    slot.material = pick(random, [*materials(), None])


def edit_emission(random):
    material = pick(random, materials())
    tree = material.node_tree
    node = tree.nodes.get("Glow") or tree.nodes.new("ShaderNodeEmission")
    node.name = "Glow"
    node.inputs["Color"].default_value = (*color(random), 1.0)
    source = node if random.random() < 0.4 else principled_node(material)
    if source is not None:
        tree.links.new(source.outputs[0], tree.get_output_node("ALL").inputs["Surface"])


def image(random):
    found = bpy.data.images.get("Painted")
    if found is None:
        found = bpy.data.images.new("Painted", 8, 8)
        found.generated_type = "COLOR_GRID"
    return found


def edit_texture(random):
    material = pick(random, materials())
    tree = material.node_tree
    target = principled_node(material)
    if target is None:
        return False
    kind = random.choice(("ShaderNodeTexImage", "ShaderNodeTexChecker", "ShaderNodeObjectInfo"))
    node = tree.nodes.new(kind)
    if kind == "ShaderNodeTexImage":
        node.image = image(random)
    output = 0 if kind != "ShaderNodeObjectInfo" else "Random"
    tree.links.new(node.outputs[output], target.inputs["Base Color"])


def edit_unlink(random):
    material = pick(random, materials())
    links = list(material.node_tree.links)
    if not links:
        return False
    material.node_tree.links.remove(pick(random, links))


def edit_mute(random):
    node = pick(random, pick(random, materials()).node_tree.nodes)
    if node is None:
        return False
    node.mute = not node.mute


def edit_node_group(random):
    group = bpy.data.node_groups.get("Tint")
    if group is None:
        group = bpy.data.node_groups.new("Tint", "ShaderNodeTree")
        source = group.nodes.new("ShaderNodeRGB")
        out = group.nodes.new("NodeGroupOutput")
        group.outputs.new("NodeSocketColor", "Color")
        group.links.new(source.outputs[0], out.inputs[0])
    source = next(n for n in group.nodes if n.type == "RGB")
    source.outputs[0].default_value = (*color(random), 1.0)
    material = pick(random, materials())
    target = principled_node(material)
    if target is not None and random.random() < 0.5:
        node = material.node_tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        material.node_tree.links.new(node.outputs[0], target.inputs["Base Color"])


def edit_object_coordinates(random):
    """A texture that follows another object."""
    material = pick(random, materials())
    target = principled_node(material)
    if target is None:
        return False
    tree = material.node_tree
    source = tree.nodes.new("ShaderNodeTexCoord")
    source.object = pick(random, objects())
    checker = tree.nodes.new("ShaderNodeTexChecker")
    tree.links.new(source.outputs["Object"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], target.inputs["Base Color"])


def edit_image(random):
    found = bpy.data.images.get("Painted")
    if found is None:
        return False
    choice = random.randrange(4)
    if choice == 0:
        found.pixels = [random.random() for _ in range(8 * 8 * 4)]
        found.update()
    elif choice == 1:
        found.generated_type = random.choice(("COLOR_GRID", "UV_GRID", "BLANK"))
    elif choice == 2:
        found.colorspace_settings.name = random.choice(("sRGB", "Non-Color"))
    else:
        found.alpha_mode = random.choice(("STRAIGHT", "PREMUL", "NONE"))


def edit_lamp(random):
    lamp = pick(random, objects("LIGHT"))
    if lamp is None:
        return False
    choice = random.randrange(3)
    if choice == 0:
        lamp.data.energy = random.uniform(5.0, 300.0)
    elif choice == 1:
        lamp.data.color = color(random)
    else:
        lamp.data.type = random.choice(("POINT", "SPOT", "AREA", "SUN"))
        lamp.data.energy = 3.0 if lamp.data.type == "SUN" else 200.0


def edit_add_lamp(random):
    light = bpy.data.lights.new("Lamp", random.choice(("POINT", "SPOT", "AREA")))
    light.energy = 100.0
    harness.link(bpy.data.objects.new("Lamp", light)).location = point(random, 3.0)


def edit_world(random):
    world = bpy.context.scene.world
    if world is None:
        bpy.context.scene.world = bpy.data.worlds[0]
        return
    if random.random() < 0.15:
        bpy.context.scene.world = None
        return
    node = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    node.inputs["Color"].default_value = (*color(random), 1.0)
    if random.random() < 0.4 and not node.inputs["Color"].links:
        sky = world.node_tree.nodes.new("ShaderNodeTexGradient")
        world.node_tree.links.new(sky.outputs["Color"], node.inputs["Color"])


# Scene and view.


def edit_frame(random):
    bpy.context.scene.frame_set(random.randrange(1, 21))


def edit_settings(random):
    own = bpy.context.scene.pharos
    choice = random.randrange(5)
    if choice == 0:
        own.max_bounces = random.randrange(0, 6)
    elif choice == 1:
        own.seed = random.randrange(100)
    elif choice == 2:
        own.use_nee = not own.use_nee
    elif choice == 3:
        own.exposure = random.uniform(0.5, 2.0)
    else:
        render = bpy.context.scene.render
        render.film_transparent = not render.film_transparent


def edit_mode(random):
    obj = pick(random, [o for o in objects("MESH") if o.visible_get()])
    if obj is None:
        return False
    object_mode()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode=random.choice(("EDIT", "SCULPT", "OBJECT")))


def edit_in_edit_mode(random):
    import bmesh

    obj = bpy.context.view_layer.objects.active
    if obj is None or obj.type != "MESH" or obj.mode != "EDIT":
        return False
    mesh = bmesh.from_edit_mesh(obj.data)
    if not mesh.verts:
        return False
    mesh.verts.ensure_lookup_table()
    mesh.verts[random.randrange(len(mesh.verts))].co += 0.3 * point(random)
    bmesh.update_edit_mesh(obj.data)


def edit_material_override(random):
    layer = bpy.context.view_layer
    layer.material_override = None if layer.material_override else pick(random, materials())


def edit_selection(random):
    obj = pick(random, objects())
    if not obj.visible_get():
        return False
    object_mode()
    obj.select_set(not obj.select_get())
