"""Float pictures from EXR files by way of oiiotool: numpy does not read EXR."""

import subprocess
import tempfile
from pathlib import Path

import numpy as np


def _said(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def read_exr(path, layer="Combined", letters="RGB"):
    """Three channels as (height, width, 3) float32, bottom row first as Blender keeps them."""
    first = f"{layer}.{letters[0]}"
    named = f"{layer}." if first in _said("oiiotool", "--info", "-v", str(path)) else ""
    channels = ",".join(named + letter for letter in letters)
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.tif"
        command = ["oiiotool", str(path), "--ch", channels, "--flip", "-d", "float",
                   "--compression", "none", "--planarconfig", "contig", "-o", str(plain)]
        _said(*command)
        size = _said("oiiotool", "--info", str(plain)).split(":", 1)[1].split(",")[0]
        width, height = (int(part) for part in size.split("x"))
        return _strips(plain.read_bytes(), width, height)


def _strips(data, width, height):
    """Pixels of an uncompressed, contiguous float TIFF."""
    order = "<" if data[:2] == b"II" else ">"

    def number(at, size):
        return int.from_bytes(data[at:at + size], "little" if order == "<" else "big")

    sizes = {3: 2, 4: 4}
    tags = {}
    directory = number(4, 4)
    for i in range(number(directory, 2)):
        at = directory + 2 + 12 * i
        kind, count = number(at + 2, 2), number(at + 4, 4)
        if kind in sizes:
            size = sizes[kind]
            start = at + 8 if size * count <= 4 else number(at + 8, 4)
            tags[number(at, 2)] = [number(start + size * k, size) for k in range(count)]
    offsets, lengths = tags[273], tags[279]
    raw = b"".join(data[o:o + n] for o, n in zip(offsets, lengths, strict=True))
    return np.frombuffer(raw, order + "f4").reshape(height, width, 3).astype(np.float32)
