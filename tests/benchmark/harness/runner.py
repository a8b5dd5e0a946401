"""Measures: every engine on every scene, seed by seed, in turns.

Engines take turns so that a busy machine is unfair to all alike. One process renders all budgets
of one scene, engine and seed. Where it breaks it is started again for what is missing; where it
breaks again that is written down, and the others go on.
"""

from dataclasses import dataclass
from subprocess import SubprocessError

from harness import engines, metric, references
from harness.process import EngineError

RESTARTS = 1
PATIENCE = 2  # seeds of one scene and engine without a picture, before the others are left out


@dataclass
class Plan:
    """What is to be measured."""

    scenes: list
    engines: dict  # name -> (Engine, program or None)
    budgets: list
    seeds: int
    reference: int  # samples of each half of the references
    threads: int = 2


def cutout(pixels, box):
    """A part of a picture that is kept bottom row first; the box counts from the top."""
    x0, y0, x1, y1 = box
    height = pixels.shape[0]
    return pixels[height - y1:height - y0, x0:x1]


def row_of(scene, name, shot, pair):
    """A picture's figures."""
    error = metric.relative_error(shot.pixels, *pair)
    bias = metric.bias_of(shot.pixels, *pair)
    nonfinite = metric.nonfinite_pixels(shot.pixels)
    parts = {}
    for place, box in scene.cutouts().items():
        pictures = (cutout(pixels, box) for pixels in (shot.pixels, *pair))
        parts[place] = metric.relative_error(*pictures, metric.CUTOUT_TRIMMED_SHARE).trimmed
    row = {"scene": scene.name, "engine": name, "samples": shot.samples,
           "budget": shot.budget, "seed": shot.seed, "seconds": shot.seconds,
           "raw": error.raw, "trimmed": error.trimmed, "bias": bias.value,
           "bias_error": bias.error, "bias_reference_error": bias.reference_error,
           "reference_noise": metric.reference_error(*pair), "nonfinite": nonfinite,
           "cutouts": parts, **shot.facts}
    if nonfinite:
        row["trouble"] = f"{nonfinite} pixels are not finite numbers"
    return row


class Runner:
    """`programs` and `reference_pair` may be others for tests; `keep` gets every picture."""

    def __init__(self, plan, journal, say=lambda text: None, programs=None, reference_pair=None,
                 keep=lambda scene, engine, shot, pair: None):
        self._plan, self._journal, self._say, self._keep = plan, journal, say, keep
        self._programs = engines.PROGRAMS if programs is None else programs
        self._reference_pair = reference_pair or self._own_references
        self._pairs = {}

    def _own_references(self, scene, program):
        return references.ensure(scene, program, self._plan.reference, self._plan.threads,
                                 self._say)

    def _pair(self, scene, engine):
        key = (scene.name, engine.reference)
        if key not in self._pairs:
            self._pairs[key] = self._reference_pair(scene, engine.reference)
        return self._pairs[key]

    def run(self):
        """All rows; what went wrong is in them."""
        for scene in self._plan.scenes:
            failed = dict.fromkeys(self._plan.engines, 0)
            for seed in range(1, self._plan.seeds + 1):
                for name in self._plan.engines:
                    if failed[name] < PATIENCE and not self._measure(scene, name, seed):
                        failed[name] += 1
                        if failed[name] == PATIENCE and seed < self._plan.seeds:
                            self._trouble(scene, name, seed + 1, "further seeds were left out")
            self._pairs.clear()
        return self._journal.rows

    def _missing(self, scene, name, seed):
        there = self._journal.has(scene.name, name, seed)
        return [(budget, seed) for budget in self._plan.budgets if budget not in there]

    def _measure(self, scene, name, seed):
        """False where not all budgets could be rendered."""
        problem = ""
        for attempt in range(1 + RESTARTS):
            runs = self._missing(scene, name, seed)
            if not runs:
                break
            self._say(f"{scene.name} {name} seed {seed}" + (", again" if attempt else ""))
            problem = self._attempt(scene, name, runs)
        if not self._missing(scene, name, seed):
            return True
        self._trouble(scene, name, seed, problem)
        return False

    def _attempt(self, scene, name, runs):
        """What went wrong, or nothing."""
        engine, program = self._plan.engines[name]
        rows, problem = [], "pictures are missing"
        try:
            pair = self._pair(scene, engine)
            render = self._programs[engine.program]
            for shot in render(scene, engine.options, runs, self._plan.threads, program):
                rows.append(row_of(scene, name, shot, pair))
                self._keep(scene, name, shot, pair)
        except EngineError as error:
            problem = str(error)
        except (OSError, ValueError, LookupError, StopIteration, SubprocessError) as error:
            # A picture or a report of the engine that cannot be read is its failure as well.
            problem = f"{type(error).__name__}: {error}"
        self._journal.add(rows)
        return problem

    def _trouble(self, scene, name, seed, problem):
        text = " ".join(problem.split())[-300:]
        self._say(f"{scene.name} {name} seed {seed}: {text}")
        self._journal.add([{"scene": scene.name, "engine": name, "seed": seed, "trouble": text}])
