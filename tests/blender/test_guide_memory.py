"""What the network has learned goes on from frame to frame, and from file to file where asked."""
# hosts: blender bpy

import bpy
import harness
import numpy as np

_FOLDER = harness.TEMPORARY / "memory"


def _scene(memory: str):
    """A box that a lamp behind a screen lights, so that there is something to learn."""
    scene = harness.new_scene(32, 32, 160)  # enough to learn from
    scene.pharos.guiding, scene.pharos.guide_memory = "NEURAL", memory
    white = harness.material("White")
    shader = harness.node(white, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1.0))
    harness.connect(white, shader.outputs[0], harness.surface(white))
    room = harness.add_object(harness.cube_mesh("Room"), white)
    room.scale = (3.0, 3.0, 3.0)
    harness.add_object(harness.plane_mesh("Screen", 0.6), white, location=(0.0, 0.0, 2.0))
    light = bpy.data.lights.new("Lamp", "POINT")
    light.energy, light.shadow_soft_size = 100.0, 0.1
    lamp = harness.link(bpy.data.objects.new("Lamp", light))
    lamp.location = (0.0, 0.0, 2.5)
    lamp.keyframe_insert("location", frame=1)
    lamp.location = (0.3, 0.0, 2.5)
    lamp.keyframe_insert("location", frame=3)
    harness.add_camera(location=(0.0, -2.6, 0.0), rotation=(1.57, 0.0, 0.0))
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    return scene


def _frames(scene, name: str) -> list[np.ndarray]:
    folder = _FOLDER / name
    folder.mkdir(parents=True, exist_ok=True)
    scene.render.filepath = f"{folder}/"
    bpy.ops.render.render(animation=True)
    return [harness.read_exr(path) for path in sorted(folder.glob("*.exr"))]


def _still(scene, frame: int, name: str) -> np.ndarray:
    scene.frame_set(frame)
    path = _FOLDER / f"{name}.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return harness.read_exr(path)


def test_frames_of_an_animation_go_on():
    scene = _scene("ANIMATION")
    frames = _frames(scene, "animation")
    again = _frames(scene, "again")
    assert len(frames) == len(again) == 3
    for a, b in zip(frames, again):
        assert np.array_equal(a, b), "the same animation gives other frames"
    assert np.array_equal(_still(scene, 1, "still1"), frames[0])
    still = _still(scene, 2, "still2")
    assert not np.array_equal(still, frames[1]), "the second frame starts from nothing"
    assert abs(still.mean() / frames[1].mean() - 1.0) < 0.1
    assert np.array_equal(_still(scene, 2, "repeated"), still)
    assert not list(_FOLDER.rglob("*.pharos_guide"))


def test_none_starts_from_nothing():
    scene = _scene("NONE")
    frames = _frames(scene, "none")
    for i, frame in enumerate(frames):
        assert np.array_equal(_still(scene, i + 1, f"none{i}"), frame)


def test_few_samples_are_not_learned_from():
    """Unless another picture goes on from what they teach."""
    scene = _scene("NONE")
    scene.pharos.samples = 8
    for keeps, is_brief in ((False, True), (True, False)):
        session = harness.native().RenderSession(harness.exported(), 2, keeps_field=keeps)
        assert session.wait(60.0)
        why = session.progress().guiding.why_unguided
        assert (why == "off: too few samples to learn from") == is_brief, why


def test_file_beside_the_blend():
    _FOLDER.mkdir(parents=True, exist_ok=True)
    scene = _scene("FILE")
    blend = _FOLDER / "room.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=False)
    scene = bpy.context.scene
    first = _still(scene, 1, "first")
    files = list(_FOLDER.glob("*.pharos_guide"))
    assert len(files) == 1 and files[0].name.startswith("room."), files
    second = _still(scene, 1, "second")
    assert not np.array_equal(first, second)
    # What is no guide is said and learned over.
    files[0].write_bytes(b"no guide")
    assert np.abs(_still(scene, 1, "third").mean() / first.mean() - 1.0) < 0.1
    said = harness.report()
    assert any("Learned anew" in line for line in said), said
    assert files[0].stat().st_size > 1000
    files[0].unlink()
    assert np.array_equal(_still(scene, 1, "fourth"), first)


def test_a_stopped_frame_goes_on_as_it_began():
    """The second frame of an animation, rendered again by another process that has no memory."""
    scene = _scene("ANIMATION")
    scene.pharos.use_checkpoint, scene.pharos.checkpoint_interval = True, 0.05
    kept = {}

    def keep(_scene, *_):
        folder = _FOLDER / "stopped"
        kept.update({path: path.read_bytes() for path in folder.glob("*.pharos_checkpoint")})

    bpy.app.handlers.render_post.append(keep)
    try:
        frames = _frames(scene, "stopped")
    finally:
        bpy.app.handlers.render_post.remove(keep)
    assert not list((_FOLDER / "stopped").glob("*.pharos_checkpoint")), "they go with the picture"
    second = {path: data for path, data in kept.items() if path.name.startswith("0002.")}
    assert len(second) == 2, sorted(kept)  # the checkpoint, and what it began with
    for path, data in second.items():
        path.write_bytes(data)
    scene.frame_start = scene.frame_end = 2
    again = _frames(scene, "stopped")[1]
    assert np.array_equal(again, frames[1])
    assert harness.report() == [], harness.report()
    scene.pharos.use_checkpoint = False


harness.main(globals())
