"""Builds the scenes named after `--` (without names: all) into this folder; for Blender 3.4.1.

    blender -b --factory-startup -Y --python-exit-code 3 -P scenes/build_scenes.py -- cornell door
"""

import importlib
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))
sys.dont_write_bytecode = True


def main(names):
    from builders import kit

    every = sorted(path.stem for path in (FOLDER / "builders").glob("*.py"))
    every = [name for name in every if name not in ("kit", "__init__")]
    for name in names or every:
        kit.clear()
        importlib.import_module(f"builders.{name}").build()
        kit.finish(str(FOLDER / f"{name}.blend"))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
