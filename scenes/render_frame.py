"""Renders the open file's frame once; saves a PNG through the view transform and a linear EXR.

Called by scenes/render inside Blender: -- OUT VIEW_FILE FRAME SAMPLES, the last two may be empty.
VIEW_FILE tells an interrupted scenes/render how the picture would have been shown.
"""

import os
import sys
from pathlib import Path

import bpy


def describe_view(scene):
    """Colour configuration, display, transform and exposure, a line each."""
    config = os.environ.get("OCIO") or str(
        Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement" / "config.ocio")
    view = scene.view_settings
    return f"{config}\n{scene.display_settings.display_device}\n" \
           f"{view.view_transform}\n{view.exposure}\n"


def save(scene, path, file_format, depth):
    settings = scene.render.image_settings
    settings.file_format = file_format
    settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
    settings.color_depth = depth
    bpy.data.images["Render Result"].save_render(path, scene=scene)


def main():
    out, view_file, frame, samples = sys.argv[sys.argv.index("--") + 1:][:4]
    scene = bpy.context.scene
    if frame:
        scene.frame_set(int(frame))
    if samples:
        for settings in (scene.pharos, getattr(scene, "cycles", None)):
            if settings is not None:
                settings.samples = int(samples)
    Path(view_file).write_text(describe_view(scene), encoding="utf-8")
    bpy.ops.render.render()
    save(scene, out + ".exr", "OPEN_EXR", "32")
    save(scene, out + ".png", "PNG", "8")
    for entry in scene.pharos.report:
        print(f"Warning: {entry.object}: {entry.message}")


main()
