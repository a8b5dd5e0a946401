"""The thesis' comparisons: windows of frames, and tables that say what the rows hold."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmark"))

from harness import readme, results, slides, slides_page
from harness.engines import Shot

ROOT = Path(__file__).resolve().parents[2]
META = {"date": "1 May 2026", "command": "tests/benchmark/slides", "threads": 2, "seeds": 2,
        "machine": "A Processor", "versions": {"Pharos": "9.9"},
        "long_run": {"passes": 10000, "size": [16, 12], "nonfinite_pixels": 0,
                     "dropped_samples": 0, "mean": 0.5, "mean_of_others": 0.4, "bound": 0.02}}
# Error of every engine, relative to next-event estimation; halved by 64 frames of training.
SIZES = {"NEE and BSDF": 1.0, "position": 0.8, "position and normal": 0.5, "mixture": 0.25,
         "BSDF alone": 8.0, "guided without NEE": 2.0, "mixture without NEE": 1.0}


def small_rows():
    rows = []
    for engine, size in SIZES.items():
        for frames in (0, 4, 64):
            for seed in (1, 2):
                learned = 0.5 if frames == 64 and size < 8.0 and engine != "NEE and BSDF" else 1.0
                error = size * learned * (1.0 + 0.01 * seed)
                rows.append({"scene": "lamp@128", "engine": engine, "samples": 16,
                             "budget": frames, "seed": seed, "seconds": 0.8, "raw": 3 * error,
                             "trimmed": error, "cpu_per_vertex": 1e-6,
                             "cutouts": {"near the light": error, "glossy": 2 * error},
                             "stages": {"query_guiding_field": 0.1, "train": 0.05, "rest": 0.85}})
    return rows


def cells(title):
    for name, _, head, lines in slides_page.sections(META, small_rows()):
        if name == title:
            return head, lines
    raise AssertionError(title)


def test_a_window_is_what_its_frames_have_shown():
    random = np.random.default_rng(5)
    frames = random.random((12, 3, 4, 3))
    shots = [Shot(n, 1, 0.1 * n, frames[:n].mean(axis=0).astype(np.float32)) for n in (4, 12)]
    between = slides.difference(shots)
    pixels, seconds = between(4, 12)
    assert pixels == pytest.approx(frames[4:].mean(axis=0), abs=1e-5)
    assert seconds == pytest.approx(0.8)
    assert between(0, 12)[0] == pytest.approx(frames.mean(axis=0), abs=1e-6)


def test_training_is_a_column_a_number_of_frames():
    head, lines = cells("Error after N frames of training")
    assert head[3:] == ["after 0", "after 4", "after 64"]
    near = next(line for line in lines if line[1:3] == ["near the light", "position and normal"])
    assert [float(cell) for cell in near[3:]] == pytest.approx([0.5075, 0.5075, 0.25375], abs=1e-3)
    assert len(lines) == 2 * 4  # one of the two cutouts of light is there, and the whole picture


def test_gains_are_of_the_second_over_the_first():
    _, lines = cells("Position alone against position and normal")
    assert [cell.split()[0] for cell in lines[0][1:]] == ["1.60x", "1.60x"]
    _, lines = cells("Without next-event estimation: guided against plain path tracing")
    assert [cell.split()[0] for cell in lines[0][1:]] == ["4.00x", "8.00x", "8.00x", "16.00x"]
    _, lines = cells("A glossy surface, where one lobe fails")
    assert [cell.split()[0] for cell in lines[0][1:]][-2:] == ["2.00x", "2.00x"]


def test_costs_are_of_a_vertex_and_a_frame():
    head, lines = cells("What it costs")
    assert head[2:] == ["ns a vertex", "ms a frame", "% asking", "% learning"]
    assert lines[0][2:] == ["1000", "50.0", "10.0", "5.0"]


def test_page_and_readme_are_made(tmp_path):
    (tmp_path / "position.png").write_bytes(b"picture")
    page = slides_page.make(META, small_rows(), tmp_path)
    assert page.count("<svg viewBox") == 1
    assert "The artefact at edges" in page
    assert "10000 passes of one lobe at 16 x 12 pixels: 0 pixels are not finite" in page
    part = slides_page.readme_section(META, small_rows())
    assert part.startswith(slides_page.BEGIN)
    assert "| lamp under its shade | 2.50x" in part
    assert "the mean is 1.250 +- 0.050 of" in " ".join(part.split())


def test_readme_is_what_the_published_csv_gives():
    path = ROOT / "tests/benchmark/results/slides.csv"
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    part = readme.between(text, slides_page.BEGIN, slides_page.END)[1]
    assert part == slides_page.readme_section(*results.read(path))
