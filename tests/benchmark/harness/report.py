"""From measured rows to comparisons at equal time, in words and tables.

Rows are those of results.py; `sizes` maps a scene's name to its number of pixels.
"""

import math
from dataclasses import dataclass

import numpy as np

from harness import metric

OURS = "pharos"
UNKNOWN = 10.0  # an interval that reaches so many times beyond its value says nothing


@dataclass(frozen=True)
class Entry:
    """One engine on one scene at the time the baseline takes for `samples` samples."""

    scene: str
    engine: str
    samples: int
    seconds: float
    rate: float  # million samples a second, start-up left out
    raw: float
    trimmed: float
    ratio: metric.Ratio  # the baseline's trimmed error over this one's


@dataclass(frozen=True)
class Rivalry:
    """How many times less error we have than a rival at that time."""

    scene: str
    rival: str
    samples: int
    ratio: metric.Ratio


def of(rows, scene, engine):
    return [row for row in rows if row["scene"] == scene and row["engine"] == engine
            and "trimmed" in row]


def names(rows, column):
    """In the order in which they first came."""
    return list(dict.fromkeys(row[column] for row in rows if "trimmed" in row))


def _budget(row):
    return row.get("budget", row["samples"])


def times(rows):
    """Budget -> mean seconds over the seeds."""
    budgets = sorted({_budget(row) for row in rows})
    return {n: float(np.mean([row["seconds"] for row in rows if _budget(row) == n]))
            for n in budgets}


def errors_at_time(rows, seconds, kind):
    """One error for each seed at that time; the time of a budget is its mean over the seeds."""
    mean_times, errors = times(rows), []
    for seed in sorted({row["seed"] for row in rows}):
        found = {_budget(row): row[kind] for row in rows if row["seed"] == seed}
        errors.append(metric.error_at(seconds, [mean_times[n] for n in found],
                                      list(found.values())))
    return errors


def time_of(rows, samples):
    """Mean seconds of a budget; from the nearest one where it was not measured."""
    mean_times = times(rows)
    nearest = min(mean_times, key=lambda n: abs(math.log(n / samples)))
    return mean_times[nearest] * samples / nearest


def entry(rows, base, samples, pixels):
    """Rows of one scene and engine against those of the baseline."""
    seconds = time_of(base, samples)
    trimmed = errors_at_time(rows, seconds, "trimmed")
    rate = metric.slope_rate([row["samples"] for row in rows], [row["seconds"] for row in rows])
    ratio = metric.error_ratio(errors_at_time(base, seconds, "trimmed"), trimmed)
    return Entry(rows[0]["scene"], rows[0]["engine"], samples, seconds, rate * pixels * 1e-6,
                 float(np.mean(errors_at_time(rows, seconds, "raw"))), float(np.mean(trimmed)),
                 ratio)


def compare(rows, baseline, samples, sizes):
    """Entries of all scenes and engines."""
    entries = []
    for scene in names(rows, "scene"):
        base = of(rows, scene, baseline)
        for engine in names(rows, "engine") if base else ():
            mine = of(rows, scene, engine)
            if mine:
                entries.append(entry(mine, base, samples, sizes.get(scene, 0)))
    return entries


def rivalries(rows, baseline, samples):
    """Us against every other engine on every scene, at the baseline's time."""
    found = []
    for scene in names(rows, "scene"):
        base, ours = of(rows, scene, baseline), of(rows, scene, OURS)
        for engine in names(rows, "engine") if base and ours else ():
            theirs = of(rows, scene, engine)
            if engine != OURS and theirs:
                seconds = time_of(base, samples)
                ratio = metric.error_ratio(*(errors_at_time(side, seconds, "trimmed")
                                             for side in (theirs, ours)))
                found.append(Rivalry(scene, engine, samples, ratio))
    return found


def losses(rows, baseline, samples):
    """Where we are behind, the worst first."""
    behind = [r for r in rivalries(rows, baseline, samples) if r.ratio.value < 1.0]
    return sorted(behind, key=lambda r: r.ratio.value)


def geometric_means(entries, baseline):
    """Engine -> mean ratio over the scenes."""
    by_engine = {}
    for e in entries:
        if e.engine != baseline:
            by_engine.setdefault(e.engine, []).append(math.log(e.ratio.value))
    return {engine: math.exp(np.mean(logs)) for engine, logs in by_engine.items()}


def ratio_words(ratio):
    interval = "" if math.isnan(ratio.low) else f" [{ratio.low:.2f}, {ratio.high:.2f}]"
    if ratio.high > UNKNOWN * ratio.value:
        interval = " [unknown]"
    return f"{ratio.value:.2f}x{interval}"


def interval_words(entries, baseline, bar=0.1):
    """Whether the intervals of the equal-time ratios are as narrow as wanted."""
    wide = [f"{e.scene} {e.engine} {ratio_words(e.ratio)}" for e in entries
            if e.engine != baseline and not math.isnan(e.ratio.low)
            and max(e.ratio.high / e.ratio.value, e.ratio.value / e.ratio.low) > 1.0 + bar]
    total = sum(e.engine != baseline for e in entries)
    if not wide:
        return f"All {total} intervals are within +-{100 * bar:.0f} %."
    return (f"{total - len(wide)} of {total} intervals are within +-{100 * bar:.0f} %; "
            f"wider are: {'; '.join(wide)}.")


def table(entries, baseline):
    """Lines of one table in Markdown."""
    samples = entries[0].samples if entries else 0
    lines = [f"Error at the time {baseline} takes for {samples} samples a pixel "
             "(raw / trimmed relMSE; ratio: how many times less trimmed error than it)", "",
             "| scene | engine | Msamples/s | raw | trimmed | ratio [95 %] |",
             "|---|---|---|---|---|---|"]
    before = None
    for e in entries:
        title = f"{e.scene} ({e.seconds:.2f} s)" if e.scene != before else ""
        before = e.scene
        lines.append(f"| {title} | {e.engine} | {e.rate:.2f} | {e.raw:.4g} | {e.trimmed:.4g} "
                     f"| {ratio_words(e.ratio) if e.engine != baseline else '1'} |")
    means = ", ".join(f"{engine} {mean:.2f}x"
                      for engine, mean in geometric_means(entries, baseline).items())
    return [*lines, "", f"Geometric mean over these scenes: {means}"]


def mean_of(rows, column):
    """Over the rows that have it; nan where none does."""
    values = [row[column] for row in rows if column in row]
    return float(np.mean(values)) if values else math.nan


def biases(rows):
    """(scene, engine, mean bias of the largest budget) of all that were measured for it."""
    found = []
    for scene in names(rows, "scene"):
        for engine in names(rows, "engine"):
            mine = [row for row in of(rows, scene, engine) if "bias" in row]
            if mine:
                top = max(_budget(row) for row in mine)
                found.append((scene, engine, metric.mean_bias(
                    [metric.Bias(row["bias"], row["bias_error"], row["bias_reference_error"])
                     for row in mine if _budget(row) == top])))
    return found


def bias_words(bias):
    sure = abs(bias.value) + 1.96 * bias.error
    return (f"mean {100 * bias.value:+.2f} % +- {196 * bias.error:.2f} %, "
            + ("BIASED" if metric.is_biased(bias) else f"bias under {100 * sure:.2f} %"))


def troubles(rows):
    """Lines about what went wrong."""
    return [f"{row['scene']} {row['engine']} seed {row['seed']}: {row['trouble']}"
            for row in rows if "trouble" in row]


def noisy_references(rows, factor=10.0):
    """Scenes whose smallest error is not well above the noise of the reference it is taken with."""
    lines = []
    for scene in names(rows, "scene"):
        for engine in names(rows, "engine"):
            mine = [row for row in of(rows, scene, engine) if "reference_noise" in row]
            least = min(mine, key=lambda row: row["trimmed"], default=None)
            if least and least["trimmed"] < factor * least["reference_noise"]:
                lines.append(f"{scene} {engine}: error {least['trimmed']:.3g} at "
                             f"{_budget(least)} samples, noise of the reference "
                             f"{least['reference_noise']:.3g}")
    return lines


def work_lines(rows):
    """Counters of engines that have them: a high rate may come from short paths."""
    lines = ["| scene | engine | vertices/sample | rays/sample | ns/vertex |",
             "|---|---|---|---|---|"]
    for scene in names(rows, "scene"):
        for engine in names(rows, "engine"):
            mine = [row for row in of(rows, scene, engine) if row.get("vertices")]
            if mine:
                lines.append(f"| {scene} | {engine} | {mean_of(mine, 'vertices'):.2f} "
                             f"| {mean_of(mine, 'rays'):.2f} "
                             f"| {1e9 * mean_of(mine, 'cpu_per_vertex'):.0f} |")
    return lines if len(lines) > 2 else []
