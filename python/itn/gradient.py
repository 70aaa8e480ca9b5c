"""Image losses and their gradients, and the check of derivatives."""
from __future__ import annotations

import html
import json
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from . import _itn
from .exr import as_file, float_array
from .progress import shown
from .rendering import Rendering, operator_flag, samples, seed_number
from .scene import Scene
from .scene_dict import seen_by

Image = Union[np.ndarray, Rendering, str, os.PathLike]


def make_target(scene: Scene, sensor: int, target: Any, mask: Any = None) -> _itn.Target:
    """What a sensor's image is compared with: an array, a Rendering (with its standard errors), or a file."""
    if isinstance(target, _itn.Target):
        return target
    if isinstance(target, (str, os.PathLike)):
        return _target_from_file(scene, sensor, target, mask)
    if isinstance(mask, (str, os.PathLike)):
        raise _itn.UsageError(f"mask: the file {os.fspath(mask)} for a target that is an array; need an array, too (itn.read_exr)")
    error = target.stderr if isinstance(target, Rendering) else None
    try:
        image = float_array(target.image if isinstance(target, Rendering) else target)
    except (TypeError, ValueError):
        raise _itn.UsageError(f"target: got {type(target).__name__}, need an array of the film's size, a Rendering, or a file") from None
    if image.ndim == 2:
        image = image[..., None]
    return _itn.target_from_arrays(scene._scene, sensor, image, None if mask is None else float_array(mask), error)


def _target_from_file(scene: Scene, sensor: int, file: str | os.PathLike, mask: Any, *how: Any) -> _itn.Target:
    with tempfile.TemporaryDirectory() as temporary:
        weights = "" if mask is None else as_file(mask, temporary, "mask")
        return _itn.target_from_file(scene._scene, sensor, os.fspath(file), weights, *how)


def photo(scene: Scene, file: str | os.PathLike, *, mask: Any = None, sensor: int = 0,
          curve: str | float = "auto", saturation: float = 0.99) -> _itn.Target:
    """A target made of a picture's file: PNG, JPEG or TIFF, averaged down to the film's size where it is larger.

    curve: the camera's transfer curve, "srgb", "linear", an exponent such as 2.2, or "auto": linear for TIFF files of 16
    bits, else sRGB. saturation: pixels with a sample of so much of the file's largest and more are left out. mask: a file
    or an array whose pixels weigh the photo's; its own alpha weighs them, too. `note` of the result says what was done. The photo's
    exposure is unknown as a rule: `exposure=True` of `itn.invert` and `itn.gradient`."""
    return _target_from_file(scene, sensor, file, mask, str(curve), float(saturation))


def make_targets(scene: Scene, target: Any, mask: Any, sensor: int | Sequence[int] | None
                 ) -> tuple[list[_itn.Target], list[int]]:
    """One target, or a list of them, one a sensor, with masks likewise."""
    several = isinstance(target, (list, tuple))
    targets = list(target) if several else [target]
    one = not several or isinstance(mask, (str, os.PathLike))
    masks = [None] * len(targets) if mask is None else [mask] if one else list(mask)
    if sensor is None:
        sensors = list(range(len(targets)))
    else:
        sensors = list(sensor) if isinstance(sensor, (list, tuple)) else [sensor]
    if not len(targets) == len(masks) == len(sensors):
        raise _itn.UsageError(f"got {len(targets)} targets, {len(masks)} masks and {len(sensors)} sensors; need one each")
    for index in sensors:
        samples(scene, 1, index)  # is it there?
    return [make_target(scene, s, t, m) for s, t, m in zip(sensors, targets, masks)], sensors


@dataclass(repr=False)
class Gradient:
    """A mean squared difference of images and its gradient; both unbiased, from the same paths.

    `gradient` has the loss's unit (radiance squared) over the parameter's; of textures and grids it is an array of the
    same shape, and `stderr` has the error of its sum.
    """

    loss: float
    loss_stderr: float
    gradient: dict[str, float | np.ndarray]
    stderr: dict[str, float]
    exposures: list[float]

    def __getitem__(self, name: str) -> float | np.ndarray:
        return self.gradient[name]

    def _rows(self) -> list[tuple[str, str, str]]:
        return [(name, f"norm {np.linalg.norm(value):.6g}" if np.ndim(value) else f"{value:.6g}",
                 f"{self.stderr[name]:.2g}") for name, value in self.gradient.items()]

    def __repr__(self) -> str:
        lines = [f"loss {self.loss:.6g} +- {self.loss_stderr:.2g}"]
        return "\n".join(lines + [f"d loss / d {name}: {value} +- {error}" for name, value, error in self._rows()])

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{html.escape(n)}</td><td>{v}</td><td>{e}</td></tr>" for n, v, e in self._rows())
        return (f"<p>loss {self.loss:.6g} ± {self.loss_stderr:.2g}</p><table><tr><th>parameter</th><th>gradient</th>"
                f"<th>standard error</th></tr>{rows}</table>")


def gradient(scene: Scene, target: Image | Sequence[Image], parameters: Sequence[str], spp: int = 0, seed: int = 0, *,
             mask: Any = None, sensor: int | Sequence[int] | Mapping[str, Any] | None = None, exposure: bool = False,
             mode: str = "automatic", operator: str = "full",
             progress: bool | Callable[[float], object] | None = None) -> Gradient:
    """The mean squared difference of the scene's image from the target, and its gradient: `itn gradient`.

    Both are unbiased, though they come from the same paths: products are of different samples of a pixel (a
    U-statistic), so spp is 2 at least. parameters: names; textures and grids, too, by each texel or voxel. target: an array
    of the film's size, a Rendering, or a file (OpenEXR, or a photo, see `itn.photo`); several, one a sensor. mask: weights of
    the pixels. exposure: the target is known up to a factor. mode: "images" (derivative images), "adjoint" (replayed paths), "automatic".
    """
    scene, sensor = seen_by(scene, sensor)
    targets, sensors = make_targets(scene, target, mask, sensor)
    if mode not in ("automatic", "images", "adjoint"):
        raise _itn.UsageError(f"mode: got {mode!r}, need 'automatic', 'images' or 'adjoint'")
    spp = samples(scene, spp, sensors[0], least=2)
    names = scene._scene.by_component(list(parameters))
    with shown(progress, "gradient") as tell:
        result = _itn.image_loss(scene._scene, None, names, targets, sensors, spp, seed_number(seed), 0,
                                 operator_flag(operator), exposure, mode, True, tell)
    return Gradient(result["loss"], result["loss_stderr"], {**result["gradient"], **result["values"]},
                    result["gradient_stderr"], result["exposures"])


@dataclass(repr=False)
class Gradcheck:
    """Each derivative beside a central difference with the same random numbers. `parameters` has the numbers, as the
    JSON of `itn gradcheck`; `bound` is what the z-scores of all keep by chance."""

    passed: bool
    bound: float
    parameters: dict[str, dict]
    not_differentiable: dict[str, str]
    json: dict

    def __bool__(self) -> bool:
        return self.passed

    def __repr__(self) -> str:
        lines = [f"{'passed' if self.passed else 'FAILED'}: |z| up to {self.bound:.2f} is chance"]
        for name, p in self.parameters.items():
            for d, f, z in zip(p["derivative"], p["difference"], p["z"]):
                lines.append(f"{name}: derivative {d:.5g}, difference {f:.5g}, z {z:.2f}{'' if abs(z) <= self.bound else '  FAILED'}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>"


def gradcheck(scene: Scene, parameters: Sequence[str] = (), spp: int = 0, seed: int = 0, *,
              sensor: int | Mapping[str, Any] = 0, operator: str = "full", progress: bool | Callable[[float], object] | None = None) -> Gradcheck:
    """Each derivative of the image against a central difference with common random numbers: `itn gradcheck`.

    parameters: default all by which the image can be differentiated. The result is true where all agree."""
    scene, sensor = seen_by(scene, sensor)
    spp = samples(scene, spp, sensor)
    with shown(progress, "gradcheck") as tell:
        text = _itn.gradcheck(scene._scene, list(parameters), spp, seed_number(seed), sensor, operator_flag(operator), tell)
    result = json.loads(text)
    return Gradcheck(result["passed"], result["bound"], result["parameters"], result["not_differentiable"], result)
