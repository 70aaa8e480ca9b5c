"""Images and their derivatives."""
from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _itn
from .picture import as_html
from .progress import shown
from .scene import Scene
from .scene_dict import seen_by
from .warning import tell


@dataclass(repr=False)
class Rendering:
    """An image with its standard error, and derivative images.

    All arrays are float32, (height, width, channels), row 0 on top, linear; radiance in the scene's units. Channels are
    R, G, B, or one of luminance. A derivative has the image's unit over the parameter's.
    """

    image: np.ndarray
    stderr: np.ndarray                          # standard error of each value
    derivatives: dict[str, np.ndarray]          # by name of the parameter
    derivatives_stderr: dict[str, np.ndarray]
    mean: list[float]                           # over the pixels, a channel each
    mean_stderr: list[float]
    spp: int
    paths: int
    misplaced: int                              # paths that met a surface from where they cannot be
    endless: int                                # paths that were ended without max_depth: the image is too dark
    build_s: float                              # scene to device, kernels
    render_s: float
    scene: str = field(default="")

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return self.image if dtype is None else self.image.astype(dtype)

    def __repr__(self) -> str:
        height, width, _ = self.image.shape
        mean = " ".join(f"{m:.4g} +- {e:.1g}" for m, e in zip(self.mean, self.mean_stderr))
        by = f", derivatives by {', '.join(self.derivatives)}" if self.derivatives else ""
        return f"<itn.Rendering {width} x {height}, {self.spp} spp, mean {mean}{by}>"

    def _repr_html_(self) -> str:
        pictures = as_html(self.image, html.escape(f"{self.scene} {self.spp} spp"))
        for name, derivative in self.derivatives.items():
            pictures += as_html(derivative, html.escape(f"by {name}"), signed=True)
        return pictures


def operator_flag(operator: str) -> bool:
    if operator not in ("full", "single"):
        raise _itn.UsageError(f"operator: got {operator!r}, need 'full' (all light) or 'single' (one scattering in a medium)")
    return operator == "single"


def samples(scene: Scene, spp: int, sensor: int, least: int = 1) -> int:
    """spp, or the scene's own where it is 0."""
    if not isinstance(sensor, (int, np.integer)) or not 0 <= sensor < len(scene.sensors):
        raise _itn.UsageError(f"sensor {sensor}: the scene has sensors 0 to {len(scene.sensors) - 1}")
    result = spp or scene.sensors[sensor]["spp"]
    if not isinstance(result, (int, np.integer)) or not least <= result < 1 << 30:
        raise _itn.UsageError(f"spp: got {result}, need a whole number from {least} to {(1 << 30) - 1}")
    return result


def seed_number(seed: int) -> int:
    if not isinstance(seed, (int, np.integer)) or not 0 <= seed < 1 << 64:
        raise _itn.UsageError(f"seed: got {seed}, need a whole number from 0 to 2^64 - 1")
    return int(seed)


def render(scene: Scene, spp: int = 0, seed: int = 0, derivatives: Sequence[str] = (), *,
           sensor: int | Mapping[str, Any] = 0,
           operator: str = "full", progress: bool | Callable[[float], object] | None = None) -> Rendering:
    """An image of the scene with its standard error, and its derivative by each of the parameters named.

    spp: samples a pixel; 0: the scene's own. seed: the same gives the same bits, and those of `itn render --seed`; images
    of different seeds are independent. derivatives: names of parameters; a colour's name stands for its three components.
    operator: "full", or "single" for paths that scatter exactly once in a medium. progress: True for a bar, or a function
    that gets the fraction done. sensor: its number in the scene, or a dictionary, as in `load_dict`: a sensor that the scene
    itself does not have.

    What its values do not say becomes a warning (`itn.Warning`): no path found light, or paths were where they cannot be.
    The interpreter's lock is released while it renders; Ctrl-C ends it with KeyboardInterrupt.
    """
    scene, sensor = seen_by(scene, sensor)
    spp = samples(scene, spp, sensor)
    names = scene._scene.by_component(list(derivatives))
    with shown(progress, "render") as done:
        result = _itn.render(scene._scene, None, names, spp, seed_number(seed), sensor, operator_flag(operator), 0, done)
    tell(result.pop("warnings"))
    return Rendering(**result, scene=scene.file)
