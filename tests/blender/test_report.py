"""scene.pharos.report: everything that is not rendered as given is named, and nothing else."""
# hosts: blender bpy

import bpy
import harness


def _reset_cycles(scene) -> None:
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_fast_gi = cycles.film_transparent_glass = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.min_light_bounces = 0


def test_a_plain_scene_has_nothing_to_report():
    scene = harness.new_scene(8, 8, 1)
    harness.add_camera()
    harness.add_object(harness.cube_mesh(), harness.emission())
    _reset_cycles(scene)
    scene.pharos.follow_cycles = True
    harness.render()
    assert harness.report() == [], harness.report()


def test_settings_of_cycles_that_do_nothing_are_named():
    scene = harness.new_scene(8, 8, 1)
    harness.add_camera()
    cycles, render = scene.cycles, scene.render
    cycles.samples = 1
    scene.pharos.follow_cycles = True
    cycles.use_denoising = cycles.use_fast_gi = cycles.film_transparent_glass = True
    cycles.sample_clamp_direct, cycles.blur_glossy, cycles.min_light_bounces = 1.0, 1.0, 1
    render.film_transparent = render.use_motion_blur = True
    try:
        harness.render()
        found = {line.split(": ", 1)[1] for line in harness.report()}
    finally:
        _reset_cycles(scene)
        render.film_transparent = render.use_motion_blur = False
        scene.pharos.follow_cycles = False
    expected = {
        "Motion blur is not supported.",
        "The picture is not denoised.",
        "Clamping of samples is not used.",
        "Fast GI approximation is not supported.",
        "Transparent glass is not supported.",
        "Filter glossy is not used.",
        "Minimum bounces are not used.",
    }
    assert found == expected, found ^ expected


def test_objects_that_are_not_rendered_are_named():
    harness.new_scene(8, 8, 1)
    harness.add_camera(type="PANO")
    harness.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    held = harness.add_object(harness.cube_mesh(), name="Held")
    held.is_holdout = held.is_shadow_catcher = True
    square = bpy.data.lights.new("Square", "SPOT")
    square.use_square = True
    lamp = harness.link(bpy.data.objects.new("Square", square))
    expected = {
        "Camera: Panoramic cameras are rendered as perspective ones.",
        "Fog: Volumes are not supported.",
        "Held: Holdout is not supported.",
        "Held: Shadow catcher is not supported.",
        "Square: Spot lights are round.",
    }
    if hasattr(lamp, "light_linking"):
        lamp.light_linking.receiver_collection = bpy.data.collections.new("Lit")
        expected.add("Square: Light linking is not supported.")
    harness.render()
    assert set(harness.report()) == expected, set(harness.report()) ^ expected


def test_a_report_that_may_not_be_written_is_written_later():
    """Blender can forbid it for a while (write_flag.py)."""
    from pharos import handlers

    scene = harness.new_scene(8, 8, 1)
    written = []

    def forbidden_once(where, what):
        written.append((where.name, what))
        if len(written) == 1:
            raise AttributeError("Writing to ID classes in this context is not allowed")

    handlers._post(forbidden_once, scene.name, 7)
    assert written == [(scene.name, 7)]
    handlers._deliver()
    assert written == [(scene.name, 7)] * 2
    handlers._deliver()
    assert len(written) == 2


def test_a_report_that_fails_otherwise_is_said_once_and_does_not_stop_the_next():
    from pharos import handlers

    scene = harness.new_scene(8, 8, 1)
    written = []

    def wrong(where, what):
        written.append("wrong")
        raise AttributeError("no such thing")

    handlers._post(wrong, scene.name, 1)
    handlers._post(lambda where, what: written.append(what), scene.name, 2)
    handlers._deliver()
    assert written == ["wrong", 2]


harness.main(globals())
