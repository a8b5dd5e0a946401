"""Large meshes read where they lie, and instances walked in runs: both equal to what Blender says
of each element by itself, bit by bit.
"""
# hosts: blender bpy

import importlib

import bpy
import harness
import numpy as np

SIDE = 40  # 1600 quads: enough for the paths that read memory


def _compat():
    return importlib.import_module("pharos.compat")


def _waves(name: str):
    """A grid, partly flat, with three slots, two UV maps and values of points, corners, faces."""
    rows, columns = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1]
    height = np.sin(rows * 0.3) * np.cos(columns * 0.2)
    vertices = np.stack([columns, rows, height], axis=-1).reshape(-1, 3) / SIDE
    first = (rows[:-1, :-1] * (SIDE + 1) + columns[:-1, :-1]).ravel()
    faces = np.stack([first, first + 1, first + SIDE + 2, first + SIDE + 1], axis=-1)
    mesh = harness.make_mesh(name, vertices.tolist(), faces.tolist())
    random = np.random.default_rng(5)
    count = len(mesh.polygons)
    mesh.polygons.foreach_set("use_smooth", random.random(count) < 0.7)
    mesh.polygons.foreach_set("material_index", random.integers(0, 5, count).astype(np.int32))
    for layer in ("first", "second"):
        made = mesh.uv_layers.new(name=layer)
        made.data.foreach_set("uv", random.random(2 * len(mesh.loops)).astype(np.float32))
    mesh.uv_layers["second"].active_render = True
    for domain, elements in (("POINT", mesh.vertices), ("CORNER", mesh.loops), ("FACE", faces)):
        made = mesh.attributes.new(domain.lower(), "FLOAT_VECTOR", domain)
        made.data.foreach_set("vector", random.random(3 * len(elements)).astype(np.float32))
    mesh.update()
    return mesh


def _reader(*names):
    """A material that reads the attributes and the UV maps."""
    made = harness.material("Reader")
    shader = harness.node(made, "ShaderNodeEmission")
    harness.connect(made, shader.outputs[0], harness.surface(made))
    place = harness.node(made, "ShaderNodeTexCoord")
    total = place.outputs["UV"]
    for name in names:
        found = harness.node(made, "ShaderNodeAttribute")
        found.attribute_name = name
        added = harness.node(made, "ShaderNodeVectorMath")
        harness.connect(made, total, added.inputs[0])
        harness.connect(made, found.outputs["Vector"], added.inputs[1])
        total = added.outputs[0]
    harness.connect(made, total, shader.inputs["Color"])
    return made


def _flat_normals(positions, triangles):
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _said_normals(mesh):
    """Of every corner, as Blender tells them one by one."""
    if hasattr(mesh, "corner_normals"):
        return np.array([tuple(n.vector) for n in mesh.corner_normals], np.float32)
    mesh.calc_normals_split()
    found = np.array([tuple(loop.normal) for loop in mesh.loops], np.float32)
    mesh.free_normals_split()
    return found


def test_large_mesh_bit_by_bit():
    harness.new_scene()
    harness.add_camera()
    slots = [harness.emission(name=f"M{i}") for i in range(2)]
    source = _waves("Waves")
    harness.add_object(source, _reader("point", "corner", "face"), *slots)
    out = harness.exported().mesh(0)
    mesh = bpy.data.objects["Waves"].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    mesh.calc_loop_triangles()
    corners = np.array([tuple(t.loops) for t in mesh.loop_triangles])
    polygons = np.array([t.polygon_index for t in mesh.loop_triangles])
    vertices = np.array([loop.vertex_index for loop in mesh.loops])
    positions = np.array([tuple(v.co) for v in mesh.vertices], np.float32)
    triangles = vertices[corners]
    assert (out["positions"] == positions).all() and (out["triangles"] == triangles).all()
    smooth = np.array([p.use_smooth for p in mesh.polygons])
    normals = _said_normals(mesh)[corners]
    flat = ~smooth[polygons]
    assert flat.any() and not flat.all()
    normals[flat] = _flat_normals(positions, triangles[flat])[:, None, :]
    assert (out["normals"] == normals.reshape(-1, 3)).all()
    materials = np.array([p.material_index for p in mesh.polygons]).clip(0, 2)[polygons]
    assert (out["material_indices"].ravel() == materials).all()
    assert list(out["uv_maps"]) == ["second", "first"]
    for name, uv in out["uv_maps"].items():
        said = np.array([tuple(d.uv) for d in mesh.uv_layers[name].data], np.float32)
        assert (uv == said[corners.ravel()]).all(), name
    indices = {"point": slice(None), "corner": corners.ravel(), "face": polygons}
    assert set(out["attributes"]) == set(indices)
    for name, (_, values) in out["attributes"].items():
        said = np.array([tuple(d.vector) for d in mesh.attributes[name].data], np.float32)
        assert (values.reshape(-1, 3) == said[indices[name]]).all(), name


def test_smooth_mesh_has_normals_of_vertices():
    harness.new_scene()
    harness.add_camera()
    source = _waves("Waves")
    source.polygons.foreach_set("use_smooth", np.ones(len(source.polygons), np.bool_))
    source.update()
    harness.add_object(source)
    out = harness.exported().mesh(0)
    mesh = bpy.data.objects["Waves"].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    said = np.array([tuple(n.vector) for n in mesh.vertex_normals], np.float32)
    assert str(out["normal_domain"]).endswith("Vertex") and (out["normals"] == said).all()


def test_memory_that_lies_otherwise_is_not_read():
    compat = _compat()
    mesh = _waves("Waves")
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    right = compat._in_memory(triangles, compat._TRIANGLE)
    assert right is not None
    assert (
        right["loops"][[3, -1]] == [tuple(triangles[3].loops), tuple(triangles[-1].loops)]
    ).all()
    size = compat._TRIANGLE.itemsize
    longer = compat._layout(size + 4, loops=(0, "3<u4"))
    assert compat._in_memory(triangles, longer) is None
    elsewhere = compat._layout(size, polygon_index=(0, "<u4"))
    assert compat._in_memory(triangles, elsewhere) is None


def _error_of(call) -> str:
    try:
        call()
    except ValueError as error:
        return str(error)
    return ""


def test_broken_arrays_name_the_mesh():
    module = harness.native()
    right = {
        "positions": np.zeros((3, 3), np.float32),
        "corner_vertices": np.arange(3, dtype=np.uint32),
        "triangle_corners": np.arange(3, dtype=np.uint32).reshape(1, 3),
    }
    assert module.gather_mesh("Vase", **right).name == "Vase"
    wrong = (
        ({"triangle_corners": np.array([[0, 1, 3]], np.uint32)}, "corner is beyond the end"),
        ({"triangle_corners": np.array([[0, 1, -1]], np.int32)}, "corner is beyond the end"),
        ({"positions": np.zeros((3, 2), np.float32)}, "rows of 3 were expected"),
        ({"normals": np.zeros((2, 3), np.float32)}, "normals does not fit"),
        ({"uv_maps": [("a", np.zeros((2, 2), np.float32))]}, "uv map a"),
    )
    for fields, message in wrong:
        error = _error_of(lambda given=right | fields: module.gather_mesh("Vase", **given))
        assert error.startswith("Vase: ") and message in error, (fields, error)


def _exported_as_it_is():
    """What the graph holds that _said_instances() asks: a render's shows other things."""
    scene = importlib.import_module("pharos.export.scene")
    report = importlib.import_module("pharos.export.report").Report()
    return scene.export_scene(harness.native(), bpy.context.evaluated_depsgraph_get(), report)


def _said_instances():
    """Name and matrix of each surface instance, as Blender tells them one by one."""
    graph = bpy.context.evaluated_depsgraph_get()
    return [
        (i.object.name, [list(row) for row in i.matrix_world])
        for i in graph.object_instances
        if i.show_self and i.object.type == "MESH"
    ]


def test_instances_of_many_kinds_in_a_row():
    """Objects that are only instanced, alternating; others in between; lamps and hidden ones."""
    harness.new_scene()
    harness.add_camera()
    inside = bpy.data.collections.new("Inside")
    mesh = harness.cube_mesh()
    for name, x in (("A", 1.0), ("B", 2.0)):
        obj = bpy.data.objects.new(name, mesh)
        obj.location.x = x
        inside.objects.link(obj)
    inside.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    for i in range(3):
        empty = harness.link(bpy.data.objects.new(f"E{i}", None))
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.location.y = i
        harness.add_object(mesh, name=f"Plain{i}", location=(0.0, 0.0, i))
    hidden = harness.add_object(mesh, name="Hidden")
    hidden.visible_camera = hidden.visible_diffuse = hidden.visible_glossy = False
    hidden.visible_transmission = hidden.visible_shadow = False
    parent = harness.add_object(_waves("Waves"), name="Parent")
    child = harness.add_object(harness.plane_mesh("Leaf"), name="Child")
    child.parent, parent.instance_type = parent, "VERTS"
    bpy.context.view_layer.update()
    out = _exported_as_it_is()
    said = [(name, rows) for name, rows in _said_instances() if name != "Hidden"]
    found = [(i.name, [list(row) for row in i.to_world]) for i in out.instances]
    names = [name for name, _ in said]
    assert {"A", "B", "Plain1", "Child", "Parent"} <= set(names) and "Hidden" not in names
    assert len(found) > (SIDE + 1) ** 2
    assert found == said, [(a[0], b[0]) for a, b in zip(found, said) if a != b][:5]
    assert len(out.lights) == 3 and out.mesh_count == 3


def test_instanced_colors_are_the_instancers():
    """Attributes of instances are of the instance, not of the object that is shown."""
    harness.new_scene()
    harness.add_camera()
    made = harness.material("Tint")
    shader = harness.node(made, "ShaderNodeEmission")
    info = harness.node(made, "ShaderNodeObjectInfo")
    harness.connect(made, info.outputs["Color"], shader.inputs["Color"])
    harness.connect(made, shader.outputs[0], harness.surface(made))
    mesh = harness.cube_mesh()
    mesh.materials.append(made)
    inside = bpy.data.collections.new("Inside")
    inside.objects.link(bpy.data.objects.new("Only", mesh))
    for i in range(3):
        empty = harness.link(bpy.data.objects.new(f"E{i}", None))
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.color = (i / 4, 1.0, 0.0, 1.0)
    bpy.context.view_layer.update()
    out = harness.exported()
    (colors,) = out.instance_attributes.values()
    assert colors[:, 0].tolist() == [0.0, 0.25, 0.5], colors


harness.main(globals())
