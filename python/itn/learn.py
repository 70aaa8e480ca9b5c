"""Networks, their training and evaluation, data sets and shapes."""
from __future__ import annotations

import html
import json
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _itn
from .exr import as_file, read_exr
from .picture import as_html
from .progress import shown
from .rendering import seed_number
from .scene import Scene
from .warning import tell

Progress = "bool | Callable[[float], object] | None"


@dataclass(frozen=True, repr=False)
class Shape:
    """A closed mesh, resting on z = 0, its longest side 1."""

    name: str
    role: str                   # train, test or random
    vertices: np.ndarray        # (n, 3) float32
    triangles: np.ndarray       # (m, 3) uint32
    volume: float
    genus: int

    def write(self, file: str | os.PathLike) -> None:
        """As a PLY file."""
        _itn.write_mesh(os.fspath(file), self.vertices, self.triangles)

    def __repr__(self) -> str:
        return f"<itn.Shape {self.name}: {len(self.triangles)} triangles, volume {self.volume:.4f}, genus {self.genus}>"


def shapes(random: int = 0, seed: int = 0, *, names: Sequence[str] | None = None) -> list[Shape]:
    """The ten closed meshes of the data set, and so many random ones of the seeds seed, seed + 1, ...: `itn shapes`.

    names: of the ten only these (some tenths of a second each)."""
    made = [_itn.named_shape(name) for name in (_itn.shape_names() if names is None else names)]
    made += [_itn.random_shape(seed_number(seed + k)) for k in range(random)]
    return [Shape(**shape) for shape in made]


@dataclass(frozen=True, repr=False)
class DataSet:
    """A data set's folder. `manifest` has its images with their parameters (docs/reference/data-sets.md)."""

    folder: str
    manifest: dict
    rendered: int   # now; the others were there

    @property
    def images(self) -> list[dict]:
        return self.manifest["images"]

    def image(self, index: int) -> np.ndarray:
        """Luminance, (size, size), or of a set in colours (size, size, 3)."""
        channels = read_exr(Path(self.folder) / self.images[index]["file"])
        return np.stack([channels[c] for c in "RGB"], -1) if self.manifest.get("in_colours") else channels["Y"]

    def __len__(self) -> int:
        return len(self.images)

    def __repr__(self) -> str:
        return f"<itn.DataSet {self.folder}: {len(self)} images of {self.manifest['size']} x {self.manifest['size']} pixels>"

    def _repr_html_(self) -> str:
        some = range(0, len(self), max(1, len(self) // 8))
        return f"<p>{html.escape(repr(self)[1:-1])}</p>" + "".join(
            as_html(np.atleast_3d(self.image(i)), html.escape(self.images[i]["split"])) for i in list(some)[:8])


def dataset(config: str | os.PathLike | Mapping[str, Any], output: str | os.PathLike, *, spp: int = 0,
            seed: int | None = None, progress: bool | Callable[[float], object] | None = None) -> DataSet:
    """Renders a data set, shapes x lights x materials, into a folder: `itn dataset`.

    config: a preset ("tiny", "laptop", "varied", "world", "paper"), a JSON file, or the same as a dictionary; meshes and environments
    in a dictionary are found from the current folder. Stopped by Ctrl-C, the same call goes on where it was."""
    folder = os.fspath(output)
    with tempfile.TemporaryDirectory() as temporary, shown(progress, "dataset") as tell:
        name = os.fspath(config) if not isinstance(config, Mapping) else ""
        if not name:
            name = os.path.join(temporary, "config.json")
            with open(name, "w", encoding="utf-8") as file:
                json.dump(_absolute(config), file)
        result = _itn.dataset(name, folder, spp, None if seed is None else seed_number(seed), tell)
    with open(Path(folder) / "manifest.json", encoding="utf-8") as file:
        return DataSet(folder, json.load(file), result["rendered"])


def _absolute(config: Any) -> Any:
    if isinstance(config, Mapping):
        return {key: _absolute(value) for key, value in config.items()}
    if isinstance(config, (list, tuple)):
        return [_absolute(value) for value in config]
    return os.path.abspath(config) if isinstance(config, (str, os.PathLike)) and os.path.isfile(config) else config


@dataclass(frozen=True, repr=False)
class Prediction:
    """What a network says about images: of each output an array, a number an image.

    intervals: of each output (images, 2), the ends of its 95 % interval; empty of a network that says no distribution. doubt: a number
    an image, of the judge where there is one, else None; above doubt_limit, as few right ones are, an image is unlike what the network
    learnt from."""

    parameters: dict[str, np.ndarray]
    intervals: dict[str, np.ndarray]
    unit_of_sigma_t: str    # 1/mm; of images in a scene 1/scene unit
    network: dict
    doubt: np.ndarray | None = None
    doubt_limit: float | None = None

    def __getitem__(self, name: str) -> np.ndarray:
        return self.parameters[name]

    def __repr__(self) -> str:
        def line(name: str) -> str:
            text = f"{name}: {np.array2string(self.parameters[name], precision=4)}"
            if name not in self.intervals:
                return text
            low, high = (np.array2string(ends, precision=4) for ends in self.intervals[name].T)
            return f"{text}, 95 %: {low} to {high}"
        lines = list(map(line, self.parameters))
        if self.doubt is not None:
            lines.append(f"doubt: {np.array2string(self.doubt, precision=3)}, few right images are above {self.doubt_limit:.3f}")
        return "\n".join(lines)


def predict(images: Any, network: str | os.PathLike = "shipped", *, scene: Scene | None = None, sensor: int = 0,
            dataset: str | os.PathLike | None = None, shape_buffers: str | os.PathLike | None = None,
            light: Sequence[float] = (), mask: Any = (), flash: Any = (), longest_side: float = 0, judge: str | os.PathLike = "",
            progress: bool | Callable[[float], object] | None = None) -> Prediction:
    """Parameters for images by a network, with 95 % intervals where it says them: `itn predict`.

    images: square files (OpenEXR, or photos) or arrays, (size, size) of luminance or (size, size, 3), linear; one, or a
    list. network: the one that ships with the program, a folder that training wrote, or a .safetensors file. scene: of what
    the images show: gives shape, light and the unit of length. For networks that know shape and light also: dataset, the
    folder that the images belong to; or shape_buffers and light, as of the command. For those that see a mask or the light of a
    flash: mask and flash, of every image a file or an array, the flash's of the same exposure with the flash on. longest_side: of the object
    [mm]: sigma_t is told for it; 0: for one as large as those of the network's data set. Images of networks that see the
    object alone (`cut_out`) need not be square: they see the square around the mask. judge: a network that training with "judge"
    made, which says how much it doubts that images are like those that the network learnt from; `shipped-photos` has its
    own."""
    with tempfile.TemporaryDirectory() as temporary, shown(progress, "predict") as done:
        def as_files(images: Any, kind: str) -> list[str]:
            several = images if isinstance(images, (list, tuple)) else [images]
            return [as_file(image, temporary, f"{kind}{k}") for k, image in enumerate(several)]

        files = as_files(images, "image")
        result = _itn.predict(files, os.fspath(network), scene._scene if scene else None, sensor,
                              os.fspath(dataset or ""), os.fspath(shape_buffers or ""), list(map(float, light)),
                              as_files(mask, "mask"), as_files(flash, "flash"), longest_side,
                              os.fspath(judge), done)
    tell(result["warnings"])
    names = [output[0] for output in result["network"]["outputs"]]
    numbers = np.array(result["parameters"]).reshape(len(files), len(names), 3)
    intervals = {name: numbers[:, k, 1:] for k, name in enumerate(names)} if result["intervals"] else {}
    return Prediction({name: numbers[:, k, 0] for k, name in enumerate(names)}, intervals, "1/scene unit" if result["in_scene"] else "1/mm",
                      result["network"], np.array(result["doubts"]) if result["doubts"] else None, result["doubt_limit"])


@dataclass(frozen=True, repr=False)
class Training:
    """A training's folder. `curve` has the losses of every epoch, `record` is run.json."""

    folder: str
    record: dict
    curve: list[dict]

    def __fspath__(self) -> str:
        return self.folder

    def __repr__(self) -> str:
        last = self.curve[-1] if self.curve else {}
        return f"<itn.Training {self.folder}: {len(self.curve)} epochs, validation loss {last.get('validation', float('nan')):.5f}>"


def train(data: str | os.PathLike | DataSet | Sequence[str] = (), network: str = "rn", output: str | os.PathLike = "", *,
          unlabelled: str | os.PathLike | DataSet = "", init: str | os.PathLike = "", epochs: int = 50, batch: int = 32,
          learning_rate: float = 1e-4,
          weight_decay: float = 0, noise: float = 0, mirror: bool = False, patience: int = 0,
          inputs: Sequence[str] = (), exposure: bool = False, cut_out: bool = False, channels: int | None = None,
          width: int | None = None, threads: int | None = None,
          image_weight: float | None = None, distribution: bool = False,
          seed: int = 0, spp: int = 0,
          progress: bool | Callable[[float], object] | None = None) -> Training:
    """Trains a network on data sets: `itn train`, with the same options and the same numbers.

    network: "rn" learns parameters; "itn", "ssn" also that the image rendered with them looks like the input (all light;
    single scattering), weighed with image_weight (lambda); "judge" to tell the images from ones in which something is wrong, for `predict`. inputs: what a new network sees, of "image" (in colours where the data
    set is), "flash", "mask", "normal", "nearness" and "light", in place of channels; exposure: each image over its own mean, known up to a factor; cut_out: it
    sees the object alone, by its mask, and black around it. distribution: an "rn" also learns how sure it is, calibrated on the
    validation images.
    unlabelled: instead of data, a data set whose materials nobody knows; with "itn" and init. output: folder, where a training that was stopped goes on."""
    if not output:
        raise _itn.UsageError("output: need a folder for the network and what goes on from")
    if network not in ("rn", "itn", "ssn", "judge"):
        raise _itn.UsageError(f"network: got {network!r}, need 'rn', 'itn', 'ssn' or 'judge'")
    several = data if isinstance(data, (list, tuple)) else [data]
    folders, unknown = ([d.folder if isinstance(d, DataSet) else os.fspath(d) for d in sets]
                        for sets in (several, [unlabelled]))
    folder = os.fspath(output)
    with shown(progress, "train") as tell:
        record = _itn.train(folders, unknown[0], network, folder, os.fspath(init), list(inputs), exposure, cut_out, channels, width, threads,
                            image_weight, distribution, mirror, noise,
                            epochs, batch, patience, learning_rate, weight_decay, seed_number(seed), spp, tell)
    with open(Path(folder) / "curve.jsonl", encoding="utf-8") as file:
        return Training(folder, json.loads(record), [json.loads(line) for line in file])


def evaluate(data: str | os.PathLike | DataSet, runs: Sequence[str | os.PathLike], output: str | os.PathLike, *,
             images: int = 120, inversions: int = 10, iterations: int = 200, learning_rate: float = 0.05, spp: int = 0,
             seed: int = 0, threads: int | None = None,
             progress: bool | Callable[[float], object] | None = None) -> dict:
    """The paper's tables for trained networks: `itn eval`. Returns what its --json says; output/report.html shows it."""
    folder = data.folder if isinstance(data, DataSet) else os.fspath(data)
    os.makedirs(output, exist_ok=True)
    with shown(progress, "evaluate") as tell:
        return json.loads(_itn.evaluate(folder, [os.fspath(r) for r in runs], os.fspath(output), images, inversions,
                                        iterations, learning_rate, spp, seed_number(seed), threads, tell))
