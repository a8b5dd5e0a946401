"""Camera windows against Blender's own projection, over fits, shifts, aspects and kinds."""
# hosts: blender bpy

import itertools

import bpy
import harness
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector


def _project(camera, point) -> np.ndarray:
    """Position in the frame, 0 ... 1, by the exported camera."""
    local = np.linalg.inv(np.array(camera.to_world)) @ np.array([*point, 1.0])
    at = local[:2]
    if camera.type == harness.native().CameraType.Perspective:
        at = at / -local[2]
    lower, upper = np.array(camera.window_lower), np.array(camera.window_upper)
    return (at - lower) / (upper - lower)


def _compare(camera_object) -> None:
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    camera = harness.exported().camera
    rng = np.random.default_rng(1)
    to_world = np.array(camera_object.matrix_world.normalized())
    for _ in range(20):
        local = rng.uniform((-2, -2, -9), (2, 2, -1))
        point = to_world[:3, :3] @ local + to_world[:3, 3]
        expected = world_to_camera_view(scene, camera_object, Vector(point))
        error = np.abs(_project(camera, point) - np.array(expected[:2])).max()
        assert error < 2e-5, (error, scene.render.resolution_x, camera_object.data.sensor_fit)


def test_projection():
    fits = ("AUTO", "HORIZONTAL", "VERTICAL")
    sizes = ((64, 32), (32, 64), (32, 32))
    for kind, fit, size in itertools.product(("PERSP", "ORTHO"), fits, sizes):
        scene = harness.new_scene(*size)
        scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, 1.25
        camera = harness.add_camera(
            (1, 2, 3),
            (0.3, -0.7, 1.1),
            type=kind,
            sensor_fit=fit,
            sensor_width=30.0,
            sensor_height=20.0,
            lens=40.0,
            ortho_scale=5.0,
            shift_x=0.13,
            shift_y=-0.21,
        )
        _compare(camera)


def test_scale_of_the_object_is_ignored():
    harness.new_scene(32, 16)
    camera = harness.add_camera((0, 1, 5), (0.2, 0.1, 0.0))
    camera.scale = (3.0, 0.5, 2.0)
    _compare(camera)


def test_depth_of_field():
    harness.new_scene()
    camera = harness.add_camera(lens=50.0)
    dof = camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 2.0, 3.5
    dof.aperture_blades, dof.aperture_ratio, dof.aperture_rotation = 5, 1.5, 0.25
    out = harness.exported().camera
    assert harness.close(out.lens_radius, 0.05 / 4.0), out.lens_radius
    assert harness.close(out.focus_distance, 3.5)
    assert (out.aperture_blades, out.aperture_ratio, out.aperture_rotation) == (5, 1.5, 0.25)
    target = harness.link(bpy.data.objects.new("Target", None))
    target.location = (2.0, 1.0, -2.0)
    dof.focus_object = target
    assert harness.close(harness.exported().camera.focus_distance, 6.0, 1e-5)
    dof.use_dof = False
    assert harness.exported().camera.lens_radius == 0.0


def test_clip_and_border():
    scene = harness.new_scene(100, 50)
    harness.add_camera(clip_start=0.25, clip_end=77.0)
    scene.render.use_border = True
    border = (0.25, 0.755, 0.5, 1.0)
    (
        scene.render.border_min_x,
        scene.render.border_max_x,
        scene.render.border_min_y,
        scene.render.border_max_y,
    ) = border
    out = harness.exported()
    assert (out.camera.near_clip, out.camera.far_clip) == (0.25, 77.0)
    film = out.film
    assert (film.width, film.height) == (100, 50)
    assert (film.crop_x, film.crop_y, film.crop_width, film.crop_height) == (25, 25, 50, 25), (
        film.crop_x,
        film.crop_y,
        film.crop_width,
        film.crop_height,
    )


def test_panorama_is_named():
    harness.new_scene()
    harness.add_camera(type="PANO")
    harness.exported()
    assert any("Panoramic" in line for line in harness.report()), harness.report()


harness.main(globals())
