"""Pictures, grids and meshes that are arrays, as the files that scenes name."""
from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _itn
from .transform import attribute, numbers


def shown(value: Any) -> str:
    """What it is, in a few words."""
    shape = attribute(value, "shape")
    if isinstance(shape, tuple) and shape:
        return f"an array of shape {tuple(map(int, shape))}"
    text = repr(value)
    return text if len(text) <= 60 else f"{type(value).__name__} {text[:40]}..."


def _array(value: Any, what: str, dimensions: tuple[int, ...]) -> np.ndarray:
    try:
        result = numbers(value).astype(np.float32)
    except (TypeError, ValueError):
        raise _itn.InputError(f"load_dict: {what} is {shown(value)}; need an array of numbers") from None
    if result.ndim not in dimensions or result.size == 0:
        raise _itn.InputError(f"load_dict: {what} is {shown(result)}; need one of {' or '.join(map(str, dimensions))} dimensions")
    if not np.all(np.isfinite(result)):
        raise _itn.InputError(f"load_dict: {what} has values that are not finite")
    return result


def _channels(values: np.ndarray, what: str) -> np.ndarray:
    """With 1 channel or 3: transparency is left out, as of files."""
    if values.shape[-1] not in (1, 2, 3, 4):
        raise _itn.InputError(f"load_dict: {what} has {values.shape[-1]} channels; need 1 or 3, and transparency at most")
    return values[..., :1] if values.shape[-1] < 3 else values[..., :3]


def _linear(encoded: np.ndarray) -> np.ndarray:
    """Of sRGB."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _bitmap(value: Any, raw: bool, what: str) -> np.ndarray:
    """(height, width, 1 or 3), linear. As in Mitsuba 8 bits are sRGB, unless they are raw."""
    of_mitsuba = attribute(value, "srgb_gamma")  # mitsuba.Bitmap
    array = np.asarray(value if attribute(value, "detach") is None else value.detach().cpu())
    bits = array.dtype.kind == "u" and 8 * array.dtype.itemsize
    encoded = bool(of_mitsuba()) if of_mitsuba is not None else bits == 8
    array = _array(array, what, (2, 3))
    array = _channels(array[..., None] if array.ndim == 2 else array, what)
    if bits:
        array = array / np.float32(2 ** bits - 1)
    return array if raw or not encoded else _linear(array)


class Files:
    """A folder that gets a file for each array, called after what it holds."""

    def __init__(self, folder: str):
        self.folder = folder

    def _path(self, data: bytes, extension: str) -> Path:
        return Path(self.folder) / f"array-{hashlib.sha256(data).hexdigest()[:24]}{extension}"

    def bitmap(self, value: Any, raw: bool, what: str) -> str:
        array = np.ascontiguousarray(_bitmap(value, raw, what), np.float32)
        file = self._path(repr(array.shape).encode() + array.tobytes(), ".exr")
        _itn.write_exr(str(file), ["Y"] if array.shape[-1] == 1 else list("RGB"), array, {})
        return file.name

    def grid(self, value: Any, what: str) -> str:
        if attribute(value, "bytes_per_voxel") is not None and attribute(value, "write") is not None:  # mitsuba.VolumeGrid
            written = Path(self.folder) / "grid.vol"
            value.write(str(written))
            file = self._path(written.read_bytes(), ".vol")
            os.replace(written, file)
            return file.name
        array = _array(value, what, (3, 4))
        array = array[..., None] if array.ndim == 3 else array
        if array.shape[-1] not in (1, 3):
            raise _itn.InputError(f"load_dict: {what} is {shown(array)}; need (depth, height, width) and 1 or 3 channels")
        depth, height, width, channels = array.shape
        header = b"VOL" + struct.pack("<BIIIII6f", 3, 1, width, height, depth, channels, 0, 0, 0, 1, 1, 1)
        data = header + np.ascontiguousarray(array, "<f4").tobytes()
        file = self._path(data, ".vol")
        file.write_bytes(data)
        return file.name

    def mesh(self, parts: Mapping[str, Any], what: str) -> str:
        """parts: vertices (n, 3) and faces (m, 3), and maybe normals (n, 3) and texcoords (n, 2)."""
        columns = []
        header = "ply\nformat binary_little_endian 1.0\n"
        count = None
        for name, names in (("vertices", "x y z"), ("normals", "nx ny nz"), ("texcoords", "u v")):
            if name not in parts:
                continue
            array = _array(parts[name], f"{what}.{name}", (2,))
            count = len(array) if count is None else count
            if array.shape != (count, len(names.split())):
                raise _itn.InputError(f"load_dict: {what}.{name} is {shown(array)}; need ({count}, {len(names.split())})")
            if not columns:
                header += f"element vertex {count}\n"
            header += "".join(f"property float {n}\n" for n in names.split())
            columns.append(array.astype("<f4"))
        faces = _array(parts["faces"], f"{what}.faces", (2,)).astype(np.float64)
        exact = numbers(parts["faces"])
        if faces.shape[1] != 3 or np.any(exact != np.floor(exact)) or np.any(exact < 0) or np.any(exact >= count):
            raise _itn.InputError(f"load_dict: {what}.faces is {shown(faces)}; need (m, 3) whole numbers from 0 to {count - 1}, "
                                  "the vertices of each triangle")
        rows = np.zeros(len(exact), [("n", "u1"), ("v", "<u4", 3)])
        rows["n"], rows["v"] = 3, exact
        header += f"element face {len(exact)}\nproperty list uchar uint vertex_indices\nend_header\n"
        data = header.encode() + np.ascontiguousarray(np.concatenate(columns, 1)).tobytes() + rows.tobytes()
        file = self._path(data, ".ply")
        file.write_bytes(data)
        return file.name
