"""Final renders: exact values, borders, passes, layers, animation, dumps, and what can go wrong."""
# hosts: blender bpy

import bpy
import harness
import numpy as np


def _card(color=(0.18, 0.18, 0.18), width: int = 16, height: int = 16, samples: int = 4):
    """A card that emits and fills the picture."""
    scene = harness.new_scene(width, height, samples)
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), harness.emission(color))
    return scene


def test_emitted_colour_is_exact():
    _card((0.18, 0.5, 2.0))
    pixels = harness.render()
    assert pixels.shape == (16, 16, 4), pixels.shape
    assert harness.close(pixels[..., :3], (0.18, 0.5, 2.0), 1e-6), pixels[8, 8]
    assert harness.close(pixels[..., 3], 1.0)


def test_picture_is_upright():
    """The upper half is red, the left half of the lower one green."""
    harness.new_scene(16, 16)
    harness.add_camera(type="ORTHO", ortho_scale=2.0)
    upper = harness.make_mesh(
        "Upper", [(-1, 0, 0), (1, 0, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)]
    )
    lower = harness.make_mesh(
        "Lower", [(-1, -1, 0), (0, -1, 0), (0, 0, 0), (-1, 0, 0)], [(0, 1, 2, 3)]
    )
    harness.add_object(upper, harness.emission((1.0, 0.0, 0.0), name="Red"))
    harness.add_object(lower, harness.emission((0.0, 1.0, 0.0), name="Green"))
    pixels = harness.render()
    assert harness.close(pixels[9:, :, :3], (1, 0, 0)) and harness.close(
        pixels[:7, :7, :3], (0, 1, 0)
    )
    assert harness.close(pixels[:7, 9:, :3], 0.0)


def test_exposure():
    scene = _card()
    scene.pharos.exposure = 2.0
    assert harness.close(harness.render()[..., :3], 0.36, 1e-6)


def test_transparent_film():
    scene = harness.new_scene(8, 8)
    harness.add_camera()
    harness.set_world((1.0, 1.0, 1.0))
    scene.render.film_transparent = True
    assert harness.close(harness.render(), 0.0)
    scene.render.film_transparent = False
    assert harness.close(harness.render(), 1.0)


def test_follow_cycles():
    scene = _card()
    scene.cycles.samples, scene.cycles.seed, scene.cycles.max_bounces = 3, 9, 5
    scene.cycles.film_exposure, scene.cycles.pixel_filter_type = 3.0, "GAUSSIAN"
    scene.pharos.follow_cycles = True
    out = harness.exported()
    assert (out.settings.samples, out.settings.seed, out.settings.max_bounces) == (3, 9, 5)
    assert out.film.exposure == 3.0 and str(out.film.filter).endswith("Gaussian")
    scene.pharos.follow_cycles = False
    assert harness.exported().settings.samples == scene.pharos.samples
    scene.cycles.film_exposure = 1.0


def test_border():
    """A border renders the same pixels as the whole frame has there."""
    scene = harness.new_scene(32, 16, 4)
    harness.add_camera(rotation=(0.2, 0.1, 0.0))
    harness.add_object(harness.cube_mesh(), harness.emission())
    harness.set_world((0.2, 0.3, 0.4))
    whole = harness.render("whole")
    render = scene.render
    render.use_border, render.use_crop_to_border = True, True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    part = harness.render("part")
    assert part.shape == (8, 16, 4), part.shape
    assert np.array_equal(part, whole[8:, 8:24])
    render.use_crop_to_border = False
    pasted = harness.render("pasted")
    assert np.array_equal(pasted[8:, 8:24], part) and not pasted[:8].any()


def test_border_of_one_pixel():
    scene = _card(width=32, height=32)
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.5, 0.5 + 1.1 / 32
    render.border_min_y, render.border_max_y = 0.25, 0.25 + 1.1 / 32
    pixels = harness.render()
    assert pixels.shape[:2] == (1, 1) and harness.close(pixels[..., :3], 0.18), pixels


def _multilayer(name: str) -> dict:
    """Channels of a multilayer EXR by name."""
    scene = bpy.context.scene
    path = harness.TEMPORARY / f"{name}.exr"
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    if hasattr(settings, "use_exr_interleave"):
        settings.use_exr_interleave = True  # all layers in one part
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return path


def _channel_names(path) -> set[str]:
    """Names in an EXR's header: the channel list is a run of zero-ended strings."""
    data = path.read_bytes()[:4096]
    start = data.index(b"channels\x00chlist\x00") + len(b"channels\x00chlist\x00") + 4
    names = set()
    while data[start]:
        end = data.index(b"\x00", start)
        names.add(data[start:end].decode())
        start = end + 1 + 16
    return names


def test_passes():
    scene = _card()
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    layer.pharos.use_pass_denoising = layer.pharos.use_pass_sample_count = True
    try:
        names = _channel_names(_multilayer("passes"))
    finally:
        layer.use_pass_z = layer.use_pass_normal = False
        layer.pharos.use_pass_denoising = layer.pharos.use_pass_sample_count = False
        if hasattr(scene.render.image_settings, "media_type"):
            scene.render.image_settings.media_type = "IMAGE"
    title = layer.name
    expected = {f"{title}.Combined.{c}" for c in "RGBA"} | {f"{title}.Normal.{c}" for c in "XYZ"}
    expected |= {f"{title}.Denoising Normal.{c}" for c in "XYZ"}
    expected |= {f"{title}.Denoising Albedo.{c}" for c in "RGB"}
    expected |= {f"{title}.Depth.Z", f"{title}.Debug Sample Count.X"}
    assert names == expected, names ^ expected


def test_view_layers():
    scene = _card()
    second = scene.view_layers.new("Second")
    collection = bpy.data.collections.new("Hidden")
    scene.collection.children.link(collection)
    card = next(obj for obj in scene.objects if obj.type == "MESH")
    collection.objects.link(card)
    scene.collection.objects.unlink(card)
    second.layer_collection.children["Hidden"].exclude = True
    try:
        bpy.ops.pharos.dump(filepath=str(harness.TEMPORARY / "layers.pharos"))
        read = harness.native().read_dump
        names = (scene.view_layers[0].name, second.name)
        outs = [read(str(harness.TEMPORARY / f"layers.{name}.pharos")) for name in names]
        assert [len(out.instances) for out in outs] == [1, 0]
    finally:
        scene.view_layers.remove(second)


def test_animation():
    scene = _card()
    material = bpy.data.materials["Emission"]
    strength = next(
        n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeEmission"
    ).inputs["Strength"]
    for frame in (1, 2, 3):
        strength.default_value = float(frame)
        strength.keyframe_insert("default_value", frame=frame)
    scene.frame_end = 3
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(harness.TEMPORARY / "frame_")
    bpy.ops.render.render(animation=True)
    for frame in (1, 2, 3):
        pixels = harness.read_exr(harness.TEMPORARY / f"frame_{frame:04d}.exr")
        assert harness.close(pixels[..., 0], 0.18 * frame, 1e-5), (frame, pixels[4, 4])


def test_same_picture_from_the_dump():
    harness.new_scene(24, 16, 8)
    harness.add_camera(location=(0, -6, 1), rotation=(1.4, 0.0, 0.0))
    shader = harness.material("Mirrors")
    principled = harness.node(shader, "ShaderNodeBsdfPrincipled", Roughness=0.3, Metallic=0.5)
    harness.connect(shader, principled.outputs[0], harness.surface(shader))
    harness.add_object(harness.cube_mesh(), shader)
    harness.set_world((0.5, 0.6, 0.7))
    shown = harness.render()
    module = harness.native()
    session = module.RenderSession(harness.exported(), 1)
    assert session.wait(60.0), "no end"
    pixels = np.empty((16 * 24, 4), np.float32)
    assert session.read(module.FilmPass.Combined, pixels)
    assert np.array_equal(pixels.reshape(16, 24, 4), shown)


def test_no_camera_is_an_error():
    scene = _card()
    scene.camera = None
    try:
        bpy.ops.render.render()
        message = ""
    except RuntimeError as error:
        message = str(error)
    assert "camera" in message.lower(), message


def test_empty_scene_is_black():
    harness.new_scene(8, 8)
    harness.add_camera()
    assert harness.close(harness.render()[..., :3], 0.0)


def test_missing_image_is_magenta_and_named():
    harness.new_scene(8, 8)
    harness.add_camera()
    owner = harness.material("Card")
    texture = harness.node(owner, "ShaderNodeTexImage")
    image = bpy.data.images.new("Gone", 2, 2)
    image.source, image.filepath = "FILE", "/nowhere/gone.png"
    texture.image = image
    shader = harness.node(owner, "ShaderNodeEmission")
    harness.connect(owner, texture.outputs[0], shader.inputs[0])
    harness.connect(owner, shader.outputs[0], harness.surface(owner))
    harness.add_object(harness.plane_mesh(half=10.0), owner)
    pixels = harness.render()
    assert harness.close(pixels[..., :3], (1.0, 0.0, 1.0)), pixels[4, 4]
    assert any(line.startswith("Gone: ") for line in harness.report()), harness.report()


def test_broken_meshes():
    harness.new_scene(8, 8)
    harness.add_camera()
    mesh = harness.cube_mesh()
    mesh.vertices[0].co = (float("nan"), 0.0, 0.0)
    harness.add_object(mesh, harness.emission(), name="Broken")
    flat = harness.add_object(harness.cube_mesh("Flat"), harness.emission(name="Other"))
    flat.scale = (0.0, 0.0, 0.0)
    flat.location = (0.0, 0.0, 1.0)
    pixels = harness.render()
    assert np.isfinite(pixels).all() and pixels[..., :3].max() > 0.0
    assert harness.report() != []


def test_report_is_of_the_last_render():
    scene = harness.new_scene(8, 8)
    harness.add_camera(type="PANO")
    harness.render()
    assert len(harness.report()) == 1
    scene.camera.data.type = "PERSP"
    harness.render()
    assert harness.report() == [], harness.report()


def test_preview_settings_do_not_touch_the_scene():
    scene = _card(samples=2)
    scene.pharos.time_limit = 0.5
    scene.pharos.samples = 1 << 20
    harness.render()
    assert scene.pharos.samples == 1 << 20


harness.main(globals())
