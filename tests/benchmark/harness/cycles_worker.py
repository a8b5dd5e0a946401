"""Renders one scene with Cycles of bpy or Blender, all asked-for budgets in one process.

    python cycles_worker.py SCENE.blend OUT_FOLDER '{"guiding": false, "runs": [[64, 1], ...], ...}'

JSON lines come back: one `START` with the seconds to the open file, those of preparing the scene
and one sample, and the memory before; then a `ROW` for each picture: {"samples", "seed", "seconds"
(CPU of the render call / threads), "wall", "memory" (peak, MiB), "image" (.npy)}.
A first small render is not counted: it loads kernels and lets the threads start.
"""

import json
import os
import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np


def prepare(job):
    """The same conditions for every engine, whatever the file says."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.threads_mode, render.threads = "FIXED", job["threads"]
    render.resolution_percentage = 100
    render.resolution_x, render.resolution_y = job["resolution"]
    render.use_border = False
    render.film_transparent = False
    render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.min_light_bounces = cycles.min_transparent_bounces = 0
    cycles.use_fast_gi = False
    cycles.time_limit = 0.0
    cycles.max_bounces = job["bounces"]
    for kind in ("diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(cycles, f"{kind}_bounces", job["bounces"])
    cycles.use_guiding = cycles.use_surface_guiding = job["guiding"]
    cycles.use_volume_guiding = False
    cycles.guiding_training_samples = 0  # never stop learning: its best setting for long renders
    return scene


def say(word, fields):
    sys.stdout.write(f"{word} {json.dumps(fields)}\n")
    sys.stdout.flush()


def peak_memory():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def render_once(scene, samples, seed, path):
    """CPU and wall seconds of the whole process in the render call, and the linear picture."""
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.render.filepath = str(path)
    before = os.times()
    bpy.ops.render.render(write_still=True)
    after = os.times()
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(pixels)
    width, height = picture.size
    bpy.data.images.remove(picture)
    path.unlink()
    seconds = after.user + after.system - before.user - before.system
    return seconds, after.elapsed - before.elapsed, pixels.reshape(height, width, -1)[..., :3]


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    blend, folder, job = arguments[0], Path(arguments[1]), json.loads(arguments[2])
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = prepare(job)
    ready, memory = time.time(), peak_memory()
    scratch = folder / f"scratch_{os.getpid()}.exr"
    render_once(scene, 1, 0, scratch)
    build, _, _ = render_once(scene, 1, 0, scratch)
    say("START", {"startup": ready - job["began"], "build": build / job["threads"],
                  "memory_before": memory})
    for samples, seed in job["runs"]:
        seconds, wall, pixels = render_once(scene, samples, seed, scratch)
        image = folder / f"{job['name']}_{samples}_{seed}.npy"
        np.save(image, pixels)
        say("ROW", {"samples": samples, "seed": seed, "seconds": seconds / job["threads"],
                    "wall": wall, "memory": peak_memory(), "image": str(image)})


if __name__ == "__main__":
    code = 1
    try:
        main()
        code = 0
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # bpy may hang at the interpreter's exit
