"""tests/benchmark/run: measures, writes build/benchmark/results.csv, prints a table."""

import argparse
import sys
import time
from pathlib import Path

from harness import engines, metric, references, report
from harness.scenes import ROOT, Engine, all_engines, all_scenes

QUICK = {"scenes": ["cornell", "door", "lamp", "veach_ajar@128"],
         "engines": ["pharos", "pharos-off", "cycles", "cycles-guided"],
         "budgets": [8, 32], "seeds": 3, "reference": 256, "at": 16}
FULL = {"scenes": ["cornell", "door", "lamp", "outdoor", "glass", "veach_ajar", "veach_ajar@128",
                   "contemporary_bathroom", "contemporary_bathroom@128"],
        "engines": ["pharos", "pharos-off", "cycles", "cycles-guided"],
        "budgets": [8, 16, 64, 256], "seeds": 8, "reference": 2048, "at": 64}


def parse(arguments):
    parser = argparse.ArgumentParser(prog="tests/benchmark/run", description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--scenes", help="comma-separated names, or all")
    parser.add_argument("--engines", help="comma-separated names: " + ", ".join(all_engines()))
    parser.add_argument("--budgets", help="samples a pixel, for example 8,32,128")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--at", help="compare at the time the baseline takes for these samples")
    parser.add_argument("--baseline", help="the engine others are compared with")
    parser.add_argument("--reference", type=int, help="samples of each half of the references")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--nee", choices=("on", "off"), default="on",
                        help="Pharos without next-event estimation: the published protocol")
    parser.add_argument("--compare-builds", nargs=2, metavar="CLI", type=Path,
                        help="two pharos-cli programs in place of the engines")
    parser.add_argument("--out", type=Path, default=ROOT / "build/benchmark/results.csv")
    return parser.parse_args(arguments)


def chosen_engines(options, defaults):
    """Name -> (engine, program); builds are the guided engine of two programs."""
    table = all_engines()
    if options.compare_builds:
        names = ["build A", "build B"]
        mode = (options.engines or "pharos").split(",")[0]
        picked = {name: (Engine(name, "pharos", table[mode].options, "pharos"), program.resolve())
                  for name, program in zip(names, options.compare_builds, strict=True)}
    else:
        names = options.engines.split(",") if options.engines else defaults["engines"]
        picked = {name: (table[name], None) for name in names}
    for engine, _ in picked.values():
        if engine.program == "pharos":
            engine.options["nee"] = options.nee
    return picked


def row_of(scene, name, shot, pair):
    error = metric.relative_error(shot.pixels, *pair)
    row = {"scene": scene.name, "engine": name, "samples": shot.samples, "seed": shot.seed,
           "seconds": shot.seconds, "raw": error.raw, "trimmed": error.trimmed}
    if shot.work.get("camera_samples"):
        row["vertices"] = shot.work["vertices"] / shot.work["camera_samples"]
        row["rays"] = shot.work["rays"] / shot.work["camera_samples"]
        row["cpu_per_vertex"] = shot.work["render_cpu_seconds"] / shot.work["vertices"]
    return row


def measure(scenes, picked, plan, threads, say):
    """Engines take turns seed by seed, so that a busy machine is unfair to all alike."""
    rows, missing = [], set()
    for scene in scenes:
        pairs = {}
        for seed in range(1, plan["seeds"] + 1):
            for name, (engine, program) in picked.items():
                if (scene.name, name) in missing:
                    continue
                try:
                    if engine.reference not in pairs:
                        pairs[engine.reference] = references.ensure(
                            scene, engine.reference, plan["reference"], threads, say)
                    say(f"{scene.name} {name} seed {seed}")
                    runs = [(samples, seed) for samples in plan["budgets"]]
                    shots = engines.render(scene, engine, runs, threads, program)
                    rows += [row_of(scene, name, shot, pairs[engine.reference]) for shot in shots]
                except engines.EngineError as error:
                    missing.add((scene.name, name))
                    print(f"{scene.name} {name}: {error}", file=sys.stderr)
    return rows, missing


def main(arguments):
    options = parse(arguments)
    defaults = QUICK if options.quick else FULL
    table = all_scenes()
    names = defaults["scenes"] if not options.scenes else (
        list(table) if options.scenes == "all" else options.scenes.split(","))
    scenes = [table[name] for name in names if name in table]
    for name in set(names) - set(table):
        print(f"no scene {name}: left out", file=sys.stderr)
    plan = {
        "budgets": [int(n) for n in options.budgets.split(",")] if options.budgets
        else defaults["budgets"],
        "seeds": options.seeds or defaults["seeds"],
        "reference": options.reference or defaults["reference"],
    }
    picked = chosen_engines(options, defaults)
    baseline = options.baseline or ("build A" if options.compare_builds else
                                    "pharos-off" if "pharos-off" in picked else next(iter(picked)))
    started = time.monotonic()

    def say(text):
        print(f"[{time.monotonic() - started:6.1f} s] {text}", file=sys.stderr, flush=True)

    rows, missing = measure(scenes, picked, plan, options.threads, say)
    report.write_csv(rows, options.out)
    if not any(row["engine"] == baseline for row in rows):
        print(f"{baseline} gave no picture to compare with", file=sys.stderr)
        return 1
    for samples in str(options.at or defaults["at"]).split(","):
        print("\n".join(report.compare(rows, scenes, list(picked), baseline, int(samples))), "\n")
    print("\n".join(report.work_lines(rows, scenes, list(picked))))
    print(f"\n{len(rows)} pictures in {time.monotonic() - started:.0f} s; every row: {options.out}")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
