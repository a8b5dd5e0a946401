"""What is measured: scenes, engines and the conditions that are equal for all of them."""

import hashlib
import json
from dataclasses import dataclass, field
from functools import cache
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
    # Of the same file: its references give this scene's, by its middle and 2 x 2 pixels a pixel.
    larger: "Scene | None" = None

    def key(self):
        """Changes whenever a reference picture would."""
        conditions = json.dumps([_content(self.file), self.resolution, BOUNCES])
        return hashlib.sha256(conditions.encode()).hexdigest()[:16]

    @property
    def title(self):
        return self.name.split("@")[0]

    def cutouts(self):
        """Name -> (x0, y0, x1, y1) in pixels, from the top left corner."""
        width, height = self.resolution
        found = {}
        for name, (x0, y0, x1, y1) in CUTOUTS.get(self.title, {}).items():
            if self.larger:  # the middle of a square picture
                y0, y1 = ((y - 0.5) * width / height + 0.5 for y in (y0, y1))
            found[name] = (round(x0 * width), max(round(y0 * height), 0),
                           round(x1 * width), min(round(y1 * height), height))
        return found


@cache
def _content(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]


@dataclass(frozen=True)
class Engine:
    """A renderer with the options that make it a contestant."""

    name: str
    program: str  # a name in engines.PROGRAMS
    options: dict = field(default_factory=dict, hash=False)
    reference: str = ""  # engines that share this name share their reference


# Where one looks at a scene: fractions of its picture from the top left corner.
CUTOUTS = {
    "cornell": {"ceiling": (0.30, 0.13, 0.70, 0.21), "shade": (0.50, 0.62, 0.82, 0.86)},
    "door": {"near the light": (0.53, 0.60, 0.80, 0.80), "far from it": (0.16, 0.42, 0.48, 0.76),
             "glossy": (0.34, 0.49, 0.44, 0.61), "edges": (0.16, 0.52, 0.46, 0.64)},
    "lamp": {"near the light": (0.55, 0.48, 0.85, 0.70), "far from it": (0.00, 0.20, 0.18, 0.50),
             "glossy": (0.43, 0.62, 0.58, 0.78), "edges": (0.13, 0.44, 0.40, 0.62)},
    "furnace": {"mirror": (0.42, 0.40, 0.58, 0.60)},
    "outdoor": {"chrome": (0.54, 0.50, 0.72, 0.68), "pavement": (0.10, 0.66, 0.42, 0.78)},
    "glass": {"goblet": (0.10, 0.30, 0.30, 0.66), "caustic": (0.40, 0.60, 0.78, 0.76),
              "green head": (0.62, 0.36, 0.98, 0.66)},
    "veach_ajar": {"door": (0.64, 0.25, 0.90, 0.76), "table": (0.15, 0.58, 0.72, 0.86),
                   "picture": (0.29, 0.24, 0.57, 0.45)},
    "contemporary_bathroom": {"mirror": (0.56, 0.08, 0.80, 0.50), "tub": (0.00, 0.70, 0.35, 1.00),
                              "cabinet": (0.40, 0.55, 0.98, 0.85)},
}


def all_scenes():
    """Own scenes are square; their @128 form shows the middle, as sensors fit the longer side."""
    own = [Scene(name, ROOT / "scenes" / f"{name}.blend", (256, 256))
           for name in ("cornell", "door", "lamp", "furnace", "outdoor", "glass")]
    own += [Scene(f"{scene.name}@128", scene.file, (128, 96), scene) for scene in own]
    own += [Scene(name, ROOT / "scenes" / f"{name}.blend", (128, 128))
            for name in ("frosted", "gloss", "caustic")]
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
        # What parts of the guide are worth: the first in `frosted`, the second in `gloss`.
        Engine("pharos-reflection", "pharos", {"guiding": "NEURAL-REFLECTION"}, "pharos"),
        Engine("pharos-radiance", "pharos", {"guiding": "NEURAL-RADIANCE"}, "pharos"),
        Engine("cycles", "cycles", {"guiding": False}, "cycles"),
        Engine("cycles-guided", "cycles", {"guiding": True}, "cycles"),
        Engine("cycles-3.4", "cycles-3.4", {"guiding": False}, "cycles-3.4"),
    )}
