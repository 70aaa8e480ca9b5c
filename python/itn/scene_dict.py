"""Scenes as dictionaries, as Mitsuba's `load_dict` takes them."""
from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from . import _itn
from .scene import Scene

# The tag of each plugin's element. What stands in several lists has the first's.
_PLUGINS = {
    "integrator": "path direct direct_projective volpath volpathmis ptracer prb prb_basic prb_projective prbvolpath aov depth "
                  "moment stokes",
    "sensor": "perspective orthographic thinlens radiancemeter irradiancemeter distant",
    "film": "hdrfilm specfilm",
    "rfilter": "box tent gaussian mitchell catmullrom lanczos",
    "sampler": "independent stratified multijitter orthogonal ldsampler",
    "shape": "obj ply serialized sphere rectangle cube disk cylinder shapegroup instance linearcurve bsplinecurve sdfgrid",
    "emitter": "constant envmap sunsky timed_sunsky area point spot directional directionalarea projector",
    "medium": "homogeneous heterogeneous",
    "phase": "isotropic hg rayleigh blendphase tabphase sggx vmf draine",
    "volume": "constvolume gridvolume",
    "texture": "bitmap checkerboard mesh_attribute volume",
    "spectrum": "uniform srgb d65 regular irregular rawconstant blackbody",
    "bsdf": "diffuse dielectric thindielectric roughdielectric conductor roughconductor plastic roughplastic pplastic "
            "principled principledthin blendbsdf mask twosided bumpmap normalmap null polarizer",
}
_TAG = {plugin: tag for tag, plugins in reversed(_PLUGINS.items()) for plugin in plugins.split()}
_POINTS = {"center", "p0", "p1", "position", "origin", "target"}
# Objects whose key is the name of a parameter.
_NAMED = {"texture", "spectrum", "volume", "medium"}


class Transform:
    """A chain of transformations, applied from the last to the first, as Mitsuba's ScalarTransform4f:
    `Transform().translate([0, 0, 1]).rotate([0, 0, 1], 30)` rotates first."""

    def __init__(self, matrix: Any = None, steps: tuple[str, ...] = ()):
        self._steps = steps if matrix is None else (_matrix(matrix),)

    def _then(self, step: str) -> Transform:
        return Transform(steps=(*self._steps, step))

    def translate(self, v: Any) -> Transform:
        return self._then(f"<translate value={quoteattr(_numbers(v))}/>")

    def scale(self, v: Any) -> Transform:
        return self._then(f"<scale value={quoteattr(_numbers(v))}/>")

    def rotate(self, axis: Any, angle: float) -> Transform:
        x, y, z = map(float, axis)
        return self._then(f'<rotate x="{x!r}" y="{y!r}" z="{z!r}" angle="{float(angle)!r}"/>')

    def look_at(self, origin: Any, target: Any, up: Any) -> Transform:
        return self._then(f"<lookat origin={quoteattr(_numbers(origin))} target={quoteattr(_numbers(target))} "
                          f"up={quoteattr(_numbers(up))}/>")

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(steps=(*self._steps, *other._steps))

    def xml(self) -> str:
        return "".join(reversed(self._steps))


def _numbers(value: Any) -> str:
    return ", ".join(repr(float(v)) for v in np.ravel(np.asarray(value, np.float64)))


def _matrix(value: Any) -> str:
    matrix = np.asarray(getattr(value, "matrix", value), np.float64).reshape(4, 4)
    return f"<matrix value={quoteattr(_numbers(matrix))}/>"


def _tag_of(kind: str, key: str) -> str:
    if key == "rfilter" and kind in _PLUGINS["rfilter"].split():
        return "rfilter"
    if kind not in _TAG:
        raise _itn.InputError(f"load_dict: {key} is of type {kind!r}, which is not known; need one of: {', '.join(sorted(_TAG))}")
    return _TAG[kind]


def _object(key: str, value: Mapping[str, Any], path: str, ids: Counter) -> str:
    kind = value.get("type")
    if kind is None:
        raise _itn.InputError(f"load_dict: {path} has no 'type'")
    name = quoteattr(key)
    if kind == "ref":
        return f"<ref name={name} id={quoteattr(value['id'])}/>"
    if kind == "rgb":
        return f"<rgb name={name} value={quoteattr(_numbers(value['value']))}/>"
    if kind == "spectrum":
        spectrum = value["value"]
        text = ", ".join(f"{w}:{v}" for w, v in spectrum) if np.ndim(spectrum) == 2 else _numbers(spectrum)
        return f"<spectrum name={name} value={quoteattr(text)}/>"
    tag = _tag_of(kind, key)
    identity = value.get("id", key if ids[key] == 1 else path.replace(".", "_"))
    named = f" name={name}" if tag in _NAMED and path != key else ""
    inner = "".join(_member(k, v, f"{path}.{k}" if path else k, ids) for k, v in value.items() if k not in ("type", "id"))
    return f"<{tag} type={quoteattr(kind)} id={quoteattr(identity)}{named}>{inner}</{tag}>\n"


def _member(key: str, value: Any, path: str, ids: Counter) -> str:
    name = quoteattr(key)
    if isinstance(value, Mapping):
        return _object(key, value, path, ids)
    if isinstance(value, (bool, np.bool_)):
        return f"<boolean name={name} value=\"{str(bool(value)).lower()}\"/>"
    if isinstance(value, (int, np.integer)):
        return f'<integer name={name} value="{int(value)}"/>'
    if isinstance(value, (float, np.floating)):
        return f'<float name={name} value="{float(value)!r}"/>'
    if isinstance(value, (str, os.PathLike)):
        text = os.fspath(value)
        if key == "filename":
            text = os.path.abspath(text)
        return f"<string name={name} value={quoteattr(text)}/>"
    if isinstance(value, Transform):
        return f"<transform name={name}>{value.xml()}</transform>"
    if hasattr(value, "matrix") or np.shape(value) == (4, 4):
        return f"<transform name={name}>{_matrix(value)}</transform>"
    if np.shape(value) == (3,):
        tag = "point" if key in _POINTS else "vector"
        return f"<{tag} name={name} value={quoteattr(_numbers(value))}/>"
    raise _itn.InputError(f"load_dict: {path} is {value!r}; need a number, a text, three numbers, a transformation or a dictionary")


def _keys(value: Mapping[str, Any]) -> Counter:
    found: Counter = Counter()
    for key, inner in value.items():
        if isinstance(inner, Mapping):
            found[key] += 1
            found += _keys(inner)
    return found


def to_xml(scene: Mapping[str, Any]) -> str:
    """The scene file that says the same."""
    if scene.get("type") != "scene":
        raise _itn.InputError("load_dict: need {'type': 'scene', ...}")
    ids = _keys(scene)
    body = "".join(_member(key, value, key, ids) for key, value in scene.items() if key != "type")
    return f'<scene version="3.0.0">\n{body}</scene>\n'


def load_dict(scene: Mapping[str, Any], *, size: tuple[int, int] | None = None, open: bool = False) -> Scene:
    """A scene from a dictionary, as Mitsuba's `load_dict`: each object is a dictionary with its plugin's `type`, nested ones
    are members; keys become ids, and so the beginnings of parameters' names (where a key stands in several objects: with
    those before it, `ball_bsdf`).

    Transformations are `itn.Transform`, Mitsuba's own, or 4 x 4 matrices; files are found from the current folder."""
    text = to_xml(scene)
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "dictionary.xml")
        Path(file).write_text(text, encoding="utf-8")
        result = Scene(_itn.load(file, {}, size, open))
    result._text = text
    return result
