"""Transformations, as Mitsuba's ScalarTransform4f."""
from __future__ import annotations

import math
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from . import _itn


def attribute(value: Any, name: str) -> Any:
    """The attribute, or None. Dr.Jit's vectors answer a ValueError where others answer an AttributeError."""
    try:
        return getattr(value, name, None)
    except ValueError:
        return None


def numbers(value: Any) -> np.ndarray:
    """As doubles: of numbers, lists, numpy, torch, Dr.Jit and Mitsuba."""
    if attribute(value, "detach") is not None:
        value = value.detach().cpu()
    return np.asarray(value).astype(np.float64)  # Dr.Jit's __array__ takes no type


def matrix_of(value: Any) -> np.ndarray | None:
    """4 x 4, of a matrix or of what has one, as Mitsuba's transformations; None: it is neither. Vectors of Dr.Jit have a
    `matrix`, too, which is made of their components."""
    for candidate in (value, attribute(value, "matrix")):
        try:
            found = numbers(candidate)
        except (TypeError, ValueError):
            continue
        if found.size == 16:
            return found.reshape(4, 4)
    return None


def words(value: Any) -> str:
    return ", ".join(repr(float(v)) for v in np.ravel(numbers(value)))


def three(value: Any, what: str) -> np.ndarray:
    """Three numbers, or one for all three."""
    found = np.ravel(numbers(value))
    if found.size not in (1, 3):
        raise _itn.UsageError(f"{what}: got {found.size} numbers, need 3 or 1")
    return np.broadcast_to(found, 3)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def _affine(linear: Any, shift: Any = (0, 0, 0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = shift
    return matrix


class Transform:
    """A chain of transformations, applied from the last to the first, as Mitsuba's ScalarTransform4f:
    `Transform().translate([0, 0, 1]).rotate([0, 0, 1], 30)` rotates first. `matrix` is all of it."""

    def __init__(self, matrix: Any = None):
        self._steps: tuple[str, ...] = ()
        self.matrix = np.eye(4)
        if matrix is not None:
            found = matrix_of(matrix)
            if found is None:
                raise _itn.UsageError(f"Transform: got {type(matrix).__name__}, need a matrix of 4 x 4, or what has one")
            self.matrix = found
            self._steps = (f"<matrix value={quoteattr(words(self.matrix))}/>",)

    def _then(self, steps: tuple[str, ...], matrix: np.ndarray) -> Transform:
        result = Transform()
        result._steps = self._steps + steps
        result.matrix = self.matrix @ matrix
        return result

    def translate(self, v: Any) -> Transform:
        """v: three numbers, or one for all three."""
        v = three(v, "translate")
        return self._then((f"<translate value={quoteattr(words(v))}/>",), _affine(np.eye(3), v))

    def scale(self, v: Any) -> Transform:
        """v: three numbers, or one for all three."""
        v = three(v, "scale")
        return self._then((f"<scale value={quoteattr(words(v))}/>",), _affine(np.diag(v)))

    def rotate(self, axis: Any, angle: float) -> Transform:
        """angle: in degrees."""
        a = three(axis, "rotate")
        c, s = math.cos(math.radians(float(angle))), math.sin(math.radians(float(angle)))
        across = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        matrix = c * np.eye(3) + (1 - c) * np.outer(a, a) + s * across
        step = f'<rotate x="{float(a[0])!r}" y="{float(a[1])!r}" z="{float(a[2])!r}" angle="{float(angle)!r}"/>'
        return self._then((step,), _affine(matrix))

    def look_at(self, origin: Any, target: Any, up: Any) -> Transform:
        o, t, u = (three(v, "look_at") for v in (origin, target, up))
        with np.errstate(invalid="ignore", divide="ignore"):
            forward = _unit(t - o)
            left = _unit(np.cross(u, forward))
        if not np.all(np.isfinite([forward, left])):
            raise _itn.UsageError("look_at: origin and target are the same point, or up points from one to the other")
        step = f"<lookat origin={quoteattr(words(o))} target={quoteattr(words(t))} up={quoteattr(words(u))}/>"
        return self._then((step,), _affine(np.stack([left, np.cross(forward, left), forward], 1), o))

    def inverse(self) -> Transform:
        try:
            return Transform(np.linalg.inv(self.matrix))
        except np.linalg.LinAlgError:
            raise _itn.UsageError("inverse: the transformation flattens space, and nothing undoes that") from None

    def __matmul__(self, other: Any) -> Transform:
        other = other if isinstance(other, Transform) else Transform(other)
        return self._then(other._steps, other.matrix)

    def __repr__(self) -> str:
        return f"itn.Transform({np.array2string(self.matrix, separator=', ')})"

    def xml(self) -> str:
        return "".join(reversed(self._steps))
