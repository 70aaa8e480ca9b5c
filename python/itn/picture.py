"""Pictures for notebooks."""
import base64
import struct
import zlib

import numpy as np

from . import _itn


def png(rgb: np.ndarray) -> bytes:
    """A PNG file of (height, width, 3) bytes."""
    height, width, _ = rgb.shape
    rows = b"".join(b"\0" + row.tobytes() for row in np.ascontiguousarray(rgb))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def picture(image: np.ndarray, signed: bool = False) -> np.ndarray:
    """8-bit sRGB of linear values: tone-mapped, or signed: red for positive, blue for negative values."""
    return _itn.picture(np.ascontiguousarray(image, np.float32), signed)


def as_html(image: np.ndarray, caption: str, signed: bool = False) -> str:
    data = base64.b64encode(png(picture(image, signed))).decode()
    return (f"<figure style='display:inline-block;margin:4px'><img src='data:image/png;base64,{data}' "
            f"style='min-width:192px;image-rendering:pixelated'><figcaption>{caption}</figcaption></figure>")
