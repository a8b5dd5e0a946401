"""Renders the open file's frame once; saves a PNG through the view transform and a linear EXR.

Called by scenes/render inside Blender: -- OUT VIEW_FILE FRAME SAMPLES STRICT, the last three may be
empty. VIEW_FILE tells an interrupted scenes/render how the picture would have been shown. Ends the
process with the exit code of scenes/render.
"""

import os
import sys
import traceback
from pathlib import Path

import bpy

_DONE, _ERROR, _MISSING, _OUT_OF_MEMORY, _NOT_WRITTEN = 0, 1, 3, 4, 5


def say(line):
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def describe_view(scene):
    """Colour configuration, display, transform and exposure, a line each."""
    config = os.environ.get("OCIO") or str(
        Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement" / "config.ocio")
    view = scene.view_settings
    return f"{config}\n{scene.display_settings.display_device}\n" \
           f"{view.view_transform}\n{view.exposure}\n"


def save(scene, folder, out, file_format, depth):
    """By another name first, so that there is never half a picture."""
    settings = scene.render.image_settings
    settings.file_format = file_format
    settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
    settings.color_depth = depth
    part = folder / f"part{out.suffix}"
    bpy.data.images["Render Result"].save_render(str(part), scene=scene)
    part.replace(out)


def stay_in_the_folder(scene, out):
    """What the scene would write elsewhere: files of its compositor, checkpoints of its frames, and
    what its network has learned."""
    trees = [*bpy.data.node_groups, *(s.node_tree for s in bpy.data.scenes if s.node_tree)]
    for tree in trees:
        for node in tree.nodes:
            node.mute = node.mute or node.bl_idname == "CompositorNodeOutputFile"
    for each in bpy.data.scenes:
        if each.pharos.guide_memory == "FILE":
            each.pharos.guide_memory = "ANIMATION"
    scene.render.filepath = out


def render():
    """The exit code of the render alone."""
    try:
        bpy.ops.render.render()
    except RuntimeError as error:
        words = str(error)
        say(f"Error: {words.removeprefix('Error: ').strip()}")
        memory = "Out of memory" in words or "MemoryError" in words
        return _OUT_OF_MEMORY if memory else _ERROR
    return _DONE


def main():
    out, view_file, frame, samples, strict = sys.argv[sys.argv.index("--") + 1:][:5]
    scene = bpy.context.scene
    if frame:
        scene.frame_set(int(frame))
    if samples:
        for settings in (scene.pharos, getattr(scene, "cycles", None)):
            if settings is not None:
                settings.samples = int(samples)
    view_file = Path(view_file)
    view_file.write_text(describe_view(scene), encoding="utf-8")
    stay_in_the_folder(scene, out)
    code = render()
    for entry in scene.pharos.report:
        say(f"Warning: {entry.object}: {entry.message}")
    if code != _DONE:
        return code
    if strict and any(entry.missing for entry in scene.pharos.report):
        say("Error: a file that the scene needs is missing")
        return _MISSING
    try:
        save(scene, view_file.parent, Path(out + ".exr"), "OPEN_EXR", "32")
        save(scene, view_file.parent, Path(out + ".png"), "PNG", "8")
    except (OSError, RuntimeError) as error:
        say(f"Error: the picture cannot be written: {error}")
        return _NOT_WRITTEN
    return _DONE


def finish(code):
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


try:
    finish(main())
except Exception:
    traceback.print_exc()
    finish(_ERROR)
