"""How wrong a picture is, and how wrong an engine is at a given time.

relMSE = mean over pixels and channels of (I-R)^2 / (R^2 + 0.01). With two independent halves A, B
of the reference (I-R)^2 becomes (I-A)(I-B), whose mean holds no noise of the reference, and R is
their mean. Trimmed: without the 0.1 % of pixels that are worst.
"""

import math
from dataclasses import dataclass

import numpy as np

EPSILON = 0.01
TRIMMED_SHARE = 0.001


@dataclass(frozen=True)
class Error:
    raw: float
    trimmed: float


def relative_error(picture, half_a, half_b):
    """Raw and trimmed relMSE of a picture against two halves of a reference."""
    picture = np.nan_to_num(picture.astype(np.float64), nan=1e3, posinf=1e3, neginf=-1e3)
    reference = 0.5 * (half_a + half_b)
    squares = (picture - half_a) * (picture - half_b) / (reference**2 + EPSILON)
    pixels = np.sort(squares.mean(axis=-1).ravel())
    kept = pixels[: max(1, int(pixels.size * (1.0 - TRIMMED_SHARE)))]
    return Error(float(pixels.mean()), float(kept.mean()))


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
