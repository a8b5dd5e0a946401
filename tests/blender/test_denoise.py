"""Denoised previews: by Blender's own library where it has one, else the reason is said."""

from __future__ import annotations

import bpy
import harness
import numpy as np


def noise() -> np.ndarray:
    pixels = np.ones((96, 128, 4), np.float32)
    pixels[..., :3] = 0.5 * np.random.default_rng(1).exponential(size=(96, 128, 3))
    pixels[..., 3] = 0.25
    return pixels


def test_library_or_reason():
    from pharos import denoise

    oidn, problem = denoise.load()
    assert (oidn is None) == bool(problem)
    if not bpy.app.background or harness.VERSION < (4, 0, 0):
        return  # Debian's Blender has none; others may
    assert oidn is not None, problem


def test_noise_goes_and_the_mean_stays():
    from pharos import denoise

    oidn, problem = denoise.load()
    if oidn is None:
        raise harness.Skip(problem)
    pixels = noise()
    clean = denoise.denoised(oidn, pixels)
    assert clean.shape == pixels.shape
    assert clean[..., :3].std() < 0.2 * pixels[..., :3].std()
    assert abs(clean[..., :3].mean() / pixels[..., :3].mean() - 1.0) < 0.05
    assert (clean[..., 3] == 0.25).all()


def test_a_thread_does_it():
    from pharos import denoise

    oidn, problem = denoise.load()
    if oidn is None:
        raise harness.Skip(problem)
    denoiser = denoise.Denoiser(oidn)
    denoiser.start(noise(), 7)
    denoiser._thread.join(60.0)
    pixels, tag = denoiser.take()
    assert tag == 7 and pixels.shape == (96, 128, 4) and not denoiser.problem
    assert denoiser.take() is None


harness.main(globals())
