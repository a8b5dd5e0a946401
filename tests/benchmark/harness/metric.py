"""How wrong a picture is, and how wrong an engine is at a given time.

relMSE = mean over pixels and channels of (I-R)^2 / (R^2 + 0.01). With two independent halves A, B
of the reference (I-R)^2 becomes (I-A)(I-B), whose mean holds no noise of the reference, and R is
their mean. Trimmed: without the 0.1 % of pixels that are worst.

An engine is biased when the mean of many of its pictures is not the reference. What is looked at is
the mean over pixels of (I-R)/(R+0.1) relative to that of R/(R+0.1), so that the dark half of a
picture counts as the bright one does; each half's weight goes with the other half's difference.
"""

import math
from dataclasses import dataclass

import numpy as np

EPSILON = 0.01
TRIMMED_SHARE = 0.001
CUTOUT_TRIMMED_SHARE = 0.01  # of some hundred pixels
BIAS_FLOOR = 0.1
SURE_SIGMAS = 4.0
LEAST_BIAS = 0.0025


@dataclass(frozen=True)
class Error:
    raw: float
    trimmed: float


def relative_error(picture, half_a, half_b, trimmed_share=TRIMMED_SHARE):
    """Raw and trimmed relMSE of a picture against two halves of a reference."""
    picture = np.nan_to_num(picture.astype(np.float64), nan=1e3, posinf=1e3, neginf=-1e3)
    reference = 0.5 * (half_a + half_b)
    squares = (picture - half_a) * (picture - half_b) / (reference**2 + EPSILON)
    pixels = np.sort(squares.mean(axis=-1).ravel())
    kept = pixels[: max(1, int(pixels.size * (1.0 - trimmed_share)))]
    return Error(float(pixels.mean()), float(kept.mean()))


def reference_error(half_a, half_b):
    """relMSE of the mean of the two halves: usable when well under the errors measured with it."""
    reference = 0.5 * (half_a + half_b)
    return float(np.mean(0.25 * (half_a - half_b) ** 2 / (reference**2 + EPSILON)))


def nonfinite_pixels(picture):
    return int(np.count_nonzero(~np.isfinite(picture).all(axis=-1)))


@dataclass(frozen=True)
class Bias:
    """Relative difference of a picture's mean from the reference's, with standard errors."""

    value: float
    error: float  # of the value, noise of the reference included
    reference_error: float  # the part that does not shrink with more pictures


def bias_of(picture, half_a, half_b):
    """Pixels are independent samples: their spread gives the standard error."""
    picture = np.nan_to_num(picture.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    weight_a, weight_b = (1.0 / (np.maximum(half, 0.0) + BIAS_FLOOR) for half in (half_a, half_b))
    difference = 0.5 * (weight_b * (picture - half_a) + weight_a * (picture - half_b))
    noise = 0.25 * (weight_a + weight_b) * (half_a - half_b)
    unit = 0.5 * float(np.mean(weight_b * half_a + weight_a * half_b))
    pixels, noise = difference.mean(axis=-1).ravel(), noise.mean(axis=-1).ravel()
    scale = 1.0 / (max(unit, 1e-12) * math.sqrt(pixels.size))
    return Bias(float(pixels.mean()) / max(unit, 1e-12), float(pixels.std()) * scale,
                float(np.sqrt(np.mean(noise**2))) * scale)


def mean_bias(biases):
    """Of several pictures measured against one reference."""
    count = len(biases)
    own = sum(max(b.error**2 - b.reference_error**2, 0.0) for b in biases) / count**2
    shared = max(b.reference_error for b in biases)
    return Bias(sum(b.value for b in biases) / count, math.sqrt(own + shared**2), shared)


def block_difference(picture, reference, size=8):
    """Median over blocks of the relative difference of their means: not moved by single pixels."""
    height, width = (size * (n // size) for n in picture.shape[:2])

    def blocks(pixels):
        part = pixels[:height, :width].mean(axis=-1)
        return part.reshape(height // size, size, width // size, size).mean(axis=(1, 3))

    mine, theirs = blocks(picture), blocks(reference)
    return float(np.median(np.abs(mine - theirs) / (theirs + BIAS_FLOOR)))


def is_biased(bias):
    """Only what is sure: heavy tails make standard errors a little too small."""
    return abs(bias.value) > max(SURE_SIGMAS * bias.error, LEAST_BIAS)


def error_at(seconds, times, errors):
    """Error after `seconds`, between budgets on a straight line in log-log.

    Outside of the budgets the last two go on, with a slope no better than Monte Carlo's -1.
    """
    points = sorted(zip(times, errors, strict=True))
    log_t = [math.log(t) for t, _ in points]
    log_e = [math.log(max(e, 1e-12)) for _, e in points]
    target = math.log(seconds)
    if len(points) == 1:
        return math.exp(log_e[0] - (target - log_t[0]))
    i = min(max(int(np.searchsorted(log_t, target)), 1), len(points) - 1)
    slope = (log_e[i] - log_e[i - 1]) / max(log_t[i] - log_t[i - 1], 1e-9)
    anchor = i - 1
    if target > log_t[-1] or target < log_t[0]:
        slope = min(max(slope, -1.0), 0.0)
        anchor = len(points) - 1 if target > log_t[-1] else 0
    return math.exp(log_e[anchor] + slope * (target - log_t[anchor]))


# Two-sided 95 % quantiles of Student's t for 1 ... 15 degrees of freedom.
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179,
            2.160, 2.145, 2.131)


@dataclass(frozen=True)
class Ratio:
    """How many times smaller an error is, with the 95 % interval over seeds."""

    value: float
    low: float
    high: float


def error_ratio(others, ours):
    """Of the mean errors of two sets of seeds: others / ours; above 1 ours is better.

    The interval is that of the logarithm (delta method), by Student's t.
    """
    others, ours = np.asarray(others, float), np.asarray(ours, float)
    value = others.mean() / ours.mean()
    if len(others) < 2 or len(ours) < 2:
        return Ratio(value, math.nan, math.nan)
    spread = math.sqrt(sum(side.var(ddof=1) / len(side) / side.mean() ** 2
                           for side in (others, ours)))
    freedom = min(len(others), len(ours)) - 1
    quantile = _STUDENT[freedom - 1] if freedom <= len(_STUDENT) else 1.96
    return Ratio(value, value * math.exp(-quantile * spread), value * math.exp(quantile * spread))


def slope_rate(samples, seconds):
    """Samples a second without start-up: the slope between the smallest and the largest budget."""
    low, high = min(samples), max(samples)
    if low == high:
        return samples[0] / seconds[0]
    mean = {n: np.mean([t for m, t in zip(samples, seconds, strict=True) if m == n])
            for n in (low, high)}
    return (high - low) / max(mean[high] - mean[low], 1e-9)
