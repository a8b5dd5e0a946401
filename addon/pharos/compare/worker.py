"""Run by a background Blender that has opened a copy of the scene: renders it with one engine.

    blender -b SCENE.blend -P worker.py -- JOB.json

The job names the scene, the engine, the CPU seconds of a picture, threads, seed and a folder. Two
pictures of different seeds are made, so that their difference tells their noise. What they took
is written to RESULT.json in the folder.
"""

import importlib
import json
import os
import sys
from pathlib import Path

import bpy

MOST_SAMPLES = 1 << 20
ENOUGH = 0.15  # of the wanted time, to know what a sample costs
TOLERANCE = 0.1  # of the wanted time: else the picture is made once more


class AllSamples:
    """Nothing that stops a render early or makes its samples dependent."""

    NEVER = ("use_adaptive_sampling", "use_denoising", "use_fast_gi", "use_animated_seed")
    ZERO = ("sample_clamp_direct", "sample_clamp_indirect", "blur_glossy", "time_limit",
            "light_sampling_threshold", "min_light_bounces", "min_transparent_bounces")

    def __init__(self, cycles):
        self.changed = []
        for names, value in ((self.NEVER, False), (self.ZERO, 0)):
            for name in names:
                if getattr(cycles, name, value) != value:
                    setattr(cycles, name, value)
                    self.changed.append(f"Cycles: {name} was switched off.")


def same_light_paths(scene):
    """Cycles takes what Pharos renders with, where Pharos does not follow Cycles."""
    own, cycles = scene.pharos, scene.cycles
    cycles.max_bounces = own.max_bounces
    for kind in ("diffuse", "glossy", "transmission"):
        setattr(cycles, f"{kind}_bounces", getattr(own, f"{kind}_bounces"))
    cycles.transparent_max_bounces = own.transparent_bounces
    cycles.caustics_reflective = own.caustics_reflective
    cycles.caustics_refractive = own.caustics_refractive
    cycles.pixel_filter_type, cycles.filter_width = own.pixel_filter, own.filter_width
    cycles.film_exposure = own.exposure


def prepare(scene, job):
    """What was changed for the comparison."""
    render, own = scene.render, scene.pharos
    render.engine = job["engine"]
    own.use_checkpoint = False  # each render is to take its time
    render.use_crop_to_border = True
    render.use_compositing = render.use_sequencer = render.use_multiview = False
    render.threads_mode, render.threads = "FIXED", job["threads"]
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGBA"
    changed = []
    if job["engine"] == "CYCLES":
        scene.cycles.device = "CPU"
        changed = AllSamples(scene.cycles).changed
        if not own.follow_cycles:
            same_light_paths(scene)
        for layer in scene.view_layers:
            layer.samples = 0
    else:
        scene.cycles.time_limit = own.time_limit = 0.0
        for layer in scene.view_layers:
            layer.samples = 0
    return changed


class Renders:
    """Renders the scene and counts the CPU seconds of the whole process."""

    def __init__(self, scene, folder):
        self._scene, self._folder = scene, folder

    def __call__(self, samples, seed, name="trial"):
        scene = self._scene
        scene.cycles.samples = scene.pharos.samples = samples
        scene.cycles.seed = scene.pharos.seed = seed
        scene.render.filepath = str(self._folder / f"{name}.exr")
        before = os.times()
        bpy.ops.render.render(write_still=True, scene=scene.name)
        after = os.times()
        return after.user + after.system - before.user - before.system


def samples_for(seconds, render, seed):
    """How many samples take so long: renders more and more of them until that is known."""
    render(1, seed)  # kernels are loaded, threads are started
    start, samples = render(1, seed), 4
    took = render(samples, seed)
    while took < ENOUGH * seconds and samples < MOST_SAMPLES:
        samples *= 4
        took = render(samples, seed)
    cost = max(took - start, 1e-3) / (samples - 1)
    return min(max(round((seconds - start) / cost) + 1, 1), MOST_SAMPLES)


def render_pair(job, render):
    """Two pictures that each took about the wanted time."""
    wanted, seed = job["seconds"], job["seed"]
    samples = samples_for(wanted, render, seed)
    took = render(samples, seed, "first")
    if abs(took - wanted) > TOLERANCE * wanted and samples > 1:
        samples = max(round(samples * wanted / took), 1)
        took = render(samples, seed, "first")
    return {"samples": samples, "seconds": [took, render(samples, seed + 1, "second")]}


def load_addon():
    """The add-on this file belongs to, wherever it lies."""
    if not hasattr(bpy.types.Scene, "pharos"):
        folder = Path(__file__).resolve().parents[1]
        sys.path.insert(0, str(folder.parent))
        importlib.import_module(folder.name).register()


def main():
    job = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    load_addon()
    scene = bpy.data.scenes[job["scene"]]
    changed = prepare(scene, job)
    folder = Path(job["folder"])
    result = render_pair(job, Renders(scene, folder))
    said = [f"{e.object}: {e.message}" for e in scene.pharos.report]
    result |= {"changed": changed, "report": said if job["engine"] == "PHAROS" else []}
    scratch = folder / "RESULT.partial"
    scratch.write_text(json.dumps(result), encoding="utf-8")
    scratch.replace(folder / "RESULT.json")


main()
