"""One self-contained HTML page from measured rows: curves, crops, costs, losses beside wins."""

import math
from html import escape

import numpy as np

from harness import metric, report, svg
from harness.markup import Html, about, crops, document, listed, paragraph, table


def _point(rows, kind):
    """Mean error of one budget with its 95 % interval over seeds."""
    errors = [row[kind] for row in rows]
    mean = float(np.mean(errors))
    ratio = metric.error_ratio(errors, [1.0] * len(errors)) if mean > 0.0 else None
    known = ratio is not None and not math.isnan(ratio.low)
    return mean, ratio.low if known else mean, ratio.high if known else mean


def _curves(rows, engines, of_x):
    curves = {}
    for engine in engines:
        mine = [row for row in rows if row["engine"] == engine]
        points = []
        for budget in sorted({row["budget"] for row in mine}):
            group = [row for row in mine if row["budget"] == budget]
            points.append(svg.Point(float(np.mean([row[of_x] for row in group])),
                                    *_point(group, "trimmed")))
        curves[engine] = sorted(points, key=lambda p: p.x)
    return curves


def _ratio_cell(ratio):
    kind = "win" if ratio.low > 1.0 else "loss" if ratio.high < 1.0 else ""
    return Html(f'<span class="{kind}">{escape(report.ratio_words(ratio))}</span>')


def _overview(rows, meta, samples):
    """Ratios of all engines on all scenes at one time."""
    baseline = meta["baseline"]
    entries = report.compare(rows, baseline, samples, {})
    engines = [name for name in report.names(rows, "engine") if name != baseline]
    found = {(e.scene, e.engine): e for e in entries}
    lines = []
    for scene in report.names(rows, "scene"):
        base = found.get((scene, baseline))
        if base:
            cells = [found.get((scene, engine)) for engine in engines]
            lines.append([scene, f"{base.seconds:.2f} s",
                          *(_ratio_cell(e.ratio) if e else "" for e in cells)])
    means = report.geometric_means(entries, baseline)
    lines.append(["geometric mean", "", *(f"{means[e]:.2f}x" if e in means else ""
                                          for e in engines)])
    behind = [f"{r.scene}: {report.ratio_words(r.ratio)} against {r.rival}"
              + ("" if r.ratio.high < 1.0 else ", within the noise")
              for r in report.losses(rows, baseline, samples)]
    return [f"<h3>At the time {escape(baseline)} takes for {samples} samples a pixel</h3>",
            paragraph(f"How many times less error than {baseline}; in brackets the 95 % interval "
                      "over seeds."),
            table(["scene", "time", *engines], lines),
            paragraph("Where Pharos has more error than another engine:") + listed(behind)
            if behind else paragraph("Pharos has the least error on every scene."),
            paragraph(report.interval_words(entries, baseline), "note")]


def _mean_cell(rows, column, scale, digits):
    mean = report.mean_of(rows, column)
    return "" if math.isnan(mean) else f"{scale * mean:.{digits}f}"


def _costs(rows, engines):
    """What a render needs beside the samples."""
    columns = (("startup", 1, 2), ("export", 1, 2), ("build", 1, 3), ("memory", 1, 0),
               ("vertices", 1, 2), ("rays", 1, 2), ("cpu_per_vertex", 1e9, 0),
               ("guided_share", 100, 0))
    lines = []
    for engine in engines:
        mine = [row for row in rows if row["engine"] == engine]
        counts = [sum(row.get(column, 0) for row in mine) for column in ("nonfinite", "dropped")]
        lines.append([engine, *(_mean_cell(mine, *column) for column in columns),
                      *(str(count) for count in counts)])
    head = ["", "start-up s", "export s", "build s", "peak MiB", "vertices", "rays",
            "ns a vertex", "% guided", "non-finite", "dropped"]
    return table(head, lines)


def _stages(rows, engines):
    """Shares of the stages, for engines that tell."""
    parts = []
    for engine in engines:
        told = [row["stages"] for row in rows if row["engine"] == engine and "stages" in row]
        if told:
            names = list(dict.fromkeys(name for row in told for name in row))
            mean = {name: float(np.mean([row.get(name, 0.0) for row in told])) for name in names}
            largest = sorted(names, key=lambda name: -mean[name])[:6]
            shown = {name: mean[name] for name in largest}
            shown["others"] = sum(mean.values()) - sum(shown.values())
            total = sum(mean.values()) or 1.0
            colours = svg.colours_of(shown)
            labels = {f"{name} {100 * value / total:.0f} %": colours[name]
                      for name, value in shown.items()}
            parts += [paragraph(f"{engine}: {total:.2f} seconds of its threads in stages", "note"),
                      svg.bar(shown, colours), svg.legend(labels)]
    return parts


def _cutouts(rows, scene, engines, budget, folder):
    """Errors of each named cutout, and its picture where one was kept."""
    shown = min((row["budget"] for row in rows), key=lambda n: abs(math.log(n / budget)))
    at_top = [row for row in rows if row["budget"] == shown and "cutouts" in row]
    parts = []
    for place in dict.fromkeys(name for row in at_top for name in row["cutouts"]):
        errors = {engine: float(np.mean([row["cutouts"][place] for row in at_top
                                         if row["engine"] == engine]))
                  for engine in engines if any(row["engine"] == engine for row in at_top)}
        pictures = []
        for engine in ("reference", *errors):
            path = folder / scene / f"{place}.{engine}.png" if folder else None
            if path and path.exists():
                caption = engine if engine == "reference" else f"{engine}: {errors[engine]:.3g}"
                pictures.append((caption, path.read_bytes()))
        parts.append(f"<h3>{escape(place)}, {shown} samples</h3>")
        parts.append(crops(pictures) if pictures else
                     table(list(errors), [[f"{error:.3g}" for error in errors.values()]]))
    return parts


def _scene(rows, scene, colours, budget, folder):
    mine = [row for row in rows if row["scene"] == scene]
    here = [engine for engine in colours if any(row["engine"] == engine for row in mine)]
    charts = [svg.chart(_curves(mine, here, column), title, "trimmed relMSE", colours)
              for column, title in (("seconds", "CPU seconds / threads"),
                                    ("samples", "samples a pixel"))]
    return [f'<h2 id="{escape(scene)}">{escape(scene)}</h2>',
            svg.legend({engine: colours[engine] for engine in here}),
            f'<div class="charts">{"".join(charts)}</div>',
            *_cutouts(mine, scene, here, budget, folder), "<h3>Costs</h3>", _costs(mine, here),
            *_stages(mine, here)]


def _accuracy(meta):
    """References of two engines against each other."""
    found = meta.get("accuracy", {})
    if not found:
        return []
    lines = [[scene, f"{100 * entry['mean']:+.3f} %", f"{196 * entry['error']:.3f} %",
              f"{100 * entry['block']:.2f} %"] for scene, entry in found.items()]
    return ["<h2>Do the engines render the same picture?</h2>",
            paragraph("The reference of Pharos against that of Cycles: difference of the mean, its "
                      "95 % bound by the noise of both, and the middle of the differences of "
                      "blocks of 8 x 8 pixels, noise included."),
            table(["scene", "mean", "+-", "blocks"], lines)]


def _health(rows):
    """What went wrong, and who is biased."""
    wrong = report.troubles(rows)
    lines = [[scene, engine, report.bias_words(bias)]
             for scene, engine, bias in report.biases(rows)]
    noisy = report.noisy_references(rows)
    return ["<h2>What went wrong</h2>",
            listed(wrong) if wrong else paragraph("Nothing: every engine gave every picture, and "
                                                  "no pixel is not a finite number."),
            paragraph("Errors that are less than ten times the noise of their reference (it "
                      "cancels from the error, but widens the interval):") + listed(noisy)
            if noisy else "",
            paragraph("The mean of the pictures against the reference, at the largest budget:")
            + table(["scene", "engine", "bias"], lines) if lines else ""]


def make(meta, rows, crop_folder=None):
    """The page as text."""
    good = [row for row in rows if "trimmed" in row]
    colours = svg.colours_of(report.names(good, "engine"))
    parts = [about(meta),
             paragraph("Error is relMSE, the mean of (I-R)²/(R²+0.01), without the worst 0.1 % of "
                       "pixels; each engine is measured against a reference of its own. Time is "
                       "CPU time of rendering divided by threads, building the scene included. "
                       "All engines: twelve bounces, caustics, box filter, no clamping, no "
                       "denoiser, no adaptive sampling. Bars are 95 % intervals over seeds."),
             "<h2>Equal time</h2>"]
    for samples in meta["at"]:
        parts += _overview(good, meta, samples)
    for scene in report.names(good, "scene"):
        parts += _scene(good, scene, colours, meta["at"][0], crop_folder)
    parts += _accuracy(meta) + _health(rows)
    return document("Pharos: error over time", parts)
