"""tests/benchmark/run: measures; writes a CSV file and a page beside it; prints tables.

An interrupted run goes on where it stood when it is started again with the same words. The CSV,
the page and the README's section can be made again from a CSV without measuring: --from.
"""

import argparse
import shlex
import sys
import time
from pathlib import Path

from harness import (
    engines,
    machine,
    metric,
    page,
    png,
    process,
    readme,
    references,
    report,
    results,
)
from harness.runner import Plan, Runner, cutout
from harness.scenes import ROOT, Engine, all_engines, all_scenes

QUICK = {"scenes": ["cornell", "door", "lamp", "veach_ajar@128"],
         "budgets": "8,32", "seeds": 3, "reference": 256, "at": "16"}
FULL = {"scenes": [f"{name}@128" for name in ("cornell", "door", "lamp", "furnace", "outdoor",
                                              "glass", "veach_ajar", "contemporary_bathroom")],
        "budgets": "16,64,256", "seeds": 3, "reference": 2048, "at": "64,16,256"}
ENGINES = "pharos-off,pharos,cycles,cycles-guided"
PUBLISHED = ROOT / "tests/benchmark/results/benchmark.csv"


def parse(arguments):
    parser = argparse.ArgumentParser(prog="tests/benchmark/run", description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--scenes", help="comma-separated names, or all")
    parser.add_argument("--engines", help="comma-separated names: " + ", ".join(all_engines()))
    parser.add_argument("--budgets", help="samples a pixel, for example 8,32,128")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--at", help="compare at the time the baseline takes for these samples; "
                                     "the first one is the README's")
    parser.add_argument("--baseline", help="the engine others are compared with")
    parser.add_argument("--reference", type=int, help="samples of each half of the references")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--nee", choices=("on", "off"), default="on",
                        help="Pharos without next-event estimation, the published protocol; "
                             "released Cycles cannot leave it out")
    parser.add_argument("--compare-builds", nargs=2, metavar="CLI", type=Path,
                        help="two pharos-cli programs in place of the engines")
    parser.add_argument("--out", type=Path, default=ROOT / "build/benchmark/results.csv")
    parser.add_argument("--fresh", action="store_true", help="do not go on with what is there")
    parser.add_argument("--extend", action="store_true",
                        help="go on from a finished CSV, with more seeds say")
    parser.add_argument("--from", dest="source", type=Path, metavar="CSV",
                        help="measure nothing: tables and page of this file")
    parser.add_argument("--publish", action="store_true",
                        help=f"keep the CSV as {PUBLISHED.relative_to(ROOT)} and write the "
                             "README's section from it")
    options = parser.parse_args(arguments)
    for name, value in (QUICK if options.quick else FULL).items():
        if getattr(options, name) is None:
            setattr(options, name, ",".join(value) if name == "scenes" else value)
    return options


def chosen_engines(options):
    """Name -> (engine, program); builds are the guided engine of two programs."""
    table = all_engines()
    if options.compare_builds:
        mode = (options.engines or "pharos").split(",")[0]
        picked = {name: (Engine(name, "pharos", table[mode].options, "pharos"), program.resolve())
                  for name, program in zip(("build A", "build B"), options.compare_builds,
                                           strict=True)}
    else:
        names = (options.engines or ENGINES).split(",")
        picked = {name: (table[name], None) for name in names}
    for engine, _ in picked.values():
        if engine.program == "pharos":
            engine.options["nee"] = options.nee
    return picked


def plan_of(options):
    table = all_scenes()
    names = list(table) if options.scenes == "all" else options.scenes.split(",")
    for name in set(names) - set(table):
        print(f"no scene {name}: left out", file=sys.stderr)
    return Plan([table[name] for name in names if name in table], chosen_engines(options),
                [int(n) for n in options.budgets.split(",")], options.seeds, options.reference,
                options.threads)


def conditions(plan):
    """Rows of other conditions than these must not be mixed in."""
    programs = {str(program or ROOT / "build/release/native/pharos-cli")
                for engine, program in plan.engines.values() if engine.program == "pharos"}
    return {"threads": plan.threads, "reference": plan.reference,
            "engines": {name: engine.options for name, (engine, _) in plan.engines.items()},
            "scenes": {scene.name: scene.key() for scene in plan.scenes},
            "programs": [machine.content(program) for program in sorted(programs)]}


def meta_of(options, plan, arguments):
    baseline = options.baseline or ("build A" if options.compare_builds else
                                    "pharos-off" if "pharos-off" in plan.engines
                                    else next(iter(plan.engines)))
    command = ["tests/benchmark/run",
               *(word for word in arguments if word not in ("--fresh", "--publish"))]
    return {"date": machine.today(), "command": shlex.join(command),
            "machine": machine.processor(), "threads": plan.threads,
            "versions": machine.versions({e.program for e, _ in plan.engines.values()}),
            "seeds": plan.seeds, "baseline": baseline,
            "at": [int(n) for n in str(options.at).split(",")],
            "sizes": {scene.name: list(scene.resolution) for scene in plan.scenes},
            "conditions": conditions(plan)}


def crop_folder(csv):
    return csv.with_name(f"{csv.stem}_crops")


def keep_crops(folder, budget):
    """A function that writes the cutouts of the first seed's pictures of one budget."""

    def keep(scene, engine, shot, pair):
        if shot.seed != 1 or shot.budget != budget:
            return
        reference = 0.5 * (pair[0] + pair[1])
        (folder / scene.name).mkdir(parents=True, exist_ok=True)
        for place, box in scene.cutouts().items():
            exposure = png.exposure_of(cutout(reference, box))
            for name, pixels in (("reference", reference), (engine, shot.pixels)):
                data = png.encode(png.to_srgb(cutout(pixels, box), exposure))
                (folder / scene.name / f"{place}.{name}.png").write_bytes(data)

    return keep


def accuracy(plan):
    """Scene -> our reference against Cycles', where both take part."""
    used = {engine.reference for engine, _ in plan.engines.values()}
    found = {}
    for scene in plan.scenes if {"pharos", "cycles"} <= used else ():
        try:
            ours, theirs = (references.ensure(scene, program, plan.reference, plan.threads)
                            for program in ("pharos", "cycles"))
        except engines.EngineError:
            continue
        bias = metric.bias_of(0.5 * (ours[0] + ours[1]), *theirs)
        block = metric.block_difference(0.5 * (ours[0] + ours[1]), 0.5 * (theirs[0] + theirs[1]))
        found[scene.name] = {"mean": bias.value, "error": bias.error, "block": block}
    return found


def measure(options, arguments, say):
    """Runs what is missing and writes the CSV; (meta, rows)."""
    plan = plan_of(options)
    meta = meta_of(options, plan, arguments)
    partial = options.out.with_suffix(".partial.csv")
    if options.extend and options.out.exists() and not partial.exists():
        results.write(partial, *results.read(options.out))
    journal = results.Journal(partial, meta, options.fresh)
    shown = min(plan.budgets, key=lambda n: abs(n - meta["at"][0]))
    Runner(plan, journal, say, keep=keep_crops(crop_folder(options.out), shown)).run()
    meta["accuracy"] = accuracy(plan)
    results.write(options.out, meta, journal.rows)
    partial.unlink()
    return meta, journal.rows


def show(meta, rows):
    good = results.pictures(rows)
    sizes = {scene: size[0] * size[1] for scene, size in meta["sizes"].items()}
    for samples in meta["at"]:
        entries = report.compare(good, meta["baseline"], samples, sizes)
        print("\n".join(report.table(entries, meta["baseline"])))
        print(report.interval_words(entries, meta["baseline"]), "\n")
    print("\n".join(report.work_lines(good)), "\n")
    for scene, engine, bias in report.biases(good):
        print(f"{scene} {engine}: {report.bias_words(bias)}")
    for line in report.troubles(rows):
        print(f"went wrong: {line}")


def publish(meta, rows):
    """The CSV into the repository without what only a machine knows, and the README's section."""
    kept = {key: value for key, value in meta.items() if key != "conditions"}
    results.write(PUBLISHED, kept, rows)
    path = ROOT / "README.md"
    part = readme.section(*results.read(PUBLISHED))
    text = readme.replaced(path.read_text(encoding="utf-8"), part)
    path.write_text(text, encoding="utf-8")


def main(arguments):
    options = parse(arguments)
    process.end_on_termination()
    started = time.monotonic()

    def say(text):
        print(f"[{time.monotonic() - started:6.1f} s] {text}", file=sys.stderr, flush=True)

    if options.source:
        meta, rows = results.read(options.source)
        csv = options.source
    else:
        meta, rows = measure(options, arguments, say)
        csv = options.out
    if not any(row["engine"] == meta["baseline"] for row in results.pictures(rows)):
        print(f"{meta['baseline']} gave no picture to compare with", file=sys.stderr)
        return 1
    show(meta, rows)
    page_path = (ROOT / "build/benchmark" / csv.name).with_suffix(".html")
    page_path.parent.mkdir(parents=True, exist_ok=True)
    page_path.write_text(page.make(meta, rows, crop_folder(csv)), encoding="utf-8")
    if options.publish:
        publish(meta, rows)
    print(f"\n{len(results.pictures(rows))} pictures, {time.monotonic() - started:.0f} s")
    print(f"rows: {csv}\npage: {page_path}")
    return 1 if report.troubles(rows) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
