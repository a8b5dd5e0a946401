"""What is measured: scenes, engines and the conditions that are equal for all of them."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SHARED = ROOT.parent / "shared" / "scenes"
BOUNCES = 12


@dataclass(frozen=True)
class Scene:
    """A .blend file at one resolution."""

    name: str
    file: Path
    resolution: tuple[int, int]

    def key(self):
        """Changes whenever a reference picture would."""
        content = hashlib.sha256(self.file.read_bytes()).hexdigest()[:16]
        conditions = json.dumps([content, self.resolution, BOUNCES])
        return hashlib.sha256(conditions.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Engine:
    """A renderer with the options that make it a contestant."""

    name: str
    program: str  # "cycles" or "pharos"
    options: dict = field(default_factory=dict, hash=False)
    reference: str = ""  # engines that share this name share their reference


def all_scenes():
    own = [Scene(name, ROOT / "scenes" / f"{name}.blend", (256, 256))
           for name in ("cornell", "door", "lamp", "furnace", "outdoor", "glass")]
    shared = [Scene(f"{name}{suffix}", SHARED / f"{name}.blend", size)
              for name in ("veach_ajar", "contemporary_bathroom")
              for suffix, size in (("", (320, 240)), ("@128", (128, 96)))]
    return {scene.name: scene for scene in own + shared if scene.file.exists()}


def all_engines():
    return {engine.name: engine for engine in (
        Engine("pharos", "pharos", {"guiding": "NEURAL"}, "pharos"),
        Engine("pharos-off", "pharos", {"guiding": "OFF"}, "pharos"),
        Engine("pharos-slides", "pharos", {"guiding": "SLIDES"}, "pharos"),
        Engine("pharos-slides-position", "pharos", {"guiding": "SLIDES-POSITION"}, "pharos"),
        Engine("cycles", "cycles", {"guiding": False}, "cycles"),
        Engine("cycles-guided", "cycles", {"guiding": True}, "cycles"),
    )}
