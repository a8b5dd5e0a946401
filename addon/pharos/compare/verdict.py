"""From two engines' pictures to figures, words and one picture with both side by side.

The error of an engine is estimated from its own two pictures: half the mean square of their
difference, relative to the mean of all four. It is that of noise alone, whatever the look.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

EPSILON = 0.01
TRIMMED_SHARE = 0.001
GAP = 4  # pixels between the pictures
_NAMES = {"PHAROS": "Pharos", "CYCLES": "Cycles"}


@dataclass
class Verdict:
    """What a comparison has shown."""

    errors: dict[str, float]  # engine -> relative mean square error
    ratio: float  # how many times less error Pharos has, at equal time
    mean_difference: float  # of Pharos' mean against Cycles', relative
    mean_error: float  # 95 % bound of that by noise
    side_by_side: np.ndarray  # (height, width, 4) linear, bottom row first
    lines: list[str]


def read_picture(path) -> np.ndarray:
    """(height, width, 4) linear, bottom row first."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4)
    finally:
        bpy.data.images.remove(image)


def noise(first: np.ndarray, second: np.ndarray, mean: np.ndarray) -> float:
    """Relative error of one picture, without the worst pixels."""
    squares = 0.5 * (first - second) ** 2 / (mean**2 + EPSILON)
    pixels = np.sort(squares.mean(axis=-1).ravel())
    return float(pixels[: max(1, int(pixels.size * (1.0 - TRIMMED_SHARE)))].mean())


def _mean_difference(ours, theirs):
    """Relative difference of the means, with its 95 % bound."""
    difference = 0.5 * (ours[0] + ours[1]) - 0.5 * (theirs[0] + theirs[1])
    unit = max(float(np.mean(theirs)), 1e-9)
    pixels = difference.mean(axis=-1)
    # Noise of each mean of two, from their own differences: what differs in look is no noise.
    spread = sum(float(np.mean(0.25 * (a - b).mean(axis=-1) ** 2)) for a, b in (ours, theirs))
    return float(pixels.mean()) / unit, 1.96 * math.sqrt(spread / pixels.size) / unit


def _beside(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    gap = np.ones((left.shape[0], GAP, 4), np.float32)
    return np.concatenate([left, gap, right], axis=1)


def _words(results, errors, ratio, difference, bound) -> list[str]:
    lines = []
    for result in results:
        took = " and ".join(f"{seconds:.1f}" for seconds in result.seconds)
        lines.append(
            f"{_NAMES[result.engine]}: {result.samples} samples, {took} CPU seconds, "
            f"error {errors[result.engine]:.3g}"
        )
    better, times = ("Pharos", ratio) if ratio >= 1.0 else ("Cycles", 1.0 / max(ratio, 1e-9))
    lines.append(f"{better} has {times:.2f} times less error at equal time.")
    lines.append(f"Means differ by {100 * difference:+.2f} % +- {100 * bound:.2f} %.")
    for result in results:
        lines += result.changed
    differences = next(result.report for result in results if result.engine == "PHAROS")
    lines += differences or ["Pharos renders everything of this scene as given."]
    return lines


def judge(results) -> Verdict:
    """`results`: Pharos, Cycles (comparison.Contestant)."""
    pictures = [[read_picture(path) for path in result.pictures] for result in results]
    sizes = {picture.shape for pair in pictures for picture in pair}
    if len(sizes) != 1:
        raise ValueError(f"the pictures differ in size: {sorted(sizes)}")
    colors = [
        [np.nan_to_num(picture[..., :3].astype(np.float64)) for picture in pair]
        for pair in pictures
    ]
    mean = sum(picture for pair in colors for picture in pair) / 4.0
    errors, per_time = {}, []
    for result, pair in zip(results, colors, strict=True):
        errors[result.engine] = noise(*pair, mean)
        per_time.append(errors[result.engine] * sum(result.seconds) / len(result.seconds))
    ratio = per_time[1] / max(per_time[0], 1e-12)
    difference, bound = _mean_difference(*colors)
    lines = _words(results, errors, ratio, difference, bound)
    shown = _beside(pictures[0][0], pictures[1][0])
    return Verdict(errors, ratio, difference, bound, shown, lines)
