"""Modules of native/ include only what lies below them, and libraries stay where they belong."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NATIVE = ROOT / "native"

_LOWER = "core sampling image geometry"
ALLOWED = {
    "core": "",
    "sampling": "core",
    "image": "core",
    "geometry": "core",
    "camera": "core sampling",
    "film": "core sampling image",
    "guiding": "core sampling",
    "materials": _LOWER,
    "lights": _LOWER,
    "scene": f"{_LOWER} camera film guiding materials lights",
    "integrator": f"{_LOWER} camera film guiding materials lights scene",
    "session": f"{_LOWER} camera film guiding materials lights scene integrator",
}
EVERYTHING = " ".join(ALLOWED) + " session"
for program in ("bindings", "cli", "bench"):
    ALLOWED[program] = EVERYTHING
ALLOWED["bench"] += " support"  # the unit tests' builders of scenes

# A library and the only places that may know it.
HOMES = {
    # The bench compares with a bare loop over the same rays.
    r"<embree\d?/": {
        "geometry/accelerator.cpp",
        "geometry/embree_build.cpp",
        "geometry/embree_build.h",
        "bench/accelerator_bench.cpp",
    },
    r"<OpenImageIO/": {"image/image_io.cpp"},
    r"<pybind11/": {"bindings/"},
    r"<hwy/": {"guiding/", "bench/"},
    r"<benchmark/": {"bench/"},
}
PRINTING = r"#include <(iostream|print)>|std::(cout|cerr|clog)|\b(printf|puts|fputs|perror)\("
MAY_PRINT = ("cli/", "bench/", "core/check.")  # a failed CHECK says what it saw


def sources():
    for path in sorted(NATIVE.rglob("*")):
        if path.suffix in (".h", ".cpp"):
            yield path.relative_to(NATIVE).as_posix(), path.read_text(encoding="utf-8")


def test_every_folder_has_a_place_in_the_layering():
    folders = {path.name for path in NATIVE.iterdir() if path.is_dir()}
    assert folders <= set(ALLOWED), folders - set(ALLOWED)


def test_includes_point_downwards():
    wrong = []
    for name, text in sources():
        folder = name.split("/")[0]
        wrong += [f"{name}: {folder} must not include {target}"
                  for target in re.findall(r'#include "(\w+)/', text)
                  if target != folder and target not in ALLOWED[folder].split()]
    assert not wrong, "\n".join(wrong)


def test_the_build_links_what_the_layering_allows():
    text = (NATIVE / "CMakeLists.txt").read_text(encoding="utf-8")
    modules = re.findall(r"pharos_module\((\w+)([^)]*)\)", text)
    assert {name for name, _ in modules} == set(ALLOWED) - {"bindings", "cli", "bench"}
    for name, rest in modules:
        used = set(rest.split("USES")[1].split()) if "USES" in rest else set()
        assert used <= set(ALLOWED[name].split()), f"{name} links {used}"


def test_libraries_stay_in_their_files():
    wrong = []
    for name, text in sources():
        for pattern, homes in HOMES.items():
            if re.search(r"#include " + pattern, text) and not name.startswith(tuple(homes)):
                wrong.append(f"{name} includes {pattern}")
    assert not wrong, "\n".join(wrong)


def test_libraries_do_not_print():
    printing = [name for name, text in sources()
                if re.search(PRINTING, text) and not name.startswith(MAY_PRINT)]
    assert not printing, printing


def test_a_wrong_include_would_be_found():
    assert "scene" not in ALLOWED["guiding"].split()
    assert re.findall(r'#include "(\w+)/', '#include "scene/scene.h"') == ["scene"]
