"""The attacks of tests/stress: runs programs that say `STRESS what|cases|worst|bar`, and tells all.

A program that ends badly is a row of its own, so that nothing is lost in silence.
"""

from __future__ import annotations

import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NATIVE = ROOT / "build" / "release" / "tests" / "native"
CLI = ROOT / "build" / "release" / "native" / "pharos-cli"
LOGS = ROOT / "build" / "stress"
FUZZERS = ("dump", "scene", "program", "image", "state")
NUMBERS = {
    "film": "Film.AMillion*",
    "geometry": "*Scale.*:Watertight.*",
    "camera": "Camera.Any*",
    "image": "Texture.Any*",
    "lights": "Lights.Any*",
    "guiding": "Mixture.Any*:Vmf.PdfError*:Field.Attacks*",
    "materials": "Robustness.Million*:ProgramCompile.Random*",
    "session": "Scaling.*:WelchStatistics.Huge*",
}


class Table:
    """Rows as they come; each is printed at once."""

    def __init__(self):
        self.broken = 0

    def add(self, attack: str, what: str, cases: str, worst: float, bar: float) -> None:
        kept = worst <= bar
        self.broken += not kept
        print(f"{attack:8} {what:66} {cases:>10} {worst:>10.3g} {bar:>8.3g} "
              f"{'' if kept else 'BROKEN'}", flush=True)

    def take(self, attack: str, text: str) -> int:
        rows = [line[7:] for line in text.splitlines() if line.startswith("STRESS ")]
        for row in rows:
            what, cases, worst, bar = row.split("|")
            self.add(attack, what, cases, float(worst), float(bar))
        return len(rows)


def finish(log: str, command: list, timeout: float, variables: dict | None = None) -> tuple:
    """What a program said, kept as a log, and how it ended."""
    try:
        done = subprocess.run(
            [str(word) for word in command], env={**os.environ, **(variables or {})},
            timeout=timeout, capture_output=True, text=True, errors="replace", check=False,
            start_new_session=True)
        text, code = done.stdout + done.stderr, done.returncode
    except subprocess.TimeoutExpired as expired:
        text = "".join(part.decode(errors="replace") for part in (expired.stdout, expired.stderr)
                       if part)
        code = "no end"
    (LOGS / f"{log}.log").write_text(text, encoding="utf-8")
    return text, code


def run(table: Table, attack: str, name: str, command: list, timeout: float, **variables) -> None:
    """A program's rows; one more where it failed or said nothing."""
    text, code = finish(f"{attack}_{name}", command, timeout, variables)
    if table.take(attack, text) == 0 or code != 0:
        table.add(attack, f"{name}: ended with {code}", "1", 0 if code == 0 else 1, 0)


def tests_row(table: Table, attack: str, what: str, command: list, timeout: float = 600) -> None:
    """A row of a program that counts its tests, ours or GoogleTest's."""
    text, code = finish(f"{attack}_{what.split()[0].strip(',:')}", command, timeout)
    passed, failed = (
        int(found[-1]) if (found := re.findall(pattern, text, re.MULTILINE)) else 0
        for pattern in (r"(?:PASSED  \] )?(\d+) (?:passed|tests?\.$)", r"(\d+) (?:failed|FAILED)"))
    wrong = max(failed, int(code != 0 or passed == 0))
    table.add(attack, f"{what}: tests that fail", str(passed + failed), wrong, 0)


def gtest(table: Table, attack: str, module: str, tests: str, **variables) -> None:
    command = [NATIVE / f"{module}_test", f"--gtest_filter={tests}", "--gtest_brief=1"]
    run(table, attack, module, command, 1500, **variables)


def numbers(table: Table) -> None:
    for module, tests in NUMBERS.items():
        gtest(table, "numbers", module, tests, PHAROS_LONG_TESTS="1")


def kills(table: Table) -> None:
    gtest(table, "kills", "session", "Checkpoint.Survives*:Checkpoint.Resumed*",
          PHAROS_KILLS="100")


def shards(table: Table) -> None:
    gtest(table, "shards", "session", "Shards.*", PHAROS_LONG_TESTS="1")
    if shutil.which("slurmctld", path=f"{os.environ['PATH']}:/usr/sbin"):
        tests_row(table, "shards", "Slurm's job arrays", ["bash", ROOT / "tests" / "slurm.sh"])


def sizes(table: Table) -> None:
    gtest(table, "sizes", "session", "LargeScenes.*", PHAROS_LONG_TESTS="1")
    blender_script(table, "sizes", "test_sizes.py", PHAROS_LONG_TESTS="1")


def many(table: Table) -> None:
    gtest(table, "many", "lights", "ManyLights.*")
    gtest(table, "many", "session", "ManyLights.*")


def cancel(table: Table) -> None:
    gtest(table, "cancel", "session", "Cancel.*", PHAROS_LONG_TESTS="1")
    blender_script(table, "cancel", "test_cancel.py", PHAROS_LONG_TESTS="1")
    with tempfile.TemporaryDirectory() as name:
        interrupt_programs(table, Path(name), 40)


def _process_seconds(pid: int) -> float:
    """CPU time of a process so far, to a hundredth of a second."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _hear_interrupts() -> None:
    """What a shell starts in the background ignores them."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def interrupt_programs(table: Table, folder: Path, cases: int) -> None:
    """pharos-cli by SIGINT anywhere between its start and its end, the writing of its files too."""
    scene, rng = write_scene(folder), random.Random(11)
    command = [str(word) for word in (
        CLI, "render", scene, "-o", folder / "x.exr", "--samples", "16", "--threads", "2",
        "--checkpoint", folder / "kept", "--checkpoint-interval", "0")]
    began = time.monotonic()
    subprocess.run(command, check=True, capture_output=True)
    whole = time.monotonic() - began
    seconds, wrong, pictures = [], 0, 0
    for _ in range(cases):
        for file in folder.glob("[xk]*"):
            file.unlink()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   preexec_fn=_hear_interrupts)
        time.sleep(rng.uniform(0.0, 1.1 * whole))
        asked = time.monotonic()
        before = _children_seconds() + _process_seconds(process.pid)
        process.send_signal(signal.SIGINT)
        code = process.wait(60)
        # What other programs took does not count.
        seconds.append(min(time.monotonic() - asked, _children_seconds() - before))
        picture = (folder / "x.exr").exists()
        pictures += picture
        readable = not picture or subprocess.run(
            ["oiiotool", "--stats", folder / "x.exr"], capture_output=True, check=False
        ).returncode == 0
        # Before its signals are caught the program ends as any other.
        expected = (0, 130) if picture else (130, -signal.SIGINT)
        wrong += code not in expected or not readable or any(folder.glob("*.part"))
    seconds.sort()
    what = "SIGINT to pharos-cli at random moments"
    table.add("cancel", f"{what}: p95 seconds", str(cases), seconds[cases * 95 // 100], 0.25)
    table.add("cancel", f"{what}: worst seconds", str(cases), seconds[-1], 1.0)
    table.add("cancel", f"torn pictures, wrong codes, parts left (pictures: {pictures})",
              str(cases), wrong, 0)


def blender_script(table: Table, attack: str, script: str, **variables) -> None:
    """In Blender itself, not through run_all.py, whose lines are its own."""
    path = ROOT / "tests" / "blender" / script
    start = (f"import sys; sys.path.insert(0, {str(path.parent)!r}); "
             f"exec(compile(open({str(path)!r}).read(), {str(path)!r}, 'exec'), "
             f"{{'__name__': '__main__'}})")
    command = [os.environ["BLENDER"], "-b", "--factory-startup", "-Y", "--python-exit-code", "3",
               "--python-expr", start]
    run(table, attack, script.removesuffix(".py"), command, 1500, **variables)


def window_script(table: Table, attack: str, script: str) -> None:
    """In a window, as run_all.py starts it."""
    command = ["/usr/bin/python3", "-c", (
        f"import sys; sys.path.insert(0, {str(ROOT / 'tests' / 'blender')!r}); import run_all; "
        "from pathlib import Path; import subprocess; env = run_all.environment(); "
        f"sys.exit(subprocess.run(run_all.command('window', Path(run_all.HERE / {script!r}), env), "
        "env=env).returncode)")]
    run(table, attack, script.removesuffix(".py"), command, 600)


def soak(table: Table) -> None:
    blender_script(table, "soak", "test_soak.py", PHAROS_SOAK="1")
    blender_script(table, "soak", "test_float_state.py")
    blender_script(table, "soak", "test_robustness.py")
    window_script(table, "soak", "test_interruptions.py")


def write_scene(folder: Path, name: str = "scene.pharos", **variables: str) -> Path:
    path = folder / name
    subprocess.run([NATIVE / "session_test", "--gtest_filter=Scripts.TakeADumpFromHere"],
                   env={**os.environ, "PHAROS_WRITE_DUMP": str(path), **variables}, check=True,
                   capture_output=True)
    return path


def limited(gigabytes: float):
    def limit() -> None:
        size = int(gigabytes * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (size, size))
    return limit


_MEMORY_SCENE = """
import sys, os, time; sys.path.insert(0, {tests!r})
import resource, bpy, harness
harness.enable_addon()
def card(side):
    scene = harness.new_scene(side, side, 1)
    harness.add_camera()
    harness.add_object(harness.plane_mesh(half=10.0), harness.emission((0.2, 0.4, 0.6)))
card(64)
used = int(open('/proc/self/statm').read().split()[0]) * 4096
resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), used + (1 << 30)))
card(16384)
began = time.monotonic()
try:
    bpy.ops.render.render()
    message = ''
except RuntimeError as error:
    message = str(error)
seconds = time.monotonic() - began
card(32)
alive = harness.close(harness.render()[..., :3], (0.2, 0.4, 0.6), 1e-5)
harness.say(f'STRESS Blender under ulimit -v, 16k x 16k: seconds to the message|1|{{seconds}}|5')
wrong = int('Out of memory' not in message) + int(not alive)
harness.say(f'STRESS its message is none, or the next render wrong|2|{{wrong}}|0')
os._exit(0)
"""


def _naps_until_end(process: subprocess.Popen, most: float) -> float:
    """Seconds by naps, which do not count where the machine stands still; killed after `most`."""
    naps = 0
    while process.poll() is None:
        time.sleep(0.02)
        naps += 1
        if 0.02 * naps > most:
            process.kill()
            process.wait()
    return 0.02 * naps


def _children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _starts(gigabytes: float) -> bool:
    """Whether the libraries load: some start threads before main, and none of it is ours."""
    return subprocess.run([CLI, "--help"], preexec_fn=limited(gigabytes), capture_output=True,
                          check=False).returncode == 0


def sweep_limits(table: Table, folder: Path, cases: int) -> None:
    """Two million triangles: what a limit stops is now the file, now the structure over it."""
    scene = write_scene(folder, PHAROS_DUMP_RINGS="1000")
    least = next(0.3 + 0.01 * step for step in range(100) if _starts(0.3 + 0.01 * step))
    wrong, refused, slowest = [], 0, 0.0
    for case in range(cases):
        limit = least + case / cases
        before = _children_seconds()
        process = subprocess.Popen(
            [CLI, "render", scene, "-o", folder / "x.exr", "--threads", "1", "--samples", "1"],
            preexec_fn=limited(limit), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        naps = _naps_until_end(process, 30.0)
        # What other programs took does not count; who hangs is killed, and has no message.
        seconds = min(naps, _children_seconds() - before)
        says_so = b"memory" in process.stderr.read()
        # Either it fits or it says that it does not.
        if process.returncode not in (0, 4) or (process.returncode == 4) != says_so:
            wrong.append(f"{limit:.3f}: {process.returncode}")
        if process.returncode != 0:
            refused += 1
            slowest = max(slowest, seconds)
    table.add("memory", f"pharos-cli under ulimit -v: no picture, no message {wrong or ''}",
              str(cases), len(wrong), 0)
    table.add("memory", "seconds to its message", str(refused), slowest, 5)


def memory(table: Table) -> None:
    """A picture that does not fit into what the process may take."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sweep_limits(table, folder, 60)
        script = folder / "memory.py"
        script.write_text(_MEMORY_SCENE.format(tests=str(ROOT / "tests" / "blender")),
                          encoding="utf-8")
        run(table, "memory", "blender", [os.environ["BLENDER"], "-b", "--factory-startup", "-Y",
                                         "--python-exit-code", "3", "--python", script], 120)


def _wait_for_handler(pid: int, number: int) -> None:
    """Loading the libraries takes a second; only then the program catches signals itself."""
    for _ in range(200):
        time.sleep(0.1)
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
        caught = next(line for line in status.splitlines() if line.startswith("SigCgt"))
        if int(caught.split()[1], 16) >> (number - 1) & 1:
            time.sleep(0.5)
            return


def _code(*arguments, cut_by: int = 0) -> int:
    process = subprocess.Popen([str(word) for word in (CLI, *arguments)],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if cut_by:
        _wait_for_handler(process.pid, cut_by)
        process.send_signal(cut_by)
    return process.wait(60)


def exits(table: Table) -> None:
    """Exit codes, each as the README says."""
    with tempfile.TemporaryDirectory() as name:
        scene, out = write_scene(Path(name)), Path(name) / "out.exr"
        broken = Path(name) / "broken.pharos"
        broken.write_bytes(scene.read_bytes()[:-100])
        lost = write_scene(Path(name), "lost.pharos", PHAROS_DUMP_IMAGE="/nowhere/x.png")
        forever = ("--samples", "10000000")
        cases = (
            (0, (scene, "-o", out)),
            (1, (broken, "-o", out)),
            (1, ("/nowhere", "-o", out)),
            (2, (scene, "-o", out, "--no-such", "1")),
            (2, (scene, "-o", out, "--samples", "x")),
            (0, (lost, "-o", out)),
            (3, (lost, "-o", out, "--strict")),
            (5, (scene, "-o", "/nowhere/x.exr")),
            (130, (scene, "-o", out, *forever)),
            (143, (scene, "-o", out, *forever)),
        )
        signals = {130: signal.SIGINT, 143: signal.SIGTERM}
        wrong = []
        for expected, arguments in cases:
            code = _code("render", *arguments, cut_by=signals.get(expected, 0))
            if code != expected:
                wrong.append(f"{code} for {expected}")
        table.add("exits", f"exit codes that are others {wrong or ''}", str(len(cases)),
                  len(wrong), 0)
    tests_row(table, "exits", "codes and signals of scenes/render",
              ["bash", ROOT / "tests" / "render_command.sh"], 1200)


SECURITY = (
    ("image", "files that are none, sizes, bombs, links",
     "ImageIo.*Refused*:ImageIo.Writing*:ImageIo.Bytes*:ImageIo.TheName*:ImageIo.*NeverCrash"),
    ("core", "damage at every byte, links", "StateFile.*:AtomicFile.*"),
    ("guiding", "weights cut, damaged, of another network", "Field.BrokenFiles*"),
    ("scene", "dumps cut, damaged, counts beyond the end", "Dump.*"),
)


def security(table: Table) -> None:
    """What files may say. That nothing of a .blend is run or written: `exits`."""
    for module, what, tests in SECURITY:
        tests_row(table, "security", f"{module}: {what}",
                  [NATIVE / f"{module}_test", f"--gtest_filter={tests}"])
    tests_row(table, "security", "add-on: no code, no pickles, no shell; scripts stay off",
              [ROOT / "build" / "bpy" / "bin" / "python", "-m", "pytest",
               ROOT / "tests" / "python" / "test_hygiene.py", "-k", "runs or scripts"])


def scenes(table: Table) -> None:
    """Dropped samples over the project's own scenes."""
    with tempfile.TemporaryDirectory() as name:
        files = sorted((ROOT / "scenes").glob("*.blend"))
        dropped, looked = 0, 0
        for file in files:
            dump, stats = Path(name) / f"{file.stem}.pharos", Path(name) / "stats.json"
            subprocess.run([os.environ["BLENDER"], "-b", "--factory-startup", "-Y", "--addons",
                            "pharos", file, "--", "--pharos-dump", dump], check=False,
                           capture_output=True, timeout=120)
            for guiding in ("off", "neural", "slides"):
                done = subprocess.run(
                    [CLI, "render", dump, "-o", Path(name) / "x.exr", "--samples", "8",
                     "--guiding", guiding, "--stats-json", stats], capture_output=True,
                    check=False, timeout=600)
                looked += 1
                text = stats.read_text(encoding="utf-8") if done.returncode == 0 else ""
                dropped += not text or '"nonfinite_samples": 0,' not in text
        table.add("scenes", "renders of our scenes with samples that are no numbers", str(looked),
                  dropped, 0)


def fuzz(table: Table, seconds: int) -> None:
    for name in FUZZERS:
        corpus = LOGS / f"corpus_{name}"
        shutil.rmtree(corpus, ignore_errors=True)
        corpus.mkdir(parents=True)
        command = [ROOT / "build" / "fuzz" / "tests" / "fuzz" / f"fuzz_{name}",
                   f"-max_total_time={seconds}", "-len_control=0", "-rss_limit_mb=4096",
                   "-timeout=25",
                   "-print_final_stats=1", f"-artifact_prefix={LOGS}/{name}_", corpus]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                              errors="replace", check=False, timeout=seconds + 300,
                              env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})
        (LOGS / f"fuzz_{name}.log").write_text(done.stderr, encoding="utf-8")
        runs = [line.split()[-1] for line in done.stderr.splitlines()
                if line.startswith("stat::number_of_executed_units")]
        table.add("fuzz", f"{name}, {seconds} s: findings", runs[0] if runs else "?",
                  int(done.returncode != 0), 0)


ATTACKS = {f.__name__: f for f in (numbers, kills, shards, sizes, many, cancel, soak, memory,
                                   exits, scenes, security)}


def main() -> int:
    chosen = sys.argv[1:]
    unknown = [name for name in chosen if name not in (*ATTACKS, "fuzz")]
    if unknown:
        print(f"no attack {unknown[0]}; there are: {' '.join(ATTACKS)} fuzz", file=sys.stderr)
        return 2
    table = Table()
    print(f"{'attack':8} {'what was tried':66} {'cases':>10} {'worst':>10} {'bar':>8}", flush=True)
    began = time.monotonic()
    for name in chosen or ATTACKS:
        if name != "fuzz":
            ATTACKS[name](table)
    if not chosen or "fuzz" in chosen:
        fuzz(table, int(os.environ.get("FUZZ_SECONDS", "600" if chosen else "60")))
    print(f"{table.broken} broken, {(time.monotonic() - began) / 60:.0f} minutes", flush=True)
    return 1 if table.broken else 0


if __name__ == "__main__":
    sys.exit(main())
