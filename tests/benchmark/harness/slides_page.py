"""Tables and page of the thesis' comparisons, from the rows that slides.py measures.

A row's budget is the number of frames of training before the 16 frames that were looked at.
"""

import math

import numpy as np

from harness import metric, readme, report, svg
from harness.markup import about, crops, document, listed, paragraph, table
from harness.report import mean_of, ratio_words

PLAIN, NEE, ONE, POSITION, MIXTURE = ("BSDF alone", "NEE and BSDF", "position and normal",
                                      "position", "mixture")
LIT_PLACES = ("near the light", "far from it")
TRAINED = 64
BEGIN = "<!-- slides: made by tests/benchmark/slides --publish -->"
END = "<!-- end of slides -->"


def _errors(rows, scene, engine, frames, measure="trimmed"):
    """One error a seed: of the whole picture (raw, trimmed), or of a cutout of that name."""
    mine = [row for row in report.of(rows, scene, engine) if row["budget"] == frames]
    return [row[measure] if measure in row else row["cutouts"][measure] for row in mine]


def _gain(rows, scene, engines, frames, measure):
    """How many times less error the second engine has than the first; None where not measured."""
    sides = [_errors(rows, scene, engine, frames, measure) for engine in engines]
    return metric.error_ratio(*sides) if all(sides) and min(map(np.mean, sides)) > 0 else None


def _words(ratio):
    return ratio_words(ratio) if ratio else ""


def _places(rows, scene, wanted):
    known = next((row["cutouts"] for row in rows if row["scene"] == scene and "cutouts" in row), {})
    return [place for place in wanted if place in known]


def training(rows):
    """Error of the frames after N frames of training, near the light and far from it."""
    lines = []
    for scene in report.names(rows, "scene"):
        frames = sorted({row["budget"] for row in report.of(rows, scene, ONE)})
        for place in [*_places(rows, scene, LIT_PLACES), "trimmed"] if len(frames) > 2 else ():
            for engine in (NEE, POSITION, ONE, MIXTURE):
                means = [np.mean(_errors(rows, scene, engine, n, place) or [math.nan])
                         for n in frames]
                title = "all" if place == "trimmed" else place
                lines.append([scene, title, engine, *(f"{mean:.3g}" for mean in means)])
    frames = sorted({row["budget"] for row in rows if row["engine"] == ONE})
    return ["scene", "cutout", "guide", *(f"after {n}" for n in frames)], lines


def pairs(rows, columns, measure):
    """Gains of one over another, at 16 samples from the first frame on and after training."""
    lines = []
    for scene in report.names(rows, "scene"):
        if measure in ("raw", "trimmed") or _places(rows, scene, (measure,)):
            cells = [_words(_gain(rows, scene, engines, frames, measure))
                     for engines in columns.values() for frames in (0, TRAINED)]
            if any(cells):
                lines.append([scene, *cells])
    return ["scene", *(f"{title}, {when}" for title in columns
                       for when in ("learning", "trained"))], lines


def costs(rows):
    """CPU time of a vertex and of a frame, and the parts of the network in it."""
    lines = []
    for scene in report.names(rows, "scene"):
        for engine in (NEE, POSITION, ONE, MIXTURE):
            mine = [row for row in report.of(rows, scene, engine) if "stages" in row]
            if not mine:
                continue
            total = sum(sum(row["stages"].values()) for row in mine)
            parts = [100 * sum(row["stages"].get(stage, 0.0) for row in mine) / total
                     for stage in ("query_guiding_field", "train")]
            frame = 1e3 * mean_of(report.of(rows, scene, engine), "seconds") / 16
            lines.append([scene, engine, f"{1e9 * mean_of(mine, 'cpu_per_vertex'):.0f}",
                          f"{frame:.1f}", *(f"{part:.1f}" for part in parts)])
    return ["scene", "guide", "ns a vertex", "ms a frame", "% asking", "% learning"], lines


COMPARISONS = (
    ("Position alone against position and normal",
     {"with the normal": (POSITION, ONE)}, "trimmed",
     "How many times less error the normal gives, at 16 samples a pixel. Learning: the first 16 "
     f"frames; trained: the 16 after {TRAINED} frames."),
    ("Without next-event estimation: guided against plain path tracing",
     {"one lobe": (PLAIN, "guided without NEE"), "mixture": (PLAIN, "mixture without NEE")},
     "raw", "How many times less error than BSDF sampling alone, at 16 samples a pixel. Raw error: "
     "nearly all of it is in few pixels, as light is found by chance."),
    ("Guided against next-event estimation and BSDF sampling",
     {"one lobe": (NEE, ONE), "mixture": (NEE, MIXTURE)}, "trimmed",
     "All with next-event estimation, at 16 samples a pixel."),
    ("One lobe without next-event estimation against NEE and BSDF sampling",
     {"one lobe": (NEE, "guided without NEE")}, "raw",
     "Can the guide stand in for next-event estimation? Below 1x it cannot. Raw error."),
    ("One lobe against a mixture", {"mixture": (ONE, MIXTURE)}, "trimmed",
     "How many times less error eight lobes have than one, with the same loss."),
    ("A glossy surface, where one lobe fails",
     {"one lobe": (NEE, ONE), "mixture": (NEE, MIXTURE), "mixture over lobe": (ONE, MIXTURE)},
     "glossy", "Light comes from several sides onto glossy metal: error against next-event "
     "estimation and BSDF sampling in the cutout of a steel ball."),
)


def sections(meta, rows):
    """(title, note, head, lines) of every comparison."""
    rows = [row for row in rows if "trimmed" in row]
    yield ("Error after N frames of training",
           "Trimmed relMSE of 16 samples a pixel taken after so many frames of one sample.",
           *training(rows))
    for title, columns, measure, note in COMPARISONS:
        yield (title, note, *pairs(rows, columns, measure))
    yield ("What it costs", "CPU time of a vertex and of a frame of 128 x 96 pixels, both threads "
           "of it; shares of the threads' time.", *costs(rows))


def long_words(meta):
    """What the very long render showed."""
    run = meta.get("long_run")
    if not run:
        return ""
    width, height = run["size"]
    ratio, bound = (run[name] / run["mean_of_others"] for name in ("mean", "bound"))
    return (f"{run['passes']} passes of one lobe at {width} x {height} pixels: "
            f"{run['nonfinite_pixels']} pixels are not finite, {run['dropped_samples']} samples "
            f"were dropped; the mean is {ratio:.3f} +- {bound:.3f} of that of the default's "
            "render.")


def _markdown(head, lines):
    return ["| " + " | ".join(head) + " |", "|---" * len(head) + "|",
            *("| " + " | ".join(line) + " |" for line in lines)]


def text(meta, rows):
    """All tables as lines."""
    out = []
    for title, note, head, lines in sections(meta, rows):
        out += [f"## {title}", note, "", *_markdown(head, lines), ""]
    return [*out, long_words(meta), *report.troubles(rows)]


def readme_section(meta, rows):
    """The README's part about the thesis' model, with its marks."""
    rows = [row for row in rows if "trimmed" in row]
    columns = {"by position": (NEE, POSITION), "by position and normal": (NEE, ONE),
               "eight lobes": (NEE, MIXTURE), "one lobe, no NEE": (PLAIN, "guided without NEE")}
    kinds = ("trimmed", "trimmed", "trimmed", "raw")
    lines = []
    for scene in report.names(rows, "scene"):
        cells = [_words(_gain(rows, scene, pair, TRAINED, kind))
                 for pair, kind in zip(columns.values(), kinds, strict=True)]
        lines.append([readme.scene_title(scene), *cells])
    words = readme.wrapped(
        "The thesis' own model, one lobe with its loss, as `guiding` `SLIDES`: how many times less "
        f"error 16 samples a pixel have after {TRAINED} frames of training, than without guiding "
        "at equal samples; in the last column both without next-event estimation, and all pixels "
        f"counted. In brackets the 95 % interval over {meta['seeds']} seeds.")
    ending = f"{long_words(meta)} Learning curves, costs and the artefact at edges are on the page."
    return "\n".join([BEGIN, *words, "", *_markdown(["scene", *columns], lines), "",
                      *readme.wrapped(ending.strip()), "", "```",
                      *readme.command_lines(meta["command"]), "```", END])


def _charts(rows):
    """Learning curves of the cutouts."""
    parts = []
    for scene in report.names(rows, "scene"):
        frames = sorted({row["budget"] for row in report.of(rows, scene, ONE)})
        if len(frames) < 3:
            continue
        colours = svg.colours_of((NEE, POSITION, ONE, MIXTURE))
        charts = []
        for place in _places(rows, scene, LIT_PLACES):
            curves = {}
            for engine in colours:
                curves[engine] = [svg.Point(n + 1, mean, mean, mean) for n in frames if (
                    mean := float(np.mean(_errors(rows, scene, engine, n, place) or [0.0]))) > 0]
            charts.append(svg.chart(curves, f"{place}: frames of training + 1", "relMSE", colours))
        parts += [f"<h3>{scene}</h3>", svg.legend(colours),
                  f'<div class="charts">{"".join(charts)}</div>']
    return parts


def _edges(folder):
    """Crops across edges, where position alone cannot tell one face from the other."""
    shown = []
    for name in ("reference", POSITION, ONE, f"{POSITION} direction", f"{ONE} direction"):
        path = folder / f"{name}.png"
        if path.exists():
            shown.append((name, path.read_bytes()))
    note = ("Above an edge two faces meet whose light comes from different sides. Position alone "
            "gives both one answer, which bleeds over the edge; the normal tells them apart. The "
            "directions are the means of what the network believes, as colours.")
    return ["<h2>The artefact at edges</h2>", paragraph(note), crops(shown)] if shown else []


def make(meta, rows, crop_folder):
    """The page as text."""
    good = [row for row in rows if "trimmed" in row]
    parts = [about(meta), paragraph("The comparisons of \"Real Time Neural Path Guiding\" (Wüst "
                                    "2023), with its model as Pharos has it: one lobe, its "
                                    "activations and loss, half of the directions by the guide.")]
    for number, (title, note, head, lines) in enumerate(sections(meta, rows)):
        parts += [f"<h2>{title}</h2>", paragraph(note, "note"), table(head, lines)]
        if number == 0:
            parts += _charts(good)
    parts += _edges(crop_folder)
    if meta.get("long_run"):
        parts += ["<h2>A very long render</h2>", paragraph(long_words(meta))]
    wrong = report.troubles(rows)
    if wrong:
        parts += ["<h2>What went wrong</h2>", listed(wrong)]
    return document("Pharos: the thesis' comparisons", parts)
