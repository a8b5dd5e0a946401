"""clang-tidy over the project's sources, two at a time, skipping what has passed before.

    tidy.py --budget SECONDS --cache FOLDER [FILE...]

A file counts as seen when its preprocessed text and every .clang-tidy above it are the same as when
it passed.
Files left over when the time is up are reported as skipped.
"""

import argparse
import hashlib
import json
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build/release"


def compile_commands():
    """Source file -> command line, of what belongs to us."""
    table = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        path = Path(entry["file"])
        if path.is_relative_to(ROOT) and "build" not in path.relative_to(ROOT).parts:
            table[path] = shlex.split(entry["command"])
    return table


def fingerprint(command, path):
    """Of everything the result depends on; line numbers and folders do not count."""
    arguments = [word for word in command if word not in ("-c",) and not word.endswith("ccache")]
    if "-o" in arguments:
        at = arguments.index("-o")
        del arguments[at:at + 2]
    for option in ("-MT", "-MF"):
        if option in arguments:
            at = arguments.index(option)
            del arguments[at:at + 2]
    arguments = [word for word in arguments if word != "-MD"]
    text = subprocess.run([*arguments, "-E", "-P", "-C"], capture_output=True, check=False).stdout
    text = text.replace(str(ROOT).encode(), b"")
    settings = b"".join((folder / ".clang-tidy").read_bytes()
                        for folder in (ROOT, ROOT / "tests")
                        if path.is_relative_to(folder) and (folder / ".clang-tidy").exists())
    name = path.relative_to(ROOT).as_posix().encode()
    return hashlib.sha256(b"\0".join((name, settings, text))).hexdigest()


def look_at(path, command, cache, deadline):
    """One of passed, failed, skipped, and what clang-tidy said."""
    stamp = cache / fingerprint(command, path)
    if stamp.exists():
        return "passed", ""
    if time.monotonic() > deadline:
        return "skipped", ""
    done = subprocess.run(["clang-tidy", "--quiet", "-p", str(BUILD), str(path)],
                          capture_output=True, text=True, check=False)
    if done.returncode == 0:
        stamp.touch()
        return "passed", ""
    return "failed", done.stdout + "\n".join(done.stderr.splitlines()[-3:])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--budget", type=float, default=600)
    parser.add_argument("--cache", type=Path, default=ROOT / "build/tidy")
    parser.add_argument("files", nargs="*", type=Path)
    options = parser.parse_args()
    options.cache.mkdir(parents=True, exist_ok=True)
    table = compile_commands()
    wanted = [path.resolve() for path in options.files] or sorted(table)
    deadline = time.monotonic() + options.budget
    with ThreadPoolExecutor(2) as pool:
        results = pool.map(
            lambda path: look_at(path, table[path], options.cache, deadline), wanted)
        counts = {"passed": 0, "failed": 0, "skipped": 0}
        for path, (outcome, said) in zip(wanted, results, strict=True):
            counts[outcome] += 1
            if outcome == "failed":
                print(f"FAILED {path.relative_to(ROOT)}\n{said}", flush=True)
    print(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped")
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
