"""Writes the scene of a .blend file as a dump, by the add-on in bpy, under the common conditions.

    python dump_worker.py SCENE.blend OUT WIDTH HEIGHT BOUNCES BEGAN

Says what that took: from BEGAN (seconds since 1970) to the open file, and for the export.
"""

import json
import os
import sys
import time

import bpy


def main():
    blend, out, width, height, bounces, began = sys.argv[1:7]
    import addon_utils  # on the path only once bpy is there

    bpy.ops.wm.open_mainfile(filepath=blend)
    if addon_utils.enable("pharos", default_set=False) is None:
        raise RuntimeError("the add-on could not be enabled; is BLENDER_USER_SCRIPTS right?")
    scene = bpy.context.scene
    scene.render.engine = "PHAROS"
    scene.render.resolution_percentage = 100
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
    scene.render.use_border = False
    settings = scene.pharos
    settings.follow_cycles = False
    settings.use_nee = True
    settings.time_limit = 0.0
    settings.pixel_filter, settings.filter_width = "BOX", 1.0
    settings.caustics_reflective = settings.caustics_refractive = True
    settings.max_bounces = int(bounces)
    for kind in ("diffuse", "glossy", "transmission", "transparent"):
        setattr(settings, f"{kind}_bounces", int(bounces))
    ready = time.time()
    bpy.ops.pharos.dump(filepath=out)
    took = {"startup": ready - float(began), "seconds": time.time() - ready}
    sys.stdout.write(f"EXPORTED {json.dumps(took)}\n")


if __name__ == "__main__":
    code = 1
    try:
        main()
        code = 0 if os.path.exists(sys.argv[2]) else 1  # noqa: PTH110
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # bpy may hang at the interpreter's exit
