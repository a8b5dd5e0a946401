"""Reference pictures: two independent halves for each scene and renderer, kept and extended.

Each engine is measured against a reference of its own renderer, so that a difference in look does
not count as noise. With two halves the noise of the reference cancels from the error (metric.py).
A scene that is the middle of a larger one at half its resolution needs no references of its own:
with a box filter of one pixel, four pixels of the larger picture are one of the smaller.
"""

import json
import os

import numpy as np

from harness import engines

CHUNK = 256  # an interrupted series loses no more than this
SEED_STEP = 1_000_000
HARD = ("door", "lamp", "veach_ajar", "veach_ajar@128")  # guided references converge sooner here


def _folder(scene, program):
    return engines.cache_folder() / "references" / f"{scene.name}_{program}_{scene.key()}"


def _load(path):
    """(samples, mean picture) of a half; (0, None) before there is one."""
    if not path.exists():
        return 0, None
    with np.load(path) as stored:
        return int(stored["samples"]), stored["mean"]


def _store(path, samples, mean):
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{os.getpid()}_{path.name}")
    with scratch.open("wb") as file:
        np.savez(file, samples=samples, mean=mean)
    scratch.replace(path)


def _options(scene, program):
    hard = scene.name in HARD
    if program.startswith("cycles"):
        return {"guiding": hard and program == "cycles"}
    return {"guiding": "NEURAL" if hard else "OFF"}


def from_larger(picture, resolution):
    """The middle rows of a picture of at least twice the height and exactly twice the width."""
    width, height = resolution
    rows, columns, channels = picture.shape
    first = (rows - 2 * height) // 2
    if columns != 2 * width or rows < 2 * height or (rows - 2 * height) % 2:
        raise ValueError(f"{columns} x {rows} pixels do not give {width} x {height}")
    middle = picture[first:first + 2 * height]
    return middle.reshape(height, 2, width, 2, channels).mean(axis=(1, 3))


def ensure(scene, program, samples, threads, log=lambda text: None):
    """Both halves with at least `samples` samples a pixel each, as a pair of float64 pictures."""
    if scene.larger:
        pair = ensure(scene.larger, program, -(-samples // 4), threads, log)
        return [from_larger(half, scene.resolution) for half in pair]
    folder = _folder(scene, program)
    pair = []
    for half in (0, 1):
        path = folder / f"half{half}.npz"
        have, mean = _load(path)
        while have < samples:
            chunk = min(CHUNK, samples - have)
            log(f"reference {program} {scene.name} half {half + 1}: {have} of {samples} samples")
            seed = SEED_STEP * (half + 1) + have
            run = engines.PROGRAMS[program]
            shot = next(iter(run(scene, _options(scene, program), [(chunk, seed)], threads)))
            pixels = shot.pixels.astype(np.float64)
            mean = pixels if mean is None else (mean * have + pixels * chunk) / (have + chunk)
            have += chunk
            _store(path, have, mean)
        pair.append(mean)
    (folder / "about.json").write_text(json.dumps(
        {"scene": scene.name, "program": program, "resolution": scene.resolution}))
    return pair
