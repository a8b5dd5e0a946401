"""Small pictures for the page: linear floats to an sRGB PNG, by the standard library alone."""

import struct
import zlib

import numpy as np


def exposure_of(reference):
    """What brings the bright parts of a picture just under white."""
    return 0.9 / max(float(np.quantile(np.nan_to_num(reference), 0.97)), 1e-6)


def to_srgb(linear, exposure=1.0):
    """Bytes 0 ... 255; what is not finite is shown in magenta."""
    finite = np.isfinite(linear).all(axis=-1, keepdims=True)
    x = np.clip(np.nan_to_num(linear) * exposure, 0.0, 1.0)
    x = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    return np.where(finite, np.rint(255 * x), (255, 0, 255)).astype(np.uint8)


def encode(pixels):
    """A PNG of (height, width, 3) bytes, bottom row first as Blender keeps them."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels[::-1].reshape(height, -1)

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
            + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))
