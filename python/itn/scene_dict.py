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
from .scene_arrays import Files, shown
from .transform import Transform, matrix_of, numbers, words
from .warning import tell

_PLUGINS = dict(_itn.plugins())
# The tag of each plugin's element. Of a type that stands in several families the first one's.
_TAG = {plugin: tag for tag, plugins in reversed(_PLUGINS.items()) for plugin in plugins}
# Three numbers are a colour but in these.
_POINTS = {"center", "p0", "p1", "position", "origin", "target"}
_VECTORS = {"direction", "sun_direction"}
# What arrays are given as, by plugin: Mitsuba's names of objects in place of a file.
_BITMAPS = {"bitmap": ("bitmap", "data"), "envmap": ("bitmap",)}
_GRIDS = {"gridvolume": ("grid", "data")}
_MESHES = ("ply", "obj", "mesh")
_MESH_PARTS = ("vertices", "faces", "normals", "texcoords")
# Objects whose key is the name of a parameter.
_NAMED = {"texture", "spectrum", "volume", "medium"}


def _tag_of(kind: str, key: str, inside: str) -> str:
    if key == "rfilter" and kind in _PLUGINS["rfilter"]:
        return "rfilter"
    if kind == "dictionary" and inside in ("medium", "phase"):
        return "phase"
    if kind not in _TAG:
        raise _itn.InputError(f"load_dict: {key} is of type {kind!r}, which is not known; need one of: {', '.join(sorted(_TAG))}")
    return _TAG[kind]


def _given_as_arrays(value: Mapping[str, Any], path: str, files: Files) -> dict[str, Any]:
    """The members, those that are arrays in place of a file as the file that holds them."""
    kind = value["type"]
    members = dict(value)

    def replace(keys: tuple[str, ...], file: str) -> None:
        if "filename" in members:
            raise _itn.InputError(f"load_dict: {path} has both 'filename' and {keys[0]!r}; need one or the other")
        for key in keys:
            members.pop(key, None)
        members["filename"] = os.path.join(files.folder, file)

    for key in (*_BITMAPS.get(kind, ()), *_GRIDS.get(kind, ())):
        if key not in members or isinstance(members[key], (str, os.PathLike)):
            continue
        if kind in _GRIDS:
            replace((key,), files.grid(members[key], f"{path}.{key}"))
        else:
            # A tensor of Mitsuba's "data" is what the texture shows, whatever its type.
            raw = bool(members.get("raw", False)) or key == "data"
            replace((key,), files.bitmap(members[key], raw, f"{path}.{key}"))
    if kind in _MESHES and any(part in members for part in _MESH_PARTS):
        if "vertices" not in members or "faces" not in members:
            raise _itn.InputError(f"load_dict: {path} lacks {'faces' if 'vertices' in members else 'vertices'}; a mesh of arrays "
                                  "needs vertices (n, 3) and faces (m, 3)")
        file = files.mesh(members, path)
        members["type"] = "ply"
        replace(tuple(part for part in _MESH_PARTS if part in members), file)
    return members


def _object(key: str, value: Mapping[str, Any], path: str, ids: Counter, files: Files, inside: str) -> str:
    kind = value.get("type")
    if kind is None:
        raise _itn.InputError(f"load_dict: {path} has no 'type'")
    name = quoteattr(key)
    if kind == "ref":
        return f"<ref name={name} id={quoteattr(value['id'])}/>"
    if kind == "rgb":
        return f"<rgb name={name} value={quoteattr(_colour(value['value'], path))}/>"
    if kind == "spectrum":
        spectrum = value["value"]
        text = ", ".join(f"{w}:{v}" for w, v in spectrum) if np.ndim(spectrum) == 2 else words(spectrum)
        return f"<spectrum name={name} value={quoteattr(text)}/>"
    tag = _tag_of(kind, key, inside)
    identity = value.get("id", key if ids[key] == 1 else path.replace(".", "_"))
    named = f" name={name}" if tag in _NAMED and path != key else ""
    members = _given_as_arrays(value, path, files)
    inner = "".join(_member(k, v, f"{path}.{k}" if path else k, ids, files, tag, kind) for k, v in members.items()
                    if k not in ("type", "id"))
    return f"<{tag} type={quoteattr(members['type'])} id={quoteattr(identity)}{named}>{inner}</{tag}>\n"


def _colour(value: Any, path: str) -> str:
    try:
        found = numbers(value)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.size not in (1, 3):
        raise _itn.InputError(f"load_dict: {path} is {shown(value)}; need three numbers (linear sRGB) or one")
    return words(found)


def _member(key: str, value: Any, path: str, ids: Counter, files: Files, inside: str, kind: str) -> str:
    name = quoteattr(key)
    if isinstance(value, Mapping):
        return _object(key, value, path, ids, files, inside)
    if isinstance(value, (bool, np.bool_)):
        return f"<boolean name={name} value=\"{str(bool(value)).lower()}\"/>"
    if isinstance(value, (int, np.integer)):
        return f'<integer name={name} value="{int(value)}"/>'
    if isinstance(value, (float, np.floating)):
        return f'<float name={name} value="{float(value)!r}"/>'
    if isinstance(value, (str, os.PathLike)):
        text = os.fspath(value)
        if key == "filename":
            # Of an array's file the name alone: the scene says the same wherever its folder is.
            folder, file = os.path.split(text)
            text = file if folder == files.folder else os.path.abspath(text)
        return f"<string name={name} value={quoteattr(text)}/>"
    if isinstance(value, Transform):
        return f"<transform name={name}>{value.xml()}</transform>"
    if (matrix := matrix_of(value)) is not None:
        return f"<transform name={name}>{Transform(matrix).xml()}</transform>"
    try:
        found = numbers(value)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.size == 3:
        point, vector = key in _POINTS, key in _VECTORS or kind == "rawconstant"
        tag = "point" if point else "vector" if vector else "rgb"
        return f"<{tag} name={name} value={quoteattr(words(found))}/>"
    if found.size == 1:
        return f'<float name={name} value="{float(found.ravel()[0])!r}"/>'
    raise _itn.InputError(f"load_dict: {path} is {shown(value)}; need a number, a text, three numbers, a transformation or a "
                          "dictionary; arrays are pictures ({'type': 'bitmap', 'bitmap': ...}), grids ({'type': 'gridvolume', "
                          "'grid': ...}) and meshes ({'type': 'mesh', 'vertices': ..., 'faces': ...})")


def _keys(value: Mapping[str, Any]) -> Counter:
    found: Counter = Counter()
    for key, inner in value.items():
        if isinstance(inner, Mapping):
            found[key] += 1
            found += _keys(inner)
    return found


def to_xml(scene: Mapping[str, Any], folder: str) -> str:
    """The scene file that says the same. folder: gets what is an array."""
    if not isinstance(scene, Mapping) or scene.get("type") != "scene":
        raise _itn.InputError("load_dict: need {'type': 'scene', ...}")
    ids, files = _keys(scene), Files(folder)
    body = "".join(_member(key, value, key, ids, files, "scene", "scene") for key, value in scene.items() if key != "type")
    return f'<scene version="3.0.0">\n{body}</scene>\n'


def load_dict(scene: Mapping[str, Any], *, size: tuple[int, int] | None = None, open: bool = False) -> Scene:
    """A scene from a dictionary, as Mitsuba's `load_dict`: each object is a dictionary with its plugin's `type`, nested ones
    are members; keys become ids, and so the beginnings of parameters' names (where a key stands in several objects: with
    those before it, `ball_bsdf`).

    Transformations are `itn.Transform`, Mitsuba's own, or 4 x 4 matrices; three numbers are a colour (linear sRGB), or a point
    or a direction where the parameter is one; files are found from the current folder. Arrays (numpy, PyTorch, Mitsuba's
    tensors) take the place of files: of a `bitmap` or an `envmap` as `bitmap`, (height, width[, 1 or 3]), where 8 bits are
    sRGB, or a mitsuba.Bitmap; of a `gridvolume` as `grid`, (depth, height, width[, 1 or 3]), or a mitsuba.VolumeGrid; of a `mesh`
    as `vertices` (n, 3) and `faces` (m, 3), and where there are any `normals` (n, 3) and `texcoords` (n, 2)."""
    result = _load(scene, size, open)
    tell(result.warnings)
    return result


def _load(scene: Mapping[str, Any], size: tuple[int, int] | None = None, open: bool = False) -> Scene:
    with tempfile.TemporaryDirectory() as folder:
        text = to_xml(scene, folder)
        file = os.path.join(folder, "dictionary.xml")
        Path(file).write_text(text, encoding="utf-8")
        result = Scene(_itn.load(file, {}, size, open))
    result._text = text
    return result


def seen_by(scene: Scene, sensor: Any) -> tuple[Scene, int]:
    """The scene and the number of its sensor: one that it has, or, of a dictionary, the scene as that one sees it."""
    if not isinstance(sensor, Mapping):
        return scene, sensor
    if _TAG.get(sensor.get("type")) != "sensor":
        raise _itn.UsageError(f"sensor: is of type {sensor.get('type')!r}; need one of: {', '.join(_PLUGINS['sensor'])}")
    own = {key: value for key, value in sensor.items() if not (isinstance(value, Mapping) and value.get("type") == "ref")}
    refs = [value["id"] for value in sensor.values() if isinstance(value, Mapping) and value.get("type") == "ref"]
    if len(refs) > 1:
        raise _itn.UsageError(f"sensor: refers to {', '.join(map(repr, refs))}; need one medium at most")
    if sensor.get("type") == "irradiancemeter":
        raise _itn.UsageError("sensor: an irradiancemeter belongs into the shape on which it lies, in the scene itself")
    other = _load({"type": "scene", "sensor": own, "light": {"type": "constant"}})
    tell(other.warnings, stacklevel=2)
    result = Scene(scene._scene.seen_by(other._scene, refs[0] if refs else ""))
    result._text = f"{scene._text or ''}{other._text}{refs}"
    return result, 0
