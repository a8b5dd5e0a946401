"""Measured rows as a CSV file: what was measured and where stands before them in `# key: value`.

A row is a picture; its `trouble` says what went wrong, and where there is no picture at all it
says only that. Rows are written as soon as they are there, so that a run that was interrupted goes
on where it stood.
"""

import csv
import io
import json

NUMBERS = ("seconds", "wall", "raw", "trimmed", "bias", "bias_error", "bias_reference_error",
           "reference_noise", "startup", "export", "build", "memory", "memory_before", "vertices",
           "rays", "cpu_per_vertex", "guided_share")
COUNTS = ("samples", "budget", "seed", "nonfinite", "dropped")
TABLES = ("cutouts", "stages")  # name -> number
COLUMNS = ("scene", "engine", "budget", "samples", "seed", *NUMBERS, "nonfinite", "dropped",
           *TABLES, "trouble")


def _word(column, value):
    if value is None or value == "":
        return ""
    if column in TABLES:
        return ";".join(f"{name}={number:.4g}" for name, number in value.items())
    return f"{value:.6g}" if column in NUMBERS else str(value)


def _value(column, word):
    if column in TABLES:
        pairs = (part.rsplit("=", 1) for part in word.split(";"))
        return {name: float(number) for name, number in pairs}
    if column in NUMBERS:
        return float(word)
    return int(word) if column in COUNTS else word


def _line(words):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerow(words)
    return out.getvalue()


def to_text(meta, rows):
    head = "".join(f"# {key}: {json.dumps(value)}\n" for key, value in meta.items())
    return head + _line(COLUMNS) + "".join(row_line(row) for row in rows)


def row_line(row):
    return _line([_word(column, row.get(column)) for column in COLUMNS])


def from_text(text):
    """(meta, rows); a last line that was cut off is left out."""
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines.pop()
    meta = {}
    while lines and lines[0].startswith("# "):
        key, value = lines.pop(0)[2:].split(": ", 1)
        meta[key] = json.loads(value)
    rows = []
    for words in csv.DictReader(lines):
        row = {column: _value(column, word) for column, word in words.items() if word}
        row.setdefault("budget", row.get("samples"))
        rows.append(row)
    return meta, rows


def write(path, meta, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{path.name}")
    scratch.write_text(to_text(meta, rows), encoding="utf-8")
    scratch.replace(path)


def read(path):
    return from_text(path.read_text(encoding="utf-8"))


def pictures(rows):
    """Rows that hold a picture's figures."""
    return [row for row in rows if "trimmed" in row]


def still_valid(before, meta):
    """A function that says of a row of `before` whether it was measured as `meta` wants it."""
    old, new = (dict(m.get("conditions", {})) for m in (before, meta))
    scenes = [conditions.pop("scenes", {}) for conditions in (old, new)]

    def valid(row):
        keys = [table.get(row["scene"]) for table in scenes]
        return old == new and keys[0] == keys[1]

    return valid


class Journal:
    """The rows so far of a run, on disk; those of other conditions than now are left out."""

    def __init__(self, path, meta, fresh=False):
        self.path, self.meta, self.rows = path, meta, []
        if path.exists() and not fresh:
            before, rows = read(path)
            valid = still_valid(before, meta)
            # What failed is tried again.
            self.rows = [row for row in pictures(rows) if valid(row)]
        write(path, self.meta, self.rows)

    def add(self, rows):
        self.rows += rows
        with self.path.open("a", encoding="utf-8") as file:
            file.write("".join(row_line(row) for row in rows))
            file.flush()

    def has(self, scene, engine, seed):
        """Budgets that are there."""
        return {row["budget"] for row in self.rows if "trimmed" in row and row["seed"] == seed
                and row["scene"] == scene and row["engine"] == engine}
