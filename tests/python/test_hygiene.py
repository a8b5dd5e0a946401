"""What no compiler looks at: sizes of files and functions, marks left behind, what is exported."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAX_LINES = 600
MAX_FUNCTION_LINES = 80
MAX_BYTES = 1_000_000
TOP_LEVEL = {"CMakeLists.txt", "native", "addon", "scenes", "tests", "README.md", "LICENSE",
             "CMakePresets.json", "pyproject.toml"}
TEXT = {".py", ".h", ".cpp", ".sh", ".txt", ".md", ".json", ".toml", ".map", ""}
MARKS = "|".join(("TO" + "DO", "FIX" + "ME", "XX" + "X", "HA" + "CK", "NotImplemented" + "Error"))
MACHINE_PATHS = "|".join(f"/{folder}/" for folder in ("work", "farm", "root", "home", "Users"))


def tracked():
    """Files of the repository, or of the folder where there is no git."""
    done = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True,
                          text=True, check=False)
    names = done.stdout.split("\0") if done.returncode == 0 else [
        path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*")
        if "build" not in path.parts and ".git" not in path.parts]
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


def texts():
    for path in tracked():
        if path.suffix in TEXT and path.name != "LICENSE":
            yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


def test_top_level_is_what_the_design_lists():
    found = {path.relative_to(ROOT).parts[0] for path in tracked()}
    assert {name for name in found if not name.startswith(".")} <= TOP_LEVEL


def test_files_are_short():
    long = [f"{name}: {text.count(chr(10))}" for name, text in texts()
            if text.count("\n") > MAX_LINES and name.endswith((".h", ".cpp", ".py", ".sh"))]
    assert not long, long


def test_files_are_small():
    big = [str(path) for path in tracked() if path.stat().st_size >= MAX_BYTES]
    assert not big, big


def test_python_functions_are_short():
    long = []
    for name, text in texts():
        if name.endswith(".py"):
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    lines = node.end_lineno - node.lineno + 1
                    if lines > MAX_FUNCTION_LINES:
                        long.append(f"{name}: {node.name} has {lines} lines")
    assert not long, long


def test_no_marks_of_unfinished_work():
    found = [f"{name}:{number}: {line.strip()}" for name, text in texts()
             for number, line in enumerate(text.splitlines(), 1)
             if re.search(rf"\b({MARKS})\b", line)]
    assert not found, found


def test_no_paths_of_one_machine():
    found = [f"{name}:{number}: {line.strip()}" for name, text in texts()
             for number, line in enumerate(text.splitlines(), 1)
             if re.search(rf"(?<![\w.])({MACHINE_PATHS})", line)]
    assert not found, found


def test_addon_does_not_print():
    calls = [f"{name}:{node.lineno}" for name, text in texts()
             if name.startswith("addon/") and name.endswith(".py")
             for node in ast.walk(ast.parse(text))
             if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print"]
    assert not calls, calls


_RUNS_CODE = {"eval", "exec", "compile", "__import__", "execfile", "system", "popen"}
_LOADS_CODE = {"pickle", "marshal", "shelve", "dill", "runpy", "code"}


def calls_and_imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func
            yield node, getattr(function, "id", getattr(function, "attr", ""))
        elif isinstance(node, ast.Import):
            yield from ((node, alias.name.split(".")[0]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node, (node.module or "").split(".")[0]


def test_addon_runs_nothing_that_a_file_says():
    """No text becomes code, nothing is unpickled, no words go to a shell."""
    found = []
    for name, text in texts():
        if not (name.startswith("addon/") and name.endswith(".py")):
            continue
        for node, word in calls_and_imports(ast.parse(text)):
            shell = any(k.arg == "shell" for k in getattr(node, "keywords", ()))
            if shell or word in _LOADS_CODE or (
                    word in _RUNS_CODE and not is_regular_expression(node)):
                found.append(f"{name}:{node.lineno}: {word}")
    assert not found, found


def is_regular_expression(node):
    """re.compile()."""
    owner = getattr(getattr(node, "func", None), "value", None)
    return getattr(owner, "id", "") == "re"


def test_scripts_in_files_stay_off():
    """Wherever a Blender is started, auto-run is switched off in so many letters."""
    loose, seen = [], 0
    for name, text in texts():
        # The one place that shows what else would happen.
        text = text.replace('"$BLENDER" -b --factory-startup -y --addons', "")
        if name.endswith(".md") or name == "tests/python/test_hygiene.py":
            continue
        for found in re.finditer(r"--factory-startup", text):
            seen += 1
            if not re.match(r"""\W{1,20}(-Y|"-y" if trusted else "-Y")""", text[found.end():][:60]):
                loose.append(f"{name}: {text[found.start():][:60]!r}")
    assert seen >= 10
    assert not loose, loose


def test_no_fast_math():
    flags = [name for name, text in texts()
             if name.endswith(("CMakeLists.txt", ".cmake", "CMakePresets.json"))
             and re.search(r"-ffast-math|-Ofast", text)]
    assert not flags, flags


def test_commands_can_be_run():
    for name in ("scenes/render", "scenes/build", "tests/run", "tests/welch",
                 "tests/benchmark/run", "tests/benchmark/slides", "tests/benchmark/viewport",
                 "tests/fuzz_edits", ".ci/run"):
        assert (ROOT / name).stat().st_mode & 0o111, f"{name} has no run bit"


def native_modules():
    return sorted((ROOT / "build/release/native").glob("_native.*.so"))


@pytest.mark.skipif(not native_modules(), reason="the native module is not built")
def test_native_module_exports_only_its_entry():
    for module in native_modules():
        said = subprocess.run(["nm", "-D", "--defined-only", str(module)], capture_output=True,
                              text=True, check=True).stdout
        names = [line.split()[-1] for line in said.splitlines()]
        assert names and all(name.startswith("PyInit_") for name in names), names


def test_version_is_one():
    version = re.search(r"project\(pharos VERSION (\d+)\.(\d+)\.(\d+)",
                        (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).groups()
    info = re.search(r'"version": \((\d+), (\d+), (\d+)\)',
                     (ROOT / "addon/pharos/__init__.py").read_text(encoding="utf-8")).groups()
    assert version == info


def test_readme_names_only_what_is_there():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    names = re.findall(r"`((?:native|addon|scenes|tests)/[\w./-]*)`", text)
    names += re.findall(r"^((?:scenes|tests)/[\w/]+)", text, re.MULTILINE)
    names += re.findall(r"\]\(([\w./]+)\)", text)
    missing = sorted({name for name in names if not (ROOT / name).exists()})
    assert len(names) > 10
    assert not missing, missing


def test_readme_names_only_settings_that_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.split("| setting (`scene.pharos`)", 1)[1].split("\n\n", 1)[0]
    properties = (ROOT / "addon/pharos/properties.py").read_text(encoding="utf-8")
    names = [name for line in table.splitlines()[2:]
             for name in re.findall(r"`([a-z_]+)`", line.split("|")[1])]
    missing = [name for name in names if f"    {name}: " not in properties]
    assert len(names) >= 8
    assert not missing, missing
