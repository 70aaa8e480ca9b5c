"""From images to parameters."""
from __future__ import annotations

import hashlib
import html
import json
import os
import shutil
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _itn
from .gradient import Image, make_targets
from .picture import as_html
from .progress import shown
from .rendering import Rendering, operator_flag, seed_number
from .scene import Scene


@dataclass(frozen=True)
class Interval:
    """A value that was found, and where it lies with 95 %; not where `holds` is False: the verdict says why."""

    value: float
    low: float
    high: float
    holds: bool = True

    def __float__(self) -> float:
        return self.value

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(repr=False)
class Inversion:
    """What an inversion found. `parameters` are the numbers with 95 % intervals, `coefficients` what follows for diffuse
    light (reduced scattering and absorption), `textures` and `textures_stderr` arrays of textures and grids; `images` are
    the scene's with what was found. `verdict` and `ambiguity` say in words what to think of it. Where it is not `converged`
    (it has not settled, or the image found does not fit) there was a warning, and intervals that do not hold say so (`holds`)."""

    parameters: dict[str, Interval]
    coefficients: dict[str, Interval]
    textures: dict[str, np.ndarray]
    textures_stderr: dict[str, np.ndarray]
    converged: bool
    loss: float
    loss_stderr: float | None
    verdict: list[str]
    ambiguity: list[str]
    images: list[np.ndarray]
    folder: str | None      # with report.html, where one was asked for
    json: dict              # as of `itn invert --json`

    def __getitem__(self, name: str) -> Any:
        return self.textures[name] if name in self.textures else self.parameters[name]

    def apply(self, scene: Scene) -> None:
        """Gives the scene's parameters what was found."""
        for name, found in {**self.parameters, **self.textures}.items():
            scene.parameters[name] = found.value if isinstance(found, Interval) else found

    def _rows(self) -> list[tuple[str, str, str]]:
        rows = [(name, f"{p.value:.5g}", f"{p.low:.5g} to {p.high:.5g}" + ("" if p.holds else " (does not hold)"))
                for name, p in {**self.parameters, **self.coefficients}.items()]
        return rows + [(name, " x ".join(map(str, t.shape)), "") for name, t in self.textures.items()]

    def __repr__(self) -> str:
        lines = [*self.verdict, *(f"{n:<24} {v:>10}   95 %: {i}" if i else f"{n:<24} {v}" for n, v, i in self._rows())]
        return "\n".join(lines + self.ambiguity)

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{html.escape(n)}</td><td>{v}</td><td>{i}</td></tr>" for n, v, i in self._rows())
        words = "".join(f"<p>{html.escape(sentence)}</p>" for sentence in [*self.verdict, *self.ambiguity])
        pictures = "".join(as_html(image, "with what was found") for image in self.images)
        pictures += "".join(as_html(t, html.escape(n)) for n, t in self.textures.items() if t.ndim == 3 and t.shape[0] > 1)
        return f"{words}<table><tr><th></th><th>value</th><th>95 %</th></tr>{rows}</table>{pictures}"


def _fingerprint(value: Any) -> str:
    """Tells targets apart, whatever they are."""
    if value is None:
        return ""
    if isinstance(value, (str, os.PathLike)):
        with open(value, "rb") as file:
            return hashlib.sha256(file.read()).hexdigest()
    if isinstance(value, Rendering):
        return _fingerprint(value.image) + _fingerprint(value.stderr)
    if isinstance(value, _itn.Target):
        return value.fingerprint
    if hasattr(value, "detach"):
        value = value.detach().cpu()
    return hashlib.sha256(np.ascontiguousarray(value, np.float32).tobytes()).hexdigest()


def _request(scene: Scene, targets: Sequence[Any], without: Sequence[str] = (), **asked: Any) -> str:
    """All that the numbers depend on, but for the values of parameters `without`: a folder goes on only with the same."""
    values = {name: _fingerprint(value) if np.ndim(value) else value for name, value in scene.parameters.items()
              if name not in without}
    return json.dumps({"python": _itn.__version__, "scene": scene.file, "file": scene._text or _fingerprint(scene.file), "values": values,
                       "targets": [_fingerprint(t) for t in targets], "device": _itn.device()["name"], **asked}, default=str)


def _by_component(scene: Scene, values: Mapping[str, Any]) -> dict[str, Any]:
    return {part: value for name, value in values.items() for part in scene._scene.by_component([name])}


def invert(scene: Scene, target: Image | Sequence[Image], parameters: Sequence[str], *, method: str | None = None,
           spp: int = 0, seed: int = 0, iterations: int = 0, noise: float | None = None, exposure: bool = False,
           white_balance: bool = False, start: Mapping[str, float] | None = None, starts: int = 0,
           init: str | None = None, prior: Mapping[str, tuple[float, float]] | None = None,
           range: Mapping[str, tuple[float, float]] | None = None, renderings: str | os.PathLike | None = None,
           learning_rate: float = 0.05, smoothness: float = 0, repeats: int = 4, mask: Any = None, sensor: int | Sequence[int] | None = None, operator: str = "full",
           output: str | os.PathLike | None = None, progress: bool | Callable[[float], object] | None = None) -> Inversion:
    """From images of a scene to its parameters, with 95 % intervals: `itn invert`, analysis by synthesis.

    target: an array of the film's size, a Rendering (with its standard errors), an OpenEXR file, a photo (a PNG, JPEG or TIFF
    file; `itn.photo` says more about it); several, one a sensor.
    parameters: names of numbers; of textures and grids, too, texel by texel and voxel by voxel, by Adam. The scene's own
    values are the start of Gauss-Newton and Adam; `start` gives others, `init` a network's guess ("shipped", or a run's folder) from a target that is
    a file; how sure the network is is Gauss-Newton's prior, unless `prior` gives one, and where the shipped network's judge
    doubts the target, a warning and the verdict say so. The scene is left as it is: `result.apply(scene)` changes it.

    Where it has not settled, or the image found does not fit, `converged` is False, a warning says so and what the misfit looks
    like, and the intervals are marked (`holds`).

    method: "gauss-newton", "adam", or "posterior", which needs no start: renderings all over the range, and all materials that
    fit. Default: posterior of up to eight numbers, or where range or renderings is given; gauss-newton of more, with start,
    starts, init or white_balance, and of a number without a range to look at. range: {name: (low, high)} that the posterior looks
    at (default: all of a range with two bounds, else a tenth to ten times the scene's value); renderings: the folder where it
    keeps them for the next target of the same scene.
    spp: samples a pixel, at most 1024 (Gauss-Newton; more of few pixels), 16 (Adam), as the target's noise asks for (posterior). noise: standard
    deviation of the target's noise over its radiance; default what it says itself, else as it shows. exposure: the target is
    known up to a factor. white_balance: red and blue of all targets are known up to a factor each (Gauss-Newton). starts:
    of so many places, the best end; 0: 1 with Adam, with Gauss-Newton 4, and up to 8 until two agree in an image that fits.
    prior: {name: (low, high)}, 95 % intervals known before.
    smoothness, repeats: of textures and grids. output: a folder for the report, where an inversion that was stopped goes on;
    without one it begins anew. Ctrl-C ends it.
    """
    targets, sensors = make_targets(scene, target, mask, sensor)
    names = scene._scene.by_component(list(parameters))
    for name in names:
        scene._scene.number(name)  # is it there?
    textures = [name for name in names if scene._scene.has_values(name)]
    if method not in (None, "adam", "gauss-newton", "posterior"):
        raise _itn.UsageError(f"method: got {method!r}, need 'gauss-newton', 'adam' or 'posterior'")
    start, prior, range = (_by_component(scene, values or {}) for values in (start, prior, range))
    if textures and (method in ("gauss-newton", "posterior") or start or prior or init or starts or range or renderings):
        raise _itn.UsageError(f"{textures[0]}: textures and grids are found by adam, from the scene's own values, without "
                              "start, starts, prior, init, range and renderings")
    if textures and white_balance:
        raise _itn.UsageError(f"{textures[0]}: textures and grids are found without white_balance")
    if init and not isinstance(target, (str, os.PathLike)):
        raise _itn.UsageError("init: a network looks at a target that is a file; itn.predict takes arrays")
    asked = {"parameters": names, "sensors": sensors, "method": method or ("adam" if textures else ""),
             "spp": spp, "seed": seed, "iterations": iterations, "noise": noise, "exposure": exposure,
             "white_balance": white_balance, "learning_rate": learning_rate, "operator": operator, "masks": _fingerprint(mask) if not isinstance(mask, list)
             else [_fingerprint(m) for m in mask], "start": start, "starts": starts, "prior": prior, "range": range, "init": init,
             "smoothness": smoothness, "repeats": repeats}
    several = target if isinstance(target, (list, tuple)) else [target]
    folder = os.fspath(output) if output is not None else tempfile.mkdtemp(prefix="itn-invert-")
    request = _request(scene, several, **asked)
    common = (scene._scene, names, targets, sensors, folder, request, spp, seed_number(seed), operator_flag(operator))
    try:
        with shown(progress, "invert") as tell:
            if textures:
                found = _itn.invert_values(*common, iterations, noise, learning_rate, exposure, smoothness, repeats, tell)
                result = _of_values(found, repeats, folder if output is not None else None)
                if not result.converged:
                    warnings.warn(f"not converged: {found['verdict']}", UserWarning, stacklevel=2)
                return result
            intervals = lambda known: {k: (float(v[0]), float(v[1])) for k, v in known.items()}
            of_scene = _request(scene, [], without=names, parameters=names, sensors=sensors, seed=seed, operator=operator)
            found = _itn.invert_numbers(*common, method or "", iterations, noise, learning_rate, exposure, white_balance,
                                        {k: float(v) for k, v in start.items()}, starts, intervals(prior), init or "",
                                        os.fspath(target) if init else "", intervals(range),
                                        os.fspath(renderings) if renderings is not None else "", of_scene, tell)
    finally:
        if output is None:
            shutil.rmtree(folder, ignore_errors=True)
    result = json.loads(found["json"])
    if not result["converged"]:
        warnings.warn(f"not converged: {found['failure']}", UserWarning, stacklevel=2)
    interval = lambda p: Interval(p["value"], p["low"], p["high"], p["holds"])
    return Inversion({n: interval(p) for n, p in result["parameters"].items()},
                     {n: interval(p) for n, p in result.get("coefficients", {}).items()}, {}, {}, result["converged"],
                     result["loss"], result["loss_stderr"], found["verdict"], found["ambiguity"], found["images"],
                     folder if output is not None else None, result)


def _of_values(found: dict, repeats: int, folder: str | None) -> Inversion:
    numbers = {name: Interval(value, low if repeats else float("nan"), high if repeats else float("nan"), found["converged"])
               for name, (value, low, high) in found["numbers"].items()}
    words = [("" if found["converged"] else "NOT converged: ") + found["verdict"],
             f"The loss was {found['loss_at_start']:.4g} at the start and is {found['loss']:.4g} +- {found['loss_stderr']:.2g}."]
    result = {key: found[key] for key in ("converged", "loss", "loss_stderr", "loss_at_start")}
    result.update({key: json.loads(found[key]) for key in ("fit", "misfit")})
    return Inversion(numbers, {}, found["values"], found["stderr"], found["converged"], found["loss"], found["loss_stderr"], words, [],
                     found["images"], folder, result)
