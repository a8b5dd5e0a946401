"""From measured rows to a CSV file and one table."""

import csv
import math

import numpy as np

from harness import metric

COLUMNS = ("scene", "engine", "samples", "seed", "seconds", "raw", "trimmed", "vertices", "rays")


def write_csv(rows, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def _of(rows, scene, engine):
    return [row for row in rows if row["scene"] == scene and row["engine"] == engine]


def errors_at_time(rows, seconds, kind):
    """One error for each seed at that time; the time of a budget is its mean over the seeds."""
    budgets = sorted({row["samples"] for row in rows})
    times = [np.mean([row["seconds"] for row in rows if row["samples"] == n]) for n in budgets]
    errors = []
    for seed in sorted({row["seed"] for row in rows}):
        by_budget = {row["samples"]: row[kind] for row in rows if row["seed"] == seed}
        errors.append(metric.error_at(seconds, times, [by_budget[n] for n in budgets]))
    return errors


def time_of(rows, samples):
    """Mean seconds of a budget; the nearest one where it was not measured."""
    nearest = min({row["samples"] for row in rows}, key=lambda n: abs(math.log(n / samples)))
    mean = np.mean([row["seconds"] for row in rows if row["samples"] == nearest])
    return float(mean) * samples / nearest


def _cell(ratio):
    interval = "" if math.isnan(ratio.low) else f" [{ratio.low:.2f}, {ratio.high:.2f}]"
    return f"{ratio.value:.2f}x{interval}"


def compare(rows, scenes, engines, baseline, samples):
    """Lines of one table: errors at the time the baseline takes for `samples`, and the ratio."""
    lines = [f"Error at the time {baseline} takes for {samples} samples a pixel "
             "(raw / trimmed relMSE; ratio: how many times less trimmed error than it)", ""]
    lines.append("| scene | engine | Msamples/s | raw | trimmed | ratio [95 %] |")
    lines.append("|---|---|---|---|---|---|")
    ratios = {engine: [] for engine in engines}
    for scene in scenes:
        base = _of(rows, scene.name, baseline)
        if not base:
            continue
        seconds = time_of(base, samples)
        base_errors = errors_at_time(base, seconds, "trimmed")
        pixels = scene.resolution[0] * scene.resolution[1]
        for engine in engines:
            mine = _of(rows, scene.name, engine)
            if not mine:
                continue
            trimmed = errors_at_time(mine, seconds, "trimmed")
            raw = np.mean(errors_at_time(mine, seconds, "raw"))
            rate = metric.slope_rate([row["samples"] for row in mine],
                                     [row["seconds"] for row in mine]) * pixels * 1e-6
            ratio = metric.error_ratio(base_errors, trimmed)
            ratios[engine].append(ratio.value)
            name = f"{scene.name} ({seconds:.2f} s)" if engine == engines[0] else ""
            lines.append(f"| {name} | {engine} | {rate:.2f} | {raw:.4g} | {np.mean(trimmed):.4g} "
                         f"| {_cell(ratio) if engine != baseline else '1'} |")
    means = [f"{engine} {math.exp(np.mean(np.log(values))):.2f}x"
             for engine, values in ratios.items() if values and engine != baseline]
    return [*lines, "", "Geometric mean over these scenes: " + ", ".join(means)]


def work_lines(rows, scenes, engines):
    """Counters of engines that have them: a high rate may come from short paths."""
    lines = ["| scene | engine | vertices/sample | rays/sample | ns/vertex |",
             "|---|---|---|---|---|"]
    for scene in scenes:
        for engine in engines:
            mine = [row for row in _of(rows, scene.name, engine) if row.get("vertices")]
            if mine:
                top = [row for row in mine if row["samples"] == max(r["samples"] for r in mine)]
                vertices = np.mean([row["vertices"] for row in top])
                rays = np.mean([row["rays"] for row in top])
                cost = np.mean([row["cpu_per_vertex"] for row in top]) * 1e9
                lines.append(f"| {scene.name} | {engine} | {vertices:.2f} | {rays:.2f} "
                             f"| {cost:.0f} |")
    return lines if len(lines) > 2 else []
