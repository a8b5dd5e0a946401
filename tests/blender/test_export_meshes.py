"""Meshes and instances: counts, normals by domain, materials, UV maps, visibility, broken input."""
# hosts: blender bpy

import bpy
import harness
import numpy as np


def _domain(mesh_dict) -> str:
    return str(mesh_dict["normal_domain"]).split(".")[-1]


def _prepared():
    scene = harness.new_scene()
    harness.add_camera()
    return scene


def test_flat_cube():
    _prepared()
    harness.add_object(harness.cube_mesh())
    out = harness.exported()
    mesh = out.mesh(0)
    assert out.mesh_count == 1 and len(out.instances) == 1
    assert mesh["positions"].shape == (8, 3) and mesh["triangles"].shape == (12, 3)
    assert _domain(mesh) == "Face" and len(mesh["normals"]) == 0
    assert mesh["uv_maps"] == {} and len(mesh["material_indices"]) == 0
    corners = mesh["positions"][mesh["triangles"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = (normals * corners.mean(axis=1)).sum(axis=1)
    assert (outwards > 0).all(), "triangles are turned inside out"


def test_smooth_cube():
    _prepared()
    mesh = harness.cube_mesh()
    mesh.polygons.foreach_set("use_smooth", [True] * 6)
    harness.add_object(mesh)
    out = harness.exported().mesh(0)
    assert _domain(out) == "Vertex"
    expected = out["positions"] / np.sqrt(3.0)
    assert harness.close(out["normals"], expected, 1e-3), np.abs(out["normals"] - expected).max()


def test_partly_smooth_cube():
    _prepared()
    mesh = harness.cube_mesh()
    mesh.polygons.foreach_set("use_smooth", [False, True, True, True, True, True])
    harness.add_object(mesh)
    out = harness.exported().mesh(0)
    assert _domain(out) == "Corner" and out["normals"].shape == (36, 3)
    normals = out["normals"].reshape(12, 3, 3)
    flat = np.abs(normals[:, :, 0] + 1.0).max(axis=1) < 1e-6
    assert flat.sum() == 2, flat
    assert np.allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-3)


def test_custom_normals():
    _prepared()
    mesh = harness.plane_mesh()
    mesh.polygons.foreach_set("use_smooth", [True])
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True
    wanted = np.array([0.6, 0.0, 0.8])
    mesh.normals_split_custom_set([tuple(wanted)] * 4)
    harness.add_object(mesh)
    out = harness.exported().mesh(0)
    assert _domain(out) == "Corner"
    assert harness.close(out["normals"], np.broadcast_to(wanted, (6, 3)), 2e-3), out["normals"]


def test_several_materials():
    _prepared()
    mesh = harness.cube_mesh()
    names = [harness.emission(name=f"M{i}") for i in range(3)]
    harness.add_object(mesh, *names)
    mesh.polygons.foreach_set("material_index", [0, 1, 2, 2, 1, 7])
    out = harness.exported()
    indices = out.mesh(0)["material_indices"].ravel().tolist()
    assert indices == [0, 0, 1, 1, 2, 2, 2, 2, 1, 1, 2, 2], indices
    assert [m.name for m in out.materials] == ["M0", "M1", "M2"]
    assert out.material_sets == [[0, 1, 2]], out.material_sets


def test_slots_without_material():
    _prepared()
    harness.add_object(harness.cube_mesh())
    none = harness.native().NONE
    assert harness.exported().material_sets == [[none]]


def test_shared_mesh_is_instanced():
    _prepared()
    mesh = harness.cube_mesh()
    for i in range(3):
        harness.add_object(mesh, name=f"I{i}", location=(i, 0.0, 0.0))
    out = harness.exported()
    assert out.mesh_count == 1 and len(out.instances) == 3
    assert sorted(i.to_world[0][3] for i in out.instances) == [0.0, 1.0, 2.0]


def test_object_materials_of_a_shared_mesh():
    _prepared()
    mesh = harness.cube_mesh()
    objects = [harness.add_object(mesh, name=f"I{i}") for i in range(2)]
    mesh.materials.append(harness.emission(name="data"))
    objects[1].material_slots[0].link = "OBJECT"
    objects[1].material_slots[0].material = harness.emission(name="object")
    out = harness.exported()
    assert out.mesh_count == 1 and len(out.material_sets) == 2
    used = {out.materials[out.material_sets[i.material_set][0]].name for i in out.instances}
    assert used == {"data", "object"}


def test_modifiers_are_evaluated():
    _prepared()
    mesh = harness.cube_mesh()
    harness.add_object(mesh, name="plain")
    changed = harness.add_object(mesh, name="changed")
    changed.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    out = harness.exported()
    counts = sorted(len(out.mesh(i)["triangles"]) for i in range(out.mesh_count))
    assert counts == [12, 192], counts


def test_collection_instances():
    scene = _prepared()
    collection = bpy.data.collections.new("Group")
    obj = bpy.data.objects.new("Inside", harness.cube_mesh())
    collection.objects.link(obj)
    for i in range(4):
        empty = harness.link(bpy.data.objects.new(f"E{i}", None))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location = (i, 0.0, 0.0)
    out = harness.exported(scene)
    assert out.mesh_count == 1 and len(out.instances) == 4, (out.mesh_count, len(out.instances))


def test_vertex_instances():
    _prepared()
    parent = harness.add_object(harness.cube_mesh("Points"), name="Parent")
    child = harness.add_object(harness.plane_mesh("Leaf"), name="Child")
    child.parent = parent
    parent.instance_type = "VERTS"
    parent.show_instancer_for_render = False
    out = harness.exported()
    assert len(out.instances) == 8 and out.mesh_count == 1, len(out.instances)


def test_curves_text_and_metaballs():
    _prepared()
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (1.0, 0.0, 0.0, 1.0)
    harness.link(bpy.data.objects.new("Curve", curve))
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    harness.link(bpy.data.objects.new("Ball", ball))
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "ab"
    harness.link(bpy.data.objects.new("Text", text))
    out = harness.exported()
    assert out.mesh_count == 3 and len(out.instances) == 3, [i.name for i in out.instances]
    assert all(len(out.mesh(i)["triangles"]) > 4 for i in range(3))


def test_uv_maps_only_where_used():
    _prepared()
    image = bpy.data.images.new("Picture", 2, 2)
    textured = harness.material("textured")
    texture = harness.node(textured, "ShaderNodeTexImage")
    texture.image = image
    diffuse = harness.node(textured, "ShaderNodeBsdfDiffuse")
    harness.connect(textured, texture.outputs[0], diffuse.inputs[0])
    harness.connect(textured, diffuse.outputs[0], harness.surface(textured))
    for name, owner in (("with", textured), ("without", harness.emission())):
        mesh = harness.plane_mesh(name)
        for layer in ("first", "second"):
            mesh.uv_layers.new(name=layer)
        mesh.uv_layers["second"].active_render = True
        for i, loop in enumerate(mesh.uv_layers["second"].data):
            loop.uv = (i, 2 * i)
        harness.add_object(mesh, owner)
    out = harness.exported()
    by_name = {out.mesh(i)["name"]: out.mesh(i) for i in range(out.mesh_count)}
    assert list(by_name["without"]["uv_maps"]) == []
    maps = by_name["with"]["uv_maps"]
    assert list(maps) == ["second", "first"], list(maps)
    assert maps["second"].shape == (6, 2)
    assert {tuple(row) for row in maps["second"].tolist()} == {(i, 2.0 * i) for i in range(4)}


def test_ray_visibility():
    _prepared()
    obj = harness.add_object(harness.cube_mesh())
    obj.visible_camera = obj.visible_shadow = False
    hidden = harness.add_object(harness.plane_mesh(), name="hidden")
    hidden.hide_render = True
    out = harness.exported()
    module = harness.native()
    expected = module.VISIBLE_DIFFUSE | module.VISIBLE_GLOSSY | module.VISIBLE_TRANSMISSION
    assert [i.visibility for i in out.instances] == [expected]


def test_nonfinite_vertices_pass_through():
    _prepared()
    mesh = harness.cube_mesh()
    mesh.vertices[0].co = (float("nan"), 0.0, 0.0)
    mesh.vertices[1].co = (float("inf"), 0.0, 0.0)
    harness.add_object(mesh)
    positions = harness.exported().mesh(0)["positions"]
    assert np.isfinite(positions).all(axis=1).sum() == 7  # Blender itself clips infinity


def test_empty_mesh_and_edges_only():
    _prepared()
    harness.add_object(bpy.data.meshes.new("Empty"))
    harness.add_object(harness.make_mesh("Edge", [(0, 0, 0), (1, 0, 0)], []))
    out = harness.exported()
    assert out.mesh_count == 0 and len(out.instances) == 0


def test_unsupported_objects_are_named():
    _prepared()
    harness.link(bpy.data.objects.new("Cloud", bpy.data.volumes.new("Cloud")))
    harness.exported()
    assert "Cloud: Volumes are not supported." in harness.report(), harness.report()


def test_world_matrix():
    _prepared()
    obj = harness.add_object(harness.cube_mesh(), location=(1.0, 2.0, 3.0))
    obj.scale, obj.rotation_euler = (1.0, -2.0, 0.5), (0.1, 0.2, 0.3)
    bpy.context.view_layer.update()
    out = harness.exported()
    assert harness.close(out.instances[0].to_world, obj.matrix_world, 1e-6)


harness.main(globals())
