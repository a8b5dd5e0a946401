"""The benchmark's arithmetic against cases with known answers."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmark"))

from harness import metric, report


def noisy(random, sigma, shape=(64, 64, 3), mean=2.0):
    return mean + sigma * random.standard_normal(shape)


def test_noise_of_the_reference_cancels():
    random = np.random.default_rng(1)
    errors = []
    for _ in range(40):
        picture = noisy(random, 0.1)
        halves = [noisy(random, 0.1) for _ in range(2)]
        errors.append(metric.relative_error(picture, *halves).raw)
    # Plain (I-R)^2 would give 1.5 times this.
    assert np.mean(errors) == pytest.approx(0.01 / 4.01, rel=0.03)


def test_trimming_takes_away_the_worst_pixels():
    reference = np.full((100, 100, 3), 1.0)
    picture = reference.copy()
    picture[0, :10] = 101.0
    error = metric.relative_error(picture, reference, reference)
    assert error.raw == pytest.approx(1e4 / 1.01 * 1e-3)
    assert error.trimmed == pytest.approx(0.0)


def test_a_picture_of_nan_is_very_wrong():
    reference = np.full((8, 8, 3), 1.0)
    assert metric.relative_error(np.full((8, 8, 3), np.nan), reference, reference).raw > 1e5


def test_interpolation_follows_a_power_law():
    times = [1.0, 4.0, 16.0]
    errors = [0.8 / t for t in times]
    for t in (0.5, 1.0, 2.0, 7.0, 16.0, 64.0):
        assert metric.error_at(t, times, errors) == pytest.approx(0.8 / t)


def test_outside_of_the_budgets_nobody_learns_faster_than_monte_carlo():
    assert metric.error_at(4.0, [1.0, 2.0], [1.0, 0.1]) == pytest.approx(0.05)
    assert metric.error_at(0.5, [1.0, 2.0], [1.0, 0.1]) == pytest.approx(2.0)


def test_ratio_interval_holds_the_truth():
    random = np.random.default_rng(2)
    hits = 0
    for _ in range(400):
        ours = np.exp(0.2 * random.standard_normal(8))
        others = 3.0 * np.exp(0.2 * random.standard_normal(8))
        ratio = metric.error_ratio(others, ours)
        hits += ratio.low <= 3.0 <= ratio.high
    assert 0.92 <= hits / 400 <= 1.0


def test_rate_leaves_the_start_up_out():
    assert metric.slope_rate([8, 32], [1.0 + 0.08, 1.0 + 0.32]) == pytest.approx(100.0)


def test_table_names_the_better_engine():
    rows = [{"scene": "door", "engine": engine, "samples": n, "seed": seed, "seconds": n * cost,
             "raw": size * (1 + 0.01 * seed) / n, "trimmed": size * (1 + 0.01 * seed) / n}
            for engine, cost, size in (("slow", 0.2, 1.0), ("fast", 0.1, 1.0))
            for n in (8, 32) for seed in (1, 2, 3)]
    lines = report.table(report.compare(rows, "slow", 16, {"door": 100}), "slow")
    assert any("fast" in line and "2.00x" in line for line in lines)
    assert lines[-1].endswith("fast 2.00x")
