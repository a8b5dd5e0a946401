"""The README's section of figures, made from measured rows: what stands between the marks."""

import math

from harness import report

BEGIN = "<!-- figures: made by tests/benchmark/run --publish -->"
END = "<!-- end of figures -->"
TITLES = {"cornell": "Cornell box", "door": "door ajar", "lamp": "lamp under its shade",
          "outdoor": "HDRI outdoors", "glass": "glass", "furnace": "white furnace",
          "frosted": "lamp behind frosted glass", "gloss": "brushed metal", "caustic": "caustics",
          "veach_ajar": "`veach_ajar`", "contemporary_bathroom": "`contemporary_bathroom`"}
ENGINES = {"pharos": "Pharos", "pharos-off": "Pharos without its network", "cycles": "Cycles",
           "cycles-guided": "Cycles, guided", "cycles-3.4": "Cycles 3.4.1",
           "pharos-reflection": "Pharos, transmission unguided",
           "pharos-radiance": "Pharos without the product",
           "pharos-slides": "the thesis' model",
           "pharos-slides-position": "the same by position alone"}
WIDTH = 102


def scene_title(scene, sizes=None):
    name = scene.split("@")[0]
    size = (sizes or {}).get(scene)
    return TITLES.get(name, name) + (f", {size[0]} x {size[1]}" if size else "")


def engine_title(engine):
    return ENGINES.get(engine, engine)


def _short(value):
    return f"{value:.1f}" if value >= 1.995 else f"{value:.2f}"


def _interval(ratio):
    return "" if math.isnan(ratio.low) else f" [{_short(ratio.low)}, {_short(ratio.high)}]"


def _cell(ratio):
    word = f"{_short(ratio.value)}x"
    return (f"**{word}**" if ratio.low > 1.0 else word) + _interval(ratio)


def wrapped(text):
    """Lines no longer than the README's."""
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > WIDTH:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return [*lines, line]


def _sizes_in_rows(meta):
    """Scene -> size, where not all are of one; the common size."""
    sizes = {scene: tuple(size) for scene, size in meta.get("sizes", {}).items()}
    common = max(set(sizes.values()), key=list(sizes.values()).count) if sizes else None
    return {scene: size for scene, size in sizes.items() if size != common}, common


def _table(rows, meta, samples):
    baseline = meta["baseline"]
    entries = report.compare(rows, baseline, samples, {})
    engines = [name for name in report.names(rows, "engine") if name != baseline]
    odd, _ = _sizes_in_rows(meta)
    found = {(e.scene, e.engine): e.ratio for e in entries}
    scenes = sorted({e.scene for e in entries},
                    key=lambda s: -found[s, engines[0]].value if (s, engines[0]) in found else 0)
    lines = ["| scene | " + " | ".join(engine_title(e) for e in engines) + " |",
             "|---" * (1 + len(engines)) + "|"]
    for scene in scenes:
        cells = [_cell(found[scene, e]) if (scene, e) in found else "" for e in engines]
        lines.append(f"| {scene_title(scene, odd)} | " + " | ".join(cells) + " |")
    return lines


def _other_times(rows, meta, times):
    """What Pharos gains at other times, in one sentence each."""
    sentences = []
    for samples in times:
        ours = [e for e in report.compare(rows, meta["baseline"], samples, {})
                if e.engine == report.OURS]
        ours.sort(key=lambda e: -e.ratio.value)
        words = ", ".join(f"{scene_title(e.scene)} {_short(e.ratio.value)}x" for e in ours)
        if words:
            sentences.append(f"At the time for {samples} samples: {words}.")
    return sentences


def _by_rival(behind, words):
    """Scenes of each rival, as one phrase."""
    rivals = dict.fromkeys(r.rival for r in behind)
    return "; ".join(f"against {engine_title(rival)}, " + ", ".join(words(r) for r in behind
                                                           if r.rival == rival)
                     for rival in rivals)


def _losses(rows, meta):
    """Where Pharos is behind, in words."""
    sentences = []
    for samples in meta["at"]:
        behind = report.losses(rows, meta["baseline"], samples)
        sure = [r for r in behind if r.ratio.high < 1.0]
        even = [r for r in behind if not r.ratio.high < 1.0]
        if sure:
            words = _by_rival(sure, lambda r: f"{scene_title(r.scene)} {_short(r.ratio.value)}x"
                                              f"{_interval(r.ratio)}")
            sentences.append(f"Losses at {samples} samples: {words}.")
        if even:
            words = _by_rival(even, lambda r: f"{scene_title(r.scene)} {_short(r.ratio.value)}x")
            sentences.append(f"Behind by less than the noise: {words}.")
    return sentences or ["Pharos loses on none of these scenes."]


def _made_by(meta):
    _, common = _sizes_in_rows(meta)
    versions = ", ".join(f"{name} {version}" for name, version in meta.get("versions", {}).items())
    size = f"; pictures of {common[0]} x {common[1]} pixels" if common else ""
    return (f"Measured on {meta.get('date', 'an unknown day')}: {meta.get('machine', '')}, "
            f"{meta.get('threads', 2)} threads; {versions}{size}, {meta['seeds']} seeds."
            + (f" {meta['note']}" if "note" in meta else ""))


def section(meta, rows):
    """The text between the marks, which are part of it."""
    good = [row for row in rows if "trimmed" in row]
    first, *others = meta["at"]
    lines = [BEGIN, *wrapped(
        f"How many times less error than {engine_title(meta['baseline'])}, at the time that takes "
        f"for {first} samples a pixel; in brackets the 95 % interval over seeds. Below 1x is a "
        "loss."), "", *_table(good, meta, first), ""]
    for sentence in (_other_times(good, meta, others), _losses(good, meta)):
        if sentence:
            lines += [*wrapped(" ".join(sentence)), ""]
    lines += [*wrapped(_made_by(meta)), "", "```", *command_lines(meta["command"]), "```", END]
    return "\n".join(lines)


def command_lines(command):
    """A long command over several lines."""
    lines = [""]
    for word in command.split():
        if len(lines[-1]) + len(word) > WIDTH - 4:
            lines[-1] += " \\"
            lines.append("   ")
        lines[-1] += (" " if lines[-1] else "") + word
    return lines


def between(text, begin, end):
    """(before, between, after) of a text with the two marks, which belong to the middle."""
    start, stop = text.index(begin), text.index(end) + len(end)
    return text[:start], text[start:stop], text[stop:]


def replaced(text, part, begin=BEGIN, end=END):
    """The README with what stands between two marks replaced by a part that has them."""
    before, _, after = between(text, begin, end)
    return before + part + after
