"""The page and the README's section say what the CSV holds, losses beside wins."""

import re
import sys
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmark"))

from harness import page, png, readme, report, results, svg

ROOT = Path(__file__).resolve().parents[2]
META = {"date": "1 May 2026", "command": "tests/benchmark/run --scenes door,glass", "threads": 2,
        "machine": "A Processor, 2 cores", "versions": {"Pharos": "9.9 (abc)", "bpy": "4.5.0"},
        "seeds": 3, "baseline": "pharos-off", "at": [64, 16],
        "sizes": {"door@128": [128, 96], "glass@128": [128, 96]},
        "accuracy": {"door@128": {"mean": 0.0012, "error": 0.0002, "block": 0.004}}}
# Error of one sample, and seconds of one: the guide wins behind the door, and loses in glass.
SIZES = {("door@128", "pharos-off"): (4.0, 0.01), ("door@128", "pharos"): (1.0, 0.02),
         ("door@128", "cycles"): (5.0, 0.01), ("glass@128", "pharos-off"): (1.0, 0.01),
         ("glass@128", "pharos"): (1.0, 0.0125), ("glass@128", "cycles"): (0.5, 0.01)}


def small_rows():
    rows = []
    for (scene, engine), (error, cost) in SIZES.items():
        for seed in (1, 2, 3):
            for samples in (16, 64):
                value = error / samples * (1.0 + 0.01 * seed)
                rows.append({"scene": scene, "engine": engine, "samples": samples,
                             "budget": samples, "seed": seed, "seconds": cost * samples,
                             "raw": 2 * value, "trimmed": value, "bias": 0.0001 * seed,
                             "bias_error": 0.0005, "bias_reference_error": 0.0001, "nonfinite": 0,
                             "cutouts": {"a place": 3 * value},
                             "stages": {"intersect": 0.3, "shade": 0.1}})
    rows.append({"scene": "door@128", "engine": "cycles", "seed": 4, "trouble": "it <broke>"})
    return rows


class Tags(HTMLParser):
    """Checks that tags nest; collects what is loaded and what is written."""

    ALONE = frozenset(("meta", "img", "br"))

    def __init__(self):
        super().__init__()
        self.open, self.loads, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        self.loads += [value for name, value in attrs if name in ("src", "href")]
        if tag not in self.ALONE:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.loads += [value for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def read_page(text):
    tags = Tags()
    tags.feed(text)
    assert not tags.open
    return tags, " ".join(" ".join(tags.text).split())


def test_rows_survive_the_file(tmp_path):
    path = tmp_path / "rows.csv"
    results.write(path, META, small_rows())
    meta, rows = results.read(path)
    assert meta == META
    for got, wrote in zip(rows, small_rows(), strict=True):
        for key, value in wrote.items():
            if isinstance(value, float):
                assert abs(got[key] - value) <= 1e-5 * abs(value)
            elif isinstance(value, dict):
                assert list(got[key]) == list(value)
            else:
                assert got[key] == value


def test_page_is_one_file_with_curves_losses_and_troubles(tmp_path):
    crop = png.encode(np.full((4, 6, 3), 128, np.uint8))
    (tmp_path / "door@128").mkdir()
    for name in ("reference", "pharos"):
        (tmp_path / "door@128" / f"a place.{name}.png").write_bytes(crop)
    text = page.make(META, small_rows(), tmp_path)
    tags, words = read_page(text)
    assert all(load.startswith("data:image/png;base64,") for load in tags.loads)
    assert len(tags.loads) == 2
    assert "<script" not in text
    assert text.count("<polyline") == 12  # six engines' curves, over time and over samples
    assert "door@128 0.64 s 2.00x" in words
    assert "glass@128: 0.40x [0.39, 0.41] against cycles" in words
    assert "glass@128: 0.80x" in words
    assert "it <broke>" in words
    assert "+0.120 %" in words
    assert "1 May 2026" in words
    assert "a place, 64 samples" in words
    assert "intersect 75 %" in words


def test_page_without_crops_shows_their_errors():
    _, words = read_page(page.make(META, small_rows()))
    assert f"{3 * 4 / 64 * 1.02:.3g}" in words


def test_curves_stand_where_their_values_are():
    points = {"one": [svg.Point(1.0, 1.0, 0.5, 2.0), svg.Point(100.0, 0.01, 0.01, 0.01)]}
    text = svg.chart(points, "x", "y", {"one": "#000"})
    first, last = re.search(r'points="([\d.]+,[\d.]+) ([\d.]+,[\d.]+)"', text).groups()
    left, right = (tuple(float(v) for v in place.split(",")) for place in (first, last))
    assert left[0] < right[0]
    assert left[1] < right[1]  # a smaller error is lower
    assert "is zero" in svg.chart({"one": [svg.Point(1.0, 0.0, 0.0, 0.0)]}, "x", "y", {})


def test_readme_section_tells_wins_and_losses():
    text = readme.section(META, small_rows())
    assert text.startswith(readme.BEGIN)
    assert text.endswith(readme.END)
    joined = " ".join(text.split())
    assert re.search(r"\| door ajar \| \*\*2\.0x\*\* \[", joined)
    assert "Losses at 64 samples: against Cycles, glass 0.40x [0.39, 0.41]" in joined
    assert "against Pharos without its network, glass 0.80x" in joined
    assert "1 May 2026: A Processor, 2 cores, 2 threads; Pharos 9.9 (abc), bpy 4.5.0" in joined
    assert META["command"] in joined
    assert all(len(line) <= 110 or line.startswith("|") for line in text.splitlines())


def test_readme_is_replaced_between_its_marks_only():
    text = f"before\n{readme.BEGIN}\nold\n{readme.END}\nafter\n"
    assert readme.replaced(text, "new") == "before\nnew\nafter\n"


def test_readme_is_what_the_published_csv_gives():
    path = ROOT / "tests/benchmark/results/benchmark.csv"
    assert path.stat().st_size < 200_000
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert readme.between(text, readme.BEGIN, readme.END)[1] == readme.section(*results.read(path))


def test_references_that_are_too_noisy_are_named():
    rows = [{"scene": "s", "engine": "e", "samples": 4, "trimmed": 0.1, "reference_noise": noise}
            for noise in (0.001, 0.02)]
    assert report.noisy_references(rows[:1]) == []
    assert len(report.noisy_references(rows[1:])) == 1


def test_png_holds_the_picture_top_row_first():
    pixels = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    data = png.encode(pixels)
    start = data.index(b"IDAT") + 4
    rows = zlib.decompress(data[start:data.index(b"IEND") - 8])
    assert rows == b"\0" + pixels[1].tobytes() + b"\0" + pixels[0].tobytes()
    shown = png.to_srgb(np.array([[[0.0, 0.5, np.nan], [1.0, 0.2, 5.0]]]))
    assert shown[0, 0].tolist() == [255, 0, 255]
    assert shown[0, 1].tolist() == [255, 124, 255]
