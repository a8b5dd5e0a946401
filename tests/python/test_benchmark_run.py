"""The benchmark measures what is there, says what is wrong, and is stopped by nothing."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmark"))

from harness import metric, process, references, report, results
from harness.engines import Shot
from harness.process import EngineError
from harness.runner import Plan, Runner
from harness.scenes import Engine, Scene

SIZE = (128, 96)
SIGMA = 0.2
CONDITIONS = {"conditions": {"threads": 2, "scenes": {"ramp": "key"}}}
CRASH = [sys.executable, "-c", "import os; os.abort()"]


def truth():
    """A picture with dark and bright parts."""
    height, width = SIZE[1], SIZE[0]
    ramp = np.linspace(0.05, 2.0, width)[None, :, None] * np.ones((height, 1, 3))
    return ramp * (1.0 + 0.3 * np.sin(np.arange(height) / 5.0))[:, None, None]


def expected_error(samples):
    """relMSE of noise whose standard deviation is SIGMA times the truth for one sample."""
    squares = truth() ** 2
    return float(np.mean(SIGMA**2 * squares / (squares + metric.EPSILON))) / samples


def picture(samples, seed, scale=1.0):
    random = np.random.default_rng((samples, seed, 7))
    noise = SIGMA / np.sqrt(samples) * truth() * random.standard_normal(truth().shape)
    return (scale * (truth() + noise)).astype(np.float32)


def good(scene, options, runs, threads, program=None):
    for samples, seed in runs:
        yield Shot(samples, seed, 0.01 * samples, picture(samples, seed))


def biased(scene, options, runs, threads, program=None):
    for samples, seed in runs:
        yield Shot(samples, seed, 0.01 * samples, picture(samples, seed, 1.01))


def broken(scene, options, runs, threads, program=None):
    process.check(process.run(CRASH, 60), CRASH[0])
    yield Shot(1, 1, 1.0, truth())


def not_a_number(scene, options, runs, threads, program=None):
    for samples, seed in runs:
        pixels = picture(samples, seed)
        pixels[3, 4:9] = np.nan
        yield Shot(samples, seed, 0.01 * samples, pixels)


class Fragile:
    """Crashes after its second picture, once."""

    def __init__(self):
        self.asked = []

    def __call__(self, scene, options, runs, threads, program=None):
        self.asked.append(list(runs))
        for count, (samples, seed) in enumerate(runs):
            if len(self.asked) == 1 and count == 2:
                process.check(process.run(CRASH, 60), CRASH[0])
            yield Shot(samples, seed, 0.01 * samples, picture(samples, seed))


def halves(scene, program):
    random = np.random.default_rng(99)
    return [truth() * (1.0 + 0.003 * random.standard_normal(truth().shape)) for _ in range(2)]


def plan(programs, seeds=3, budgets=(4, 16, 64)):
    scene = Scene("ramp", Path(__file__), SIZE)
    table = {name: (Engine(name, name, {}, "truth"), None) for name in programs}
    return Plan([scene], table, list(budgets), seeds, 1)


def run(tmp_path, programs, **kinds):
    chosen = plan(programs, **kinds)
    journal = results.Journal(tmp_path / "rows.csv", CONDITIONS)
    Runner(chosen, journal, programs=programs, reference_pair=halves).run()
    return results.read(tmp_path / "rows.csv")[1]


def test_known_noise_comes_back_and_stops_at_the_truth(tmp_path):
    rows = run(tmp_path, {"good": good})
    assert len(rows) == 9
    for samples in (4, 16, 64):
        raw = report.mean_of([row for row in rows if row["samples"] == samples], "raw")
        assert raw == pytest.approx(expected_error(samples), rel=0.02)
    entries = report.compare(rows, "good", 16, {"ramp": SIZE[0] * SIZE[1]})
    assert entries[0].ratio.value == pytest.approx(1.0)
    assert entries[0].rate == pytest.approx(100 * SIZE[0] * SIZE[1] * 1e-6)


def test_one_percent_of_bias_is_called_biased(tmp_path):
    rows = run(tmp_path, {"good": good, "biased": biased})
    found = {engine: bias for _, engine, bias in report.biases(rows)}
    assert metric.is_biased(found["biased"])
    assert found["biased"].value == pytest.approx(0.01, abs=0.001)
    assert not metric.is_biased(found["good"])
    assert "BIASED" in report.bias_words(found["biased"])


def test_honest_noise_is_rarely_called_biased():
    pair = halves(None, None)
    called = [metric.is_biased(metric.bias_of(picture(1, seed), *pair)) for seed in range(200)]
    assert sum(called) == 0
    values = [metric.bias_of(picture(1, seed), *pair) for seed in range(200)]
    spread = np.std([bias.value for bias in values])
    assert np.mean([bias.error for bias in values]) == pytest.approx(spread, rel=0.15)


def test_crashes_and_nan_are_reported_and_stop_nothing(tmp_path):
    rows = run(tmp_path, {"broken": broken, "nan": not_a_number, "good": good})
    assert len([row for row in rows if row["engine"] == "good"]) == 9
    said = report.troubles(rows)
    assert any("ramp broken seed 1" in line and "ended with -6" in line for line in said)
    assert any("left out" in line for line in said)
    nan = [row for row in rows if row["engine"] == "nan"]
    assert len(nan) == 9
    assert all(row["nonfinite"] == 5 and row["raw"] > 100.0 for row in nan)
    assert any("ramp nan" in line and "5 pixels" in line for line in said)


def test_a_crash_is_followed_by_a_restart_for_what_is_missing(tmp_path):
    fragile = Fragile()
    rows = run(tmp_path, {"fragile": fragile}, seeds=2)
    assert fragile.asked[:2] == [[(4, 1), (16, 1), (64, 1)], [(64, 1)]]
    assert len(rows) == 6
    assert not report.troubles(rows)


def test_an_interrupted_run_goes_on(tmp_path):
    path = tmp_path / "rows.csv"
    asked = []

    def counted(scene, options, runs, threads, program=None):
        asked.extend(runs)
        if len(asked) > 6:
            raise KeyboardInterrupt
        yield from good(scene, options, runs, threads)

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, {"good": counted})
    assert len(results.read(path)[1]) == 6
    path.write_text(path.read_text()[:-10])  # the last line was not written to its end
    before = asked[:]
    asked.clear()
    rows = run(tmp_path, {"good": counted})
    assert before[:3] == [(4, 1), (16, 1), (64, 1)]
    assert asked == [(64, 2), (4, 3), (16, 3), (64, 3)]
    assert sorted((row["seed"], row["samples"]) for row in rows) == [
        (seed, samples) for seed in (1, 2, 3) for samples in (4, 16, 64)]


def test_other_conditions_begin_anew(tmp_path):
    run(tmp_path, {"good": good}, seeds=1)
    path = tmp_path / "rows.csv"
    more = {"conditions": {"threads": 2, "scenes": {"ramp": "key", "other": "key"}}}
    assert len(results.Journal(path, more).rows) == 3
    changed = {"conditions": {"threads": 2, "scenes": {"ramp": "another"}}}
    assert results.Journal(path, changed).rows == []
    run(tmp_path, {"good": good}, seeds=1)
    assert results.Journal(path, {"conditions": {"threads": 1}}).rows == []


def test_a_program_that_does_not_end_is_killed():
    began = time.monotonic()
    done = process.run([sys.executable, "-c", "import time; time.sleep(60)"], 0.5)
    assert time.monotonic() - began < 20.0
    assert done.code == -9
    with pytest.raises(EngineError, match=r"no end after 0\.5 s"):
        process.check(done, "sleeper")


def test_memory_and_words_of_a_program_are_known():
    words = "import sys; a = bytearray(200 << 20); print('out'); sys.stderr.write('err')"
    done = process.run([sys.executable, "-c", words], 60, dict(os.environ))
    assert done.code == 0
    assert done.out == "out\n"
    assert done.said == "out\nerr"
    assert 200 << 20 < done.peak_bytes < 400 << 20


def test_a_smaller_scene_is_the_middle_of_a_larger_one():
    larger = np.arange(8 * 8 * 3, dtype=float).reshape(8, 8, 3)
    smaller = references.from_larger(larger, (4, 3))
    assert smaller.shape == (3, 4, 3)
    assert smaller[0, 0] == pytest.approx(larger[1:3, 0:2].mean(axis=(0, 1)))
    assert smaller[2, 3] == pytest.approx(larger[5:7, 6:8].mean(axis=(0, 1)))
    with pytest.raises(ValueError, match="do not give"):
        references.from_larger(larger, (3, 3))


def test_cutouts_of_a_smaller_scene_show_the_same_place():
    larger = Scene("door", Path(__file__), (256, 256))
    smaller = Scene("door@128", Path(__file__), (128, 96), larger)
    for place, (x0, y0, x1, y1) in larger.cutouts().items():
        a0, b0, a1, b1 = smaller.cutouts()[place]
        assert (2 * a0, 2 * b0 + 32, 2 * a1, 2 * b1 + 32) == pytest.approx((x0, y0, x1, y1), abs=2)
