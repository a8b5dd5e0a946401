"""The thesis' own comparisons ("Real Time Neural Path Guiding", Wuest 2023) on our scenes.

A frame is one sample a pixel, and the network learns after every frame. What is looked at are the
16 samples that follow N frames of training: a window of a longer render. All passes of these modes
weigh alike, so that a window is the difference of two snapshots.

    tests/benchmark/slides                measures, prints tables, writes slides.csv and slides.html
    tests/benchmark/slides --from CSV     tables and page again
"""

import argparse
import shlex
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from harness import (
    engines,
    machine,
    pictures,
    png,
    process,
    readme,
    references,
    report,
    results,
    slides_page,
)
from harness.runner import Plan, Runner, cutout
from harness.scenes import ROOT, Engine, Scene, all_scenes

WINDOW = 16
TRAINED = (0, 1, 4, 16, 64, 256)  # frames of training before the window
SHOWN = (0, 64)
LEARNING = ("door@128", "lamp@128")  # also over the number of frames
SCENES = ("door@128", "lamp@128", "cornell@128", "glass@128")
MODES = {"NEE and BSDF": ("OFF", "on"), "position": ("SLIDES-POSITION", "on"),
         "position and normal": ("SLIDES", "on"), "mixture": ("SLIDES-MIXTURE", "on"),
         "BSDF alone": ("OFF", "off"), "guided without NEE": ("SLIDES", "off"),
         "mixture without NEE": ("SLIDES-MIXTURE", "off")}
LONG_PASSES = 10_000
LONG_SIZE = (16, 12)
UNTOLD = ("--publish", "--fresh")  # of the command that made the figures
EDGE_SCENE, EDGE_FRAMES = "lamp", 64
OUT = ROOT / "build/benchmark/slides.csv"
PUBLISHED = ROOT / "tests/benchmark/results/slides.csv"


def difference(shots):
    """A function of (first, last) frame: the mean of the frames between, and its seconds."""
    by_frames = {shot.samples: shot for shot in shots}

    def between(first, last):
        end = by_frames[last]
        if first == 0:
            return end.pixels, end.seconds
        begin = by_frames[first]
        pixels = (last * end.pixels.astype(np.float64) - first * begin.pixels) / (last - first)
        return pixels.astype(np.float32), end.seconds - begin.seconds

    return between


def render_windows(scene, options, runs, threads, program=None):
    """A program as engines.py has them: a run's samples are the frames before its window."""
    for seed in dict.fromkeys(seed for _, seed in runs):
        trained = [frames for frames, s in runs if s == seed]
        wanted = sorted({n for frames in trained for n in (frames, frames + WINDOW) if n})
        shots = list(engines.render_snapshots(scene, options, [(n, seed) for n in wanted], threads,
                                              program))
        between = difference(shots)
        for frames in trained:
            pixels, seconds = between(frames, frames + WINDOW)
            facts = shots[-1].facts if frames == max(trained) else {}
            yield engines.Shot(WINDOW, seed, seconds, pixels, facts, frames)


def table_of_engines(names):
    return {name: (Engine(name, "windows", {"guiding": MODES[name][0], "nee": MODES[name][1],
                                            "more": ["--pass-samples", "1"]}, "pharos"), None)
            for name in names}


def plans(scenes, seeds, threads):
    """Learning curves on some scenes, the first and the trained window on the others."""
    with_nee = [name for name, (_, nee) in MODES.items() if nee == "on"]
    without = [name for name in MODES if name not in with_nee]
    for scene in scenes:
        trained = TRAINED if scene.name in LEARNING else SHOWN
        yield Plan([scene], table_of_engines(with_nee), trained, seeds, 2048, threads)
        yield Plan([scene], table_of_engines(without), SHOWN, seeds, 2048, threads)


def long_run(threads):
    """One lobe over very many passes: is everything finite, and is the mean still right?"""
    lamp = all_scenes()["lamp"]
    small = Scene("lamp@16", lamp.file, LONG_SIZE)
    more = {"more": ["--pass-samples", "1"]}
    guided, plain = (next(iter(engines.render_pharos(
        small, {"guiding": mode, **options}, [(LONG_PASSES, 1)], threads)))
        for mode, options in (("SLIDES", more), ("NEURAL", {})))
    difference_of_pixels = (guided.pixels - plain.pixels).mean(axis=-1)
    bound = 1.96 * float(difference_of_pixels.std()) / difference_of_pixels.size**0.5
    return {"passes": LONG_PASSES, "size": list(LONG_SIZE),
            "nonfinite_pixels": int(np.count_nonzero(~np.isfinite(guided.pixels))),
            "dropped_samples": guided.facts["dropped"],
            "mean": float(guided.pixels.mean()), "mean_of_others": float(plain.pixels.mean()),
            "bound": bound,
            "seconds": guided.seconds}


def edge_pictures(folder, threads):
    """Crops across the edges of things: the render and what the guide believes there."""
    scene = all_scenes()[EDGE_SCENE]
    pair = references.ensure(scene, "pharos", 512, threads)
    reference = 0.5 * (pair[0] + pair[1])
    box = scene.cutouts()["edges"]
    exposure = png.exposure_of(cutout(reference, box))
    folder.mkdir(parents=True, exist_ok=True)

    def keep(name, pixels):
        shown = png.to_srgb(cutout(pixels, box), exposure)
        (folder / f"{name}.png").write_bytes(png.encode(shown))

    keep("reference", reference)
    for name in ("position", "position and normal"):
        options = table_of_engines([name])[name][0].options
        frames = [(EDGE_FRAMES, 1), (EDGE_FRAMES + WINDOW, 1)]
        shots = list(engines.render_snapshots(scene, options, frames, threads))
        keep(name, difference(shots)(EDGE_FRAMES, EDGE_FRAMES + WINDOW)[0])
        shown = 0.5 + 0.5 * cutout(guide_direction(scene, options, threads), box)
        (folder / f"{name} direction.png").write_bytes(png.encode(png.to_srgb(shown)))


def guide_direction(scene, options, threads):
    """Mean direction of the learned light at each pixel's first hit, after so many frames."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.exr"
        command = [ROOT / "build/release/native/pharos-cli", "render", engines.dump_file(scene)[0],
                   "-o", out, "--samples", EDGE_FRAMES, "--threads", threads, "--guiding",
                   options["guiding"], *options["more"], "--passes", "Guide Direction"]
        process.check(process.run(command, 600), command[0])
        return pictures.read_exr(out, "Guide Direction", "XYZ")


def measure(options, arguments):
    began = time.monotonic()

    def say(text):
        print(f"[{time.monotonic() - began:6.1f} s] {text}", file=sys.stderr, flush=True)

    table = all_scenes()
    scenes = [table[name] for name in options.scenes.split(",") if name in table]
    program = ROOT / "build/release/native/pharos-cli"
    meta = {"date": machine.today(), "command": shlex.join(
                ["tests/benchmark/slides", *(a for a in arguments if a not in UNTOLD)]),
            "machine": machine.processor(), "threads": options.threads,
            "versions": machine.versions({"pharos"}), "seeds": options.seeds, "window": WINDOW,
            "conditions": {"program": machine.content(program), "threads": options.threads,
                           "scenes": {scene.name: scene.key() for scene in scenes}}}
    partial = OUT.with_suffix(".partial.csv")
    journal = results.Journal(partial, meta, options.fresh)
    for plan in plans(scenes, options.seeds, options.threads):
        Runner(plan, journal, say, {**engines.PROGRAMS, "windows": render_windows}).run()
    if not options.short:
        say(f"{LONG_PASSES} passes")
        meta["long_run"] = long_run(options.threads)
        say("edges")
        edge_pictures(OUT.with_name("slides_crops"), options.threads)
    results.write(OUT, meta, journal.rows)
    partial.unlink()
    return meta, journal.rows


def publish(meta, rows):
    """The CSV into the repository, and the README's part from it."""
    kept = {key: value for key, value in meta.items() if key != "conditions"}
    results.write(PUBLISHED, kept, rows)
    path = ROOT / "README.md"
    part = slides_page.readme_section(*results.read(PUBLISHED))
    text = readme.replaced(path.read_text(encoding="utf-8"), part, slides_page.BEGIN,
                           slides_page.END)
    path.write_text(text, encoding="utf-8")


def main(arguments):
    parser = argparse.ArgumentParser(prog="tests/benchmark/slides", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--fresh", action="store_true", help="do not go on with what is there")
    parser.add_argument("--short", action="store_true", help="no long run, no crops")
    parser.add_argument("--from", dest="source", type=Path, metavar="CSV")
    parser.add_argument("--publish", action="store_true",
                        help="keep the CSV in tests/benchmark/results, write the README's part")
    options = parser.parse_args(arguments)
    process.end_on_termination()
    meta, rows = results.read(options.source) if options.source else measure(options, arguments)
    print("\n".join(slides_page.text(meta, rows)))
    if options.publish:
        publish(meta, rows)
    path = OUT.with_suffix(".html")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(slides_page.make(meta, rows, OUT.with_name("slides_crops")), encoding="utf-8")
    print(f"\nrows: {options.source or OUT}\npage: {path}")
    return 1 if report.troubles(rows) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
