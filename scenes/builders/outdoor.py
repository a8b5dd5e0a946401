"""Objects under a sky picture with a small bright sun, made here by numpy and packed as EXR."""

import tempfile
from pathlib import Path

import numpy as np

from builders import kit

WIDTH, HEIGHT = 512, 256
SUN_AZIMUTH, SUN_ELEVATION, SUN_SIGMA = 215.0, 38.0, 1.0  # degrees


def sky_picture():
    """Latitude-longitude radiance, (HEIGHT, WIDTH, 4) float32, bottom row first."""
    u = (np.arange(WIDTH) + 0.5) / WIDTH
    v = (np.arange(HEIGHT) + 0.5) / HEIGHT
    phi, elevation = np.meshgrid((0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi)
    direction = np.stack([np.cos(elevation) * np.cos(phi), np.cos(elevation) * np.sin(phi),
                          np.sin(elevation)], -1)
    azimuth, height = np.radians(SUN_AZIMUTH), np.radians(SUN_ELEVATION)
    sun = np.array([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth),
                    np.sin(height)])

    # Blue above, pale at the horizon, brown below it, a glow around the sun and the sun itself.
    up = direction[..., 2:3]
    horizon, zenith = np.array([0.62, 0.76, 0.95]), np.array([0.07, 0.20, 0.60])
    radiance = zenith + (horizon - zenith) * np.exp(-5.0 * np.maximum(up, 0.0))
    radiance = np.where(up < 0.0, np.array([0.16, 0.14, 0.12]), radiance)
    angle = np.degrees(np.arccos(np.clip(direction @ sun, -1, 1)))[..., None]
    warm = np.array([1.0, 0.90, 0.74])
    radiance = radiance + 0.8 * warm * np.exp(-angle / 14.0) * (up > 0.0)
    radiance = radiance + 1500.0 * warm * np.exp(-0.5 * (angle / SUN_SIGMA) ** 2)
    return np.concatenate([radiance, np.ones_like(up)], -1).astype(np.float32)


def _packed_sky():
    images = kit.bpy.data.images
    made = images.new("sky", WIDTH, HEIGHT, float_buffer=True)
    made.pixels.foreach_set(sky_picture().ravel())
    scene = kit.bpy.context.scene
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "16", "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "sky.exr")
        made.save_render(path, scene=scene)
        images.remove(made)
        sky = images.load(path)
        sky.pack()
    sky.filepath_raw = "//sky.exr"
    return sky


def build():
    stone = kit.diffuse("stone", 0.46, 0.43, 0.38)
    grass = kit.diffuse("ground", 0.25, 0.27, 0.17)
    red = kit.diffuse("red", 0.60, 0.12, 0.08)
    copper = kit.glossy("copper", 0.92, 0.60, 0.42, 0.18)
    chrome = kit.glossy("chrome", 0.80, 0.80, 0.82, 0.05)

    kit.quad("ground", [(-500, -500, 0), (500, -500, 0), (500, 500, 0), (-500, 500, 0)], grass)
    kit.box("slab", (-2.4, -1.6, 0), (2.4, 1.8, 0.12), stone)
    for i in range(5):
        x = -2.0 + i
        kit.lathe(f"column {i}", [(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.14, 0.16), (0.12, 1.9),
                                  (0.2, 1.98), (0.2, 2.1), (0.0, 2.1)], stone, (x, 1.4, 0.12))
    kit.box("beam", (-2.3, 1.15, 2.22), (2.3, 1.65, 2.5), stone)
    kit.monkey("head", 0.5, (-0.9, -0.2, 0.62), copper, turn=-20)
    kit.sphere("chrome ball", 0.42, (0.75, 0.05, 0.54), chrome, subdivisions=5)
    kit.box("crate", (-0.15, -1.2, 0.12), (0.35, -0.7, 0.62), red, turn=30)

    tree = kit.world((1, 1, 1), 1.0)
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = _packed_sky()
    texture.location = (-300, 300)
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    kit.camera((1.6, -5.6, 1.9), (0, 0.2, 0.95), 38)
