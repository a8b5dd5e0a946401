"""Blender started as programs start it: progress lines, dumps by argument, signals, exit codes."""
# hosts: driver

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

FOLDER = Path(tempfile.mkdtemp(prefix="pharos_test_"))
BLENDER = os.environ["BLENDER"]
_SCENE = f"""
import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})
import bpy, harness
harness.enable_addon()
scene = harness.new_scene(320, 240, int(sys.argv[-1]))
harness.add_camera()
harness.add_object(harness.plane_mesh(half=10.0), harness.emission((0.18, 0.18, 0.18)))
if sys.argv[-2] == "no_camera":
    scene.camera = None
scene.pharos.use_checkpoint = sys.argv[-2] == "checkpoint"
scene.pharos.guiding = "NEURAL" if sys.argv[-2] == "checkpoint" else "OFF"
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-3])
"""


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def make_scene(name: str, samples: int, kind: str = "plain") -> Path:
    path = FOLDER / f"{name}.blend"
    script = FOLDER / "make.py"
    script.write_text(_SCENE, encoding="utf-8")
    subprocess.run(
        [
            BLENDER,
            "-b",
            "--factory-startup",
            "-Y",
            "--python-exit-code",
            "3",
            "--python",
            str(script),
            "--",
            str(path),
            kind,
            str(samples),
        ],
        check=True,
        capture_output=True,
        timeout=120,
    )
    return path


def start(scene: Path, *arguments: str, **variables: str) -> subprocess.Popen:
    env = {**os.environ, "PHAROS_PROGRESS": "1", **variables}
    command = [BLENDER, "-b", "--factory-startup", "-Y", "--addons", "pharos"]
    return subprocess.Popen(
        [*command, str(scene), *arguments],
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


_LINE = re.compile(
    r"^pharos: (\d+) % (\d+)/(\d+) samples [\d.]+ s left noise [\d.e+-]+$", re.MULTILINE
)


def test_progress_lines_and_exit_code():
    scene = make_scene("short", 8)
    process = start(scene, "-o", str(FOLDER / "short_####"), "-F", "OPEN_EXR", "-x", "1", "-f", "1")
    text, _ = process.communicate(timeout=120)
    assert process.returncode == 0, text
    lines = _LINE.findall(text)
    assert lines and lines[-1] == ("100", "8", "8"), text
    assert (FOLDER / "short_0001.exr").exists()


def test_no_camera_fails():
    process = start(make_scene("blind", 8, "no_camera"), "-o", str(FOLDER / "blind_"), "-f", "1")
    text, _ = process.communicate(timeout=120)
    assert process.returncode != 0 and "camera" in text.lower(), (process.returncode, text)


def test_dump_by_argument_alone():
    dump = FOLDER / "scene.pharos"
    process = start(make_scene("dumped", 8), "--", "--pharos-dump", str(dump))
    text, _ = process.communicate(timeout=120)
    assert process.returncode == 0 and dump.exists() and not _LINE.findall(text), text


def test_dump_beside_a_render():
    dump = FOLDER / "beside_##.pharos"
    output = str(FOLDER / "beside_####")
    process = start(
        make_scene("beside", 8),
        "-o",
        output,
        "-F",
        "OPEN_EXR",
        "-x",
        "1",
        "-f",
        "1",
        "--",
        "--pharos-dump",
        str(dump),
    )
    text, _ = process.communicate(timeout=120)
    assert process.returncode == 0 and (FOLDER / "beside_01.pharos").exists(), text
    assert (FOLDER / "beside_0001.exr").exists(), text


_SECONDS_TO_END = 10.0


def _interrupt(number: int) -> tuple[int, float, Path, str]:
    partial = FOLDER / f"partial_{number}.exr"
    partial.unlink(missing_ok=True)
    scene = make_scene("long", 1 << 20)
    process = start(scene, "-o", str(FOLDER / "long_"), "-f", "1", PHAROS_PARTIAL=str(partial))
    seen = ""
    for line in process.stdout:
        seen += line
        found = _LINE.match(line)
        if found and int(found.group(2)) > 0:
            break
    time.sleep(0.5)
    began = time.monotonic()
    process.send_signal(number)
    rest, _ = process.communicate(timeout=120)
    return process.returncode, time.monotonic() - began, partial, seen + rest


def _keeps_the_picture(number: int, codes: tuple[int, ...]) -> None:
    """The best of three times counts, as machines stall; everything else holds each time."""
    seconds = []
    while len(seconds) < 3 and (not seconds or seconds[-1] >= _SECONDS_TO_END):
        code, took, partial, text = _interrupt(number)
        assert code in codes and partial.exists(), (code, took, text[-2000:])
        seconds.append(took)
    say(f"MEASURED {signal.Signals(number).name} to end: {min(seconds):.2f} s")
    assert min(seconds) < _SECONDS_TO_END, seconds


def test_sigterm_keeps_the_picture():
    _keeps_the_picture(signal.SIGTERM, (143,))


def test_ctrl_c_keeps_the_picture():
    _keeps_the_picture(signal.SIGINT, (1, 130, -signal.SIGINT))


def _rendered(scene: Path, output: str, stop_at: int = 0) -> tuple[int, str]:
    """Exit code and text of an animation of one frame, ended by SIGTERM after so many samples."""
    process = start(scene, "-o", output, "-F", "OPEN_EXR", "-x", "1", "-s", "1", "-e", "1", "-a")
    seen = ""
    for line in process.stdout:
        seen += line
        found = _LINE.match(line)
        if stop_at and found and int(found.group(2)) >= stop_at:
            process.send_signal(signal.SIGTERM)
            stop_at = 0
    return process.wait(120), seen


def test_a_stopped_animation_goes_on_to_the_same_picture():
    scene = make_scene("kept", 48, "checkpoint")
    whole = FOLDER / "whole" / "frame_0001.exr"
    parts = FOLDER / "parts" / "frame_0001.exr"
    assert _rendered(scene, str(whole.parent / "frame_"))[0] == 0 and whole.exists()
    assert list(whole.parent.iterdir()) == [whole], "a checkpoint was left"
    for samples in (5, 20):
        code, text = _rendered(scene, str(parts.parent / "frame_"), samples)
        assert code == 143, text[-2000:]
        left = [path.name for path in parts.parent.iterdir()]
        assert left == ["frame_0001.ViewLayer.pharos_checkpoint"], left
    code, text = _rendered(scene, str(parts.parent / "frame_"))
    first = next(int(samples) for _, samples, _ in _LINE.findall(text) if int(samples) > 0)
    assert code == 0 and first >= 20, (code, first)
    assert list(parts.parent.iterdir()) == [parts], list(parts.parent.iterdir())
    compared = subprocess.run(
        ["oiiotool", "--diff", whole, parts], capture_output=True, text=True, check=False
    )
    assert compared.returncode == 0, compared.stdout


def main() -> int:
    failed = 0
    for name, function in list(globals().items()):
        if not name.startswith("test_"):
            continue
        try:
            function()
            say(f"PASS {name}")
        except Exception as error:
            failed += 1
            traceback.print_exc()
            say(f"FAIL {name}: {type(error).__name__}: {error}"[:500])
    return 1 if failed else 0


sys.exit(main())
