"""Reference pictures: two independent halves for each scene and renderer, kept and extended.

Each engine is measured against a reference of its own renderer, so that a difference in look does
not count as noise. With two halves the noise of the reference cancels from the error (metric.py).
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
    if program == "cycles":
        return {"guiding": hard}
    return {"guiding": "NEURAL" if hard else "OFF"}


def samples_of(scene, program):
    """Samples a pixel of both halves together."""
    folder = _folder(scene, program)
    return sum(_load(folder / f"half{half}.npz")[0] for half in (0, 1))


def ensure(scene, program, samples, threads, log=lambda text: None):
    """Both halves with at least `samples` samples a pixel each, as a pair of float64 pictures."""
    folder = _folder(scene, program)
    run = engines.render_cycles if program == "cycles" else engines.render_pharos
    pair = []
    for half in (0, 1):
        path = folder / f"half{half}.npz"
        have, mean = _load(path)
        while have < samples:
            chunk = min(CHUNK, samples - have)
            log(f"reference {program} {scene.name} half {half + 1}: {have} of {samples} samples")
            seed = SEED_STEP * (half + 1) + have
            shot = run(scene, _options(scene, program), [(chunk, seed)], threads)[0]
            pixels = shot.pixels.astype(np.float64)
            mean = pixels if mean is None else (mean * have + pixels * chunk) / (have + chunk)
            have += chunk
            _store(path, have, mean)
        pair.append(mean)
    (folder / "about.json").write_text(json.dumps(
        {"scene": scene.name, "program": program, "resolution": scene.resolution}))
    return pair
