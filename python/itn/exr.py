"""OpenEXR files, and images that may be files or arrays."""
from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _itn
from .rendering import Rendering


def float_array(value: Any) -> np.ndarray:
    if hasattr(value, "detach"):
        value = value.detach().cpu()
    return np.ascontiguousarray(value, np.float32)


# Of files that somebody expects to be something else.
_OTHER_PICTURES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".hdr", ".rgbe", ".pfm", ".ppm", ".bmp", ".gif", ".webp", ".npy"}


def read_exr(file: str | os.PathLike) -> dict[str, np.ndarray]:
    """The channels of an OpenEXR file by name, each (height, width), linear. `itn render` writes R G B (or Y),
    stderr.R ..., derivative.NAME.R ..., derivative_stderr.NAME.R ..."""
    return _itn.read_exr(os.fspath(file))[0]


def write_exr(file: str | os.PathLike, image: Any) -> None:
    """Writes an image (height, width, 1 or 3), or a dictionary of channels (height, width), or a Rendering with its standard
    errors and derivatives, under the names that `itn render` uses."""
    extension = os.path.splitext(os.fspath(file))[1]
    if extension.lower() in _OTHER_PICTURES:
        raise _itn.UsageError(f"{os.fspath(file)}: got {extension}, need a name that ends in .exr")
    channels: dict[str, np.ndarray] = {}

    def add(prefix: str, values: np.ndarray) -> None:
        values = float_array(values)
        values = values[..., None] if values.ndim == 2 else values
        if values.ndim != 3 or values.shape[2] not in (1, 3) or values.size == 0:
            raise _itn.UsageError(f"{os.fspath(file)}: got an array of shape {values.shape}, need (height, width) and 1 or 3 channels; "
                                  "others have names: a dictionary of (height, width)")
        for c, letter in enumerate("Y" if values.shape[2] == 1 else "RGB"):
            channels[prefix + letter] = values[..., c]

    if isinstance(image, Rendering):
        add("", image.image)
        add("stderr.", image.stderr)
        for name, values in image.derivatives.items():
            add(f"derivative.{name}.", values)
            add(f"derivative_stderr.{name}.", image.derivatives_stderr[name])
    elif isinstance(image, Mapping):
        channels.update({name: float_array(values) for name, values in image.items()})
        shapes = {values.shape for values in channels.values()}
        if len(shapes) != 1 or len(next(iter(shapes))) != 2 or 0 in next(iter(shapes)):
            raise _itn.UsageError(f"{os.fspath(file)}: got channels of the shapes {sorted(shapes)}, need (height, width), the same of all")
    else:
        add("", image)
    _itn.write_exr(os.fspath(file), list(channels), np.ascontiguousarray(np.stack(list(channels.values()), -1), np.float32), {})


def as_file(image: Any, folder: str, name: str) -> str:
    """The file that an image is, or one with the array (or the Rendering's image) in this folder."""
    if isinstance(image, (str, os.PathLike)):
        return os.fspath(image)
    file = os.path.join(folder, f"{name}.exr")
    write_exr(file, image.image if isinstance(image, Rendering) else image)
    return file
