"""Scenes and their parameters."""
from __future__ import annotations

import html
import math
import os
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _itn
from .transform import attribute, numbers
from .warning import tell


@dataclass(frozen=True)
class Parameter:
    """What is known of a parameter beside its value. `unit` is empty for pure numbers."""

    name: str
    low: float
    high: float
    range: str                      # "[0, 1]", "(-1, 1)", "[0, inf)"
    unit: str
    differentiable: bool
    reason: str                     # why not
    belongs_to: str                 # medium, phase, bsdf, texture, light or environment
    shape: tuple[int, ...] | None   # of a texture (height, width, channels), of a grid (depth, height, width, channels)


class Parameters(MutableMapping):
    """The numbers, textures and grids of a scene that its image depends on, by name: `<id>.<parameter>`.

    `parameters["wax.albedo"]` is a float, of a texture or a grid a numpy array; assigning sets it, in its range. A colour
    whose components are parameters of their own ("skin.albedo.R", ...) is also there as a whole, as an array of three.
    `parameters.info(name)` has range, unit, and whether the image can be differentiated by it.
    Unlike Mitsuba's `traverse()` there is nothing to update after an assignment.
    """

    def __init__(self, scene: Scene):
        self._scene = scene._scene

    def _components(self, name: str) -> list[str]:
        names = self._scene.by_component([name])
        return names if names != [name] else []

    def __getitem__(self, name: str) -> float | np.ndarray:
        if parts := self._components(name):
            return np.array([self._scene.number(part) for part in parts])
        if self._scene.has_values(name):
            return self._scene.values(name)
        return self._scene.number(name)

    def __setitem__(self, name: str, value: Any) -> None:
        if parts := self._components(name):
            for part, number in zip(parts, _values(name, value, (len(parts),))):
                self._scene.set_number(part, float(number))
        elif self._scene.has_values(name):
            shape = self._scene.describe(name)["shape"]
            self._scene.set_values(name, np.ascontiguousarray(_values(name, value, shape), np.float32))
        else:
            self._scene.set_number(name, float(_values(name, value, ())))

    def __delitem__(self, name: str) -> None:
        raise TypeError("parameters of a scene cannot be deleted")

    def __contains__(self, name: object) -> bool:
        return name in self._scene.names() or (isinstance(name, str) and bool(self._components(name)))

    def __iter__(self) -> Iterator[str]:
        return iter(self._scene.names())

    def __len__(self) -> int:
        return len(self._scene.names())

    def info(self, name: str) -> Parameter:
        """Range, unit and what else is known of one parameter."""
        d = self._scene.describe(name)
        return Parameter(**{key: d[key] for key in Parameter.__dataclass_fields__})

    @property
    def differentiable(self) -> list[str]:
        """The names of those that are numbers by which images can be differentiated."""
        return [name for name in self if self.info(name).differentiable and not self._scene.has_values(name)]

    def _rows(self) -> list[tuple[str, str, str, str, str]]:
        rows = []
        for name in self:
            p = self.info(name)
            number = self._scene.number(name)
            value = "-" if math.isnan(number) else f"{number:.6g}"
            if p.shape:
                value = " x ".join(map(str, p.shape))
            rows.append((name, value, p.range, p.unit or "1", "yes" if p.differentiable else f"no: {p.reason}"))
        return rows

    _head = ("name", "value", "range", "unit", "differentiable")

    def __repr__(self) -> str:
        rows = [self._head, *self._rows()]
        widths = [max(len(row[i]) for row in rows) for i in range(4)]
        return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, [*widths, 0])) for row in rows)

    def _repr_html_(self) -> str:
        cells = lambda row, tag: "".join(f"<{tag} style='text-align:left'>{html.escape(c)}</{tag}>" for c in row)
        body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in self._rows())
        return f"<table><tr>{cells(self._head, 'th')}</tr>{body}</table>"


def _values(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """An array of this shape, of one, of a number for all, or of a colour for all texels. Of numpy, torch, or whatever has __array__ or DLPack."""
    try:
        found = numbers(value)
    except (TypeError, ValueError):
        raise _itn.UsageError(f"parameter {name}: got {type(value).__name__}, need {'an array' if shape else 'a number'}") from None
    if found.size == 1:
        return np.broadcast_to(found.reshape(()), shape)
    if len(shape) > 1 and found.shape == tuple(shape[-1:]):
        return np.broadcast_to(found, shape)
    if found.shape != tuple(shape):
        need = f"an array of shape {tuple(shape)}, or one number" if shape else "one number"
        raise _itn.UsageError(f"parameter {name}: got an array of shape {found.shape}, need {need}")
    return found


class Scene:
    """A scene, as `itn.load` reads it. `parameters` are its numbers, textures and grids."""

    def __init__(self, scene: _itn.Scene):
        self._scene = scene
        self._text: str | None = None  # of scenes without a file

    @property
    def parameters(self) -> Parameters:
        return Parameters(self)

    @property
    def file(self) -> str:
        return self._scene.file

    @property
    def sensors(self) -> list[dict]:
        """Of each: id, width, height, channels (1: luminance) and spp, its samples a pixel."""
        return self._scene.sensors

    @property
    def warnings(self) -> list[str]:
        """What the file has that is suspicious."""
        return self._scene.warnings

    def copy(self) -> Scene:
        """The same scene with parameters of its own; meshes, textures and grids are shared until they are set."""
        result = Scene(self._scene.copy())
        result._text = self._text
        return result

    def __repr__(self) -> str:
        sensor = self.sensors[0]
        return f"<itn.Scene {self.file}: {sensor['width']} x {sensor['height']} pixels, {len(self.parameters)} parameters>"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(repr(self)[1:-1])}</p>{self.parameters._repr_html_()}"


def _definition(name: str, value: Any) -> str:
    """What stands for $name in the file."""
    if isinstance(value, (bool, np.bool_)):
        return str(bool(value)).lower()
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, (int, float, np.number)):
        return str(value)
    try:
        found = numbers(value)
    except (TypeError, ValueError):
        found = np.empty((0, 0))
    if found.ndim > 1 or found.size == 0:
        shape = attribute(value, "shape")
        got = f"an array of shape {tuple(shape)}" if shape is not None else type(value).__name__
        raise _itn.UsageError(f"{name}: got {got}; need a number, a text or a list of numbers")
    return ", ".join(repr(float(v)) for v in found.ravel())


def load(file: str | os.PathLike, *, size: tuple[int, int] | None = None, open: bool = False,
         defines: Mapping[str, Any] | None = None, **more: Any) -> Scene:
    """Reads a Mitsuba 3 scene file. What it has that is suspicious becomes warnings (`itn.Warning`).

    Further keywords fill `$name` in the file, as Mitsuba's `load_file` does: `load("scene.xml", sigma_t=25)`; a list fills it
    with its numbers, as of a colour. `defines` takes them as a dictionary, names that are no Python names, too.

    size: (width, height) of every film, instead of the file's. open: take shapes that bound a medium though they are not
    closed. Raises InputError with every problem and where it is; UsageError for a name that the scene does not use.
    """
    if size is not None and (isinstance(size, str) or np.shape(size) != (2,)):
        raise _itn.UsageError(f"size: got {size!r}, need (width, height) of the films; $size of the file: defines={{'size': ...}}")
    text = {name: _definition(name, value) for name, value in {**(defines or {}), **more}.items()}
    scene = Scene(_itn.load(os.fspath(file), text, size, open))
    tell(scene.warnings)
    return scene
