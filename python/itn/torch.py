"""itn inside PyTorch: rendering, image losses, networks and data sets.

    import itn, itn.torch
    scene = itn.load("scene.xml")
    albedo = torch.tensor(0.8, requires_grad=True)
    loss = itn.torch.image_loss(scene, {"wax.albedo": albedo}, photo, spp=16, seed=step)
    loss.backward()

Tensors are on the CPU; the device that itn renders on is its own matter (`itn.set_device`). The same seeds give the same
bits from run to run.
"""
from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from . import _itn
from .exr import float_array
from .gradient import make_target
from .rendering import operator_flag, samples, seed_number
from .scene import Scene
from .scene_dict import seen_by
from .warning import tell


@dataclass(frozen=True)
class _Input:
    """One tensor, and the scene's parameters that it gives values to: one number, a colour's three, or an array."""

    names: tuple[str, ...]
    is_array: bool


@dataclass(frozen=True)
class _Call:
    """All of a rendering but the parameters' values."""

    scene: Scene
    inputs: tuple[_Input, ...]
    batch: int | None       # how many images side by side; None: one, without a dimension for it
    spp: int
    seeds: tuple[int, ...]
    sensor: int
    single: bool
    independent: bool = True
    targets: tuple = ()
    exposure: bool = False
    mode: str = "automatic"

    @property
    def numbers(self) -> list[str]:
        return [name for i in self.inputs if not i.is_array for name in i.names]

    @property
    def arrays(self) -> list[str]:
        return [name for i in self.inputs if i.is_array for name in i.names]

    def matrix(self, tensors: Sequence[torch.Tensor]) -> np.ndarray:
        """(images, numbers) of a batch."""
        columns = []
        for tensor, i in zip(tensors, self.inputs):
            values = tensor.detach().cpu().double().numpy()
            if values.ndim == 0 or (values.ndim == 1 and len(i.names) == 3 and values.shape != (self.batch,)):
                values = np.broadcast_to(values, (self.batch, *values.shape))
            columns.append(np.broadcast_to(values.reshape(self.batch, -1), (self.batch, len(i.names))))
        return np.ascontiguousarray(np.concatenate(columns, axis=1))

    def variant(self, tensors: Sequence[torch.Tensor]) -> _itn.Variant:
        numbers, arrays = {}, {}
        for tensor, i in zip(tensors, self.inputs):
            if i.is_array:
                arrays[i.names[0]] = float_array(tensor)
            else:
                values = tensor.detach().cpu().double().numpy()
                numbers.update(zip(i.names, map(float, np.broadcast_to(values, len(i.names)))))
        return self.scene._scene.variant(numbers, arrays)

    def wanted(self, needed: Sequence[bool]) -> list[str]:
        """The parameters by which to differentiate."""
        return [name for i, want in zip(self.inputs, needed) if want for name in i.names]

    def gradients(self, needed: Sequence[bool], tensors: Sequence[torch.Tensor], numbers: Mapping[str, Any],
                  arrays: Mapping[str, np.ndarray], factor: torch.Tensor | float = 1) -> list[torch.Tensor | None]:
        """One a tensor; numbers: of each parameter a float, or of a batch (images,)."""
        result: list[torch.Tensor | None] = []
        for tensor, i, want in zip(tensors, self.inputs, needed):
            if not want:
                result.append(None)
                continue
            if i.is_array:
                value = torch.from_numpy(arrays[i.names[0]])
            else:
                value = torch.stack([torch.as_tensor(numbers[name], dtype=torch.float64) for name in i.names], dim=-1)
            if self.batch is not None:
                value = value * (factor.double()[:, None] if isinstance(factor, torch.Tensor) and factor.ndim else factor)
                if tensor.ndim == 0 or (tensor.ndim == 1 and len(i.names) == 3 and tensor.shape != (self.batch,)):
                    value = value.sum(0)
            else:
                value = value * factor
            if value.numel() != tensor.numel():  # one number for a colour's components
                value = value.sum(-1)
            result.append(value.reshape(tensor.shape).to(tensor))
        return result


def _call(scene: Scene, parameters: Mapping[str, torch.Tensor], spp: int, seed: int | Sequence[int], sensor: int,
          operator: str, least: int, batch: int | None = None, **more: Any) -> tuple[_Call, list[torch.Tensor]]:
    inputs, tensors = [], []
    for name, value in parameters.items():
        tensor = value if isinstance(value, torch.Tensor) else torch.as_tensor(value)
        names = tuple(scene._scene.by_component([name]))
        is_array = scene._scene.has_values(names[0])
        inputs.append(_Input(names, is_array))
        tensors.append(tensor)
        if is_array:
            need = scene._scene.describe(names[0])["shape"]
            if tuple(tensor.shape) != tuple(need):
                raise _itn.UsageError(f"parameter {name}: got a tensor of shape {tuple(tensor.shape)}, need {tuple(need)}")
            continue
        own = 0 if len(names) == 1 else 1
        shape = tuple(tensor.shape)
        fits = shape == () or (own and shape == (len(names),))
        if not fits and (shape[1:] in ((), (len(names),)) and (own or shape[1:] == ())):
            if batch is not None and batch != shape[0]:
                raise _itn.UsageError(f"parameter {name}: got a batch of {shape[0]}, elsewhere it is one of {batch}")
            batch = shape[0]
        elif not fits:
            raise _itn.UsageError(f"parameter {name}: got a tensor of shape {shape}, need one number"
                                  f"{', or ' + str(len(names)) if own else ''}, or a batch of those")
    if batch is not None and any(i.is_array for i in inputs):
        raise _itn.UsageError("a batch of images has numbers as parameters alone; render textures and grids one by one")
    if len({name for i in inputs for name in i.names}) != sum(len(i.names) for i in inputs):
        raise _itn.UsageError("parameters: one is named twice")
    count = 1 if batch is None else batch
    seeds = [seed + k for k in range(count)] if isinstance(seed, int) else [int(s) for s in seed]
    if len(seeds) != count:
        raise _itn.UsageError(f"seed: got {len(seeds)} numbers for {count} images")
    return _Call(scene, tuple(inputs), batch, samples(scene, spp, sensor, least), tuple(map(seed_number, seeds)), sensor,
                 operator_flag(operator), **more), tensors


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx, call: _Call, *tensors: torch.Tensor) -> torch.Tensor:
        ctx.call = call
        ctx.save_for_backward(*tensors)
        ctx.save_for_forward(*tensors)
        scene = call.scene._scene
        if call.batch is not None:
            return torch.from_numpy(_itn.render_batch(scene, call.numbers, call.matrix(tensors), call.spp, call.seeds, 0,
                                                      call.sensor, call.single, None))
        variant = call.variant(tensors)
        result = _itn.render(scene, variant, [], call.spp, call.seeds[0], call.sensor, call.single, 0, None)
        tell(result["warnings"], stacklevel=3)
        return torch.from_numpy(result["image"])

    @staticmethod
    def backward(ctx, grad: torch.Tensor):
        call, tensors = ctx.call, ctx.saved_tensors
        needed = ctx.needs_input_grad[1:]
        names = call.wanted(needed)
        weights = float_array(grad)
        first = call.spp if call.independent else 0
        scene = call.scene._scene
        if call.batch is not None:
            sums = _itn.weigh_batch(scene, call.numbers, call.matrix(tensors), weights, call.spp, call.seeds, first,
                                    call.sensor, call.single)
            numbers = {name: sums[:, k].copy() for k, name in enumerate(call.numbers)}
            return None, *call.gradients(needed, tensors, numbers, {})
        sums = _itn.weigh(scene, call.variant(tensors), names, weights, call.spp, call.seeds[0], first, call.sensor,
                          call.single)
        return None, *call.gradients(needed, tensors, sums["gradient"], sums["values"])

    @staticmethod
    def jvp(ctx, _, *tangents: torch.Tensor | None):
        call, tensors = ctx.call, ctx.saved_tensors
        if call.batch is not None:
            raise NotImplementedError("forward mode: one image at a time")
        result = None
        names = call.wanted([t is not None for t in tangents])
        first = call.spp if call.independent else 0
        images = _itn.render(call.scene._scene, call.variant(tensors), names, call.spp, call.seeds[0], call.sensor,
                             call.single, first, None)["derivatives"]
        for i, tangent in zip(call.inputs, tangents):
            if tangent is None:
                continue
            for name, part in zip(i.names, tangent.reshape(-1).expand(len(i.names))):
                term = torch.from_numpy(images[name]) * part
                result = term if result is None else result + term
        return result


def render(scene: Scene, parameters: Mapping[str, torch.Tensor], spp: int = 0, seed: int | Sequence[int] = 0, *,
           sensor: int | Mapping[str, Any] = 0, operator: str = "full", independent: bool = True) -> torch.Tensor:
    """The scene's image, (height, width, channels), as a function of some of its parameters.

    parameters: a tensor for each name: a number; a colour's three; a texture (height, width, channels) or a grid (depth,
    height, width, channels). The scene itself keeps its values. With a batch of numbers, (images,) or (images, 3), the
    result is (images, height, width, channels), all rendered side by side; the images get the seeds seed, seed + 1, ...

    backward() replays paths (as long for many parameters as for one); forward mode makes derivative images. With
    `independent` they are of other samples than the image. That is what an unbiased gradient of a loss needs: the image
    and its derivative in grad = f'(image) d image would else share their noise, and the mean of the product is not
    the product of the means. A loss that is not linear has a biased value all the same (E f(image) is not f(E image)):
    for squared differences use `image_loss`, which has neither.
    """
    scene, sensor = seen_by(scene, sensor)
    call, tensors = _call(scene, parameters, spp, seed, sensor, operator, 1, independent=independent)
    return _Render.apply(call, *tensors)


class _ImageLoss(torch.autograd.Function):
    @staticmethod
    def forward(ctx, call: _Call, *tensors: torch.Tensor) -> torch.Tensor:
        ctx.call = call
        ctx.save_for_backward(*tensors)
        needed = ctx.needs_input_grad[1:]
        names = call.wanted(needed)
        scene = call.scene._scene
        if call.batch is not None:
            result = _itn.batch_loss(scene, call.numbers, call.matrix(tensors), list(call.targets), call.spp, call.seeds, 0,
                                     call.sensor, call.single, None)
            ctx.numbers = {name: result["gradient"][:, k].copy() for k, name in enumerate(call.numbers)}
            ctx.arrays = {}
            return torch.from_numpy(result["loss"]).to(tensors[0].dtype)
        result = _itn.image_loss(scene, call.variant(tensors), names, list(call.targets), [call.sensor], call.spp,
                                 call.seeds[0], 0, call.single, call.exposure, call.mode, False, None)
        ctx.numbers, ctx.arrays = result["gradient"], result["values"]
        return torch.tensor(result["loss"], dtype=tensors[0].dtype if tensors else torch.float32)

    @staticmethod
    def backward(ctx, grad: torch.Tensor):
        needed = ctx.needs_input_grad[1:]
        return None, *ctx.call.gradients(needed, ctx.saved_tensors, ctx.numbers, ctx.arrays, grad)


def image_loss(scene: Scene, parameters: Mapping[str, torch.Tensor], target: Any, spp: int = 16,
               seed: int | Sequence[int] = 0, *, mask: Any = None, sensor: int | Mapping[str, Any] = 0, operator: str = "full",
               exposure: bool = False, mode: str = "automatic") -> torch.Tensor:
    """The mean squared difference between the scene's image and a target, value and gradient both unbiased.

    Were they computed as `((render(...) - target) ** 2).mean()` from one set of samples, the value would be too large by
    the image's variance, and the gradient wrong by the covariance of the image with its derivative. Here products are of
    different samples of each pixel, so spp is 2 at least, and no sample is wasted. The value can be negative: it is an
    estimate of something small.

    parameters: as for `render`; of a batch the result is (images,), and target a list or (images, height, width,
    channels), one of each. target: a tensor or array of the film's size, an itn.Rendering, an OpenEXR file, or what
    `target()` made of those, which is quicker in a loop. mask: weights of the pixels. exposure: known up to a factor.
    Give every step another seed.
    """
    if mode not in ("automatic", "images", "adjoint"):
        raise _itn.UsageError(f"mode: got {mode!r}, need 'automatic', 'images' or 'adjoint'")
    scene, sensor = seen_by(scene, sensor)
    call, tensors = _call(scene, parameters, spp, seed, sensor, operator, 2, exposure=exposure, mode=mode)
    if call.batch is None:
        targets = (make_target(scene, sensor, target, mask),)
    else:
        if exposure:
            raise _itn.UsageError("exposure: of single images, not of a batch")
        target = _one_each("target", target, call.batch)
        same = mask is None or isinstance(mask, (str, os.PathLike)) or getattr(mask, "ndim", 0) == 2
        masks = [mask] * call.batch if same else _one_each("mask", mask, call.batch)
        targets = tuple(make_target(scene, sensor, t, m) for t, m in zip(target, masks))
    return _ImageLoss.apply(_Call(**{**call.__dict__, "targets": targets}), *tensors)


def _one_each(what: str, given: Any, batch: int) -> list:
    """One an image of a batch, as a list."""
    if isinstance(given, (str, os.PathLike, _itn.Target)) or not hasattr(given, "__len__") or getattr(given, "ndim", 1) == 0:
        raise _itn.UsageError(f"{what}: got one, need {batch}, one an image of the batch")
    if len(given) != batch:
        raise _itn.UsageError(f"{what}: got {len(given)}, need {batch}, one an image of the batch")
    return list(given)


def target(scene: Scene, image: Any, mask: Any = None, sensor: int = 0) -> _itn.Target:
    """A target that is checked and copied once, for many calls of `image_loss`."""
    return make_target(scene, sensor, image, mask)


class Network(torch.nn.Module):
    """A network of itn as a torch module: seven stages of a 3x3 convolution, ReLU and 2x2 maximum, and one linear layer.

    `forward(images)` takes (images, channels, size, size) as `input()` makes them, and returns raw outputs, equal to itn's own
    to rounding; `values(raw)` turns those into parameters, `intervals(raw)` into their 95 % intervals where the network says
    a distribution. `description` says what it was trained on.
    """

    def __init__(self, network: _itn.Network):
        super().__init__()
        self.description: dict = network.description
        self.outputs: list[tuple[str, float, float, bool]] = self.description["outputs"]
        weights = network.weights()
        stages = sum(name.startswith("convolution") and name.endswith("weight") for name in weights)
        self.convolutions = torch.nn.ModuleList()
        for k in range(stages):
            weight = torch.from_numpy(weights[f"convolution{k}.weight"])
            layer = torch.nn.Conv2d(weight.shape[1], weight.shape[0], 3, padding=1)
            layer.weight.data, layer.bias.data = weight, torch.from_numpy(weights[f"convolution{k}.bias"])
            self.convolutions.append(layer)
        weight = torch.from_numpy(weights["fully_connected.weight"])
        self.last = torch.nn.Linear(weight.shape[1], weight.shape[0])
        self.last.weight.data, self.last.bias.data = weight, torch.from_numpy(weights["fully_connected.bias"])

    def input(self, image: torch.Tensor, **others: torch.Tensor) -> torch.Tensor:
        """What the network sees (description["inputs"]), (..., channels, size, size), of an image: linear luminance
        (..., size, size), or (..., 3, size, size) of one that sees colours. others, where it sees more: flash, the light that a
        flash adds, like the image; mask, nearness and light (..., size, size); normal (..., 3, size, size)."""
        colours = "rgb" in self.description["inputs"]
        over = (-3, -2, -1) if colours else (-2, -1)
        for name, values in {"image": image, **others}.items():
            in_colours = name == "normal" or (colours and name in ("image", "flash"))
            need = (*image.shape[:-3 if colours else -2], *((3,) if in_colours else ()), *image.shape[-2:])
            if image.ndim < (3 if colours else 2) or tuple(values.shape) != need:
                raise _itn.UsageError(f"{name}: got a tensor of shape {tuple(values.shape)}, need "
                                      f"{need if name != 'image' else '(..., 3, height, width)' if colours else '(..., height, width)'}")
        object = torch.ones_like(image)
        if self.description["cut_out"]:  # sees nothing else
            if "mask" not in others:
                raise _itn.UsageError("the network sees the object alone: give mask=")
            image, others = self._cut_out(image, others)
            object = object * (others["mask"].unsqueeze(-3) if colours else others["mask"])
        channels = []
        for name in self.description["inputs"]:
            role = {"luminance": "image", "rgb": "image", "flash_luminance": "flash", "flash_rgb": "flash"}.get(name, name)
            values = image if role == "image" else others.get(role)
            if values is None:
                raise _itn.UsageError(f"the network sees {role!r}: give {role}=")
            if role in ("image", "flash"):
                m = self.description["luminance"]
                if self.description["exposure"]:
                    m = ((values * object).sum(over, keepdim=True) / object.sum(over, keepdim=True)).clamp(min=1e-30)
                values = torch.log((values.clamp(min=0) * object + 0.01 * m) / (1.01 * m))
            channels.append(values if name in ("rgb", "flash_rgb", "normal") else values.unsqueeze(-3))
        return torch.cat(channels, -3)

    def _cut_out(self, image: torch.Tensor, others: dict[str, torch.Tensor]) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
        """The square around the object of each image, and what else is seen of it."""
        mask, size = others["mask"], self.description["size"]
        planes = {"image": image, **{k: v for k, v in others.items() if k != "mask"}}
        cut = {name: values.detach().clone() for name, values in {**planes, "mask": mask}.items()}
        for index in np.ndindex(*mask.shape[:-2]):
            rows = {name: values[index].reshape(-1, *mask.shape[-2:]) for name, values in planes.items()}
            found, seen = _itn.cut_out(float_array(torch.cat(list(rows.values()))), float_array(mask[index]), size,
                                       self.description["cut_out"])
            cut["mask"][index] = torch.from_numpy(seen)
            parts = torch.from_numpy(found).split([len(row) for row in rows.values()])
            for (name, values), part in zip(planes.items(), parts):
                cut[name][index] = part.reshape(values[index].shape)
        return cut.pop("image"), cut

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        for layer in self.convolutions:
            images = torch.relu(layer(images))
            if images.shape[-1] > 1:
                images = torch.nn.functional.max_pool2d(images, 2)
        return self.last(images.flatten(1))

    def _check_raw(self, raw: torch.Tensor) -> None:
        if raw.ndim != 2 or raw.shape[1] != self.last.out_features:
            raise _itn.UsageError(f"raw: got a tensor of shape {tuple(raw.shape)}, need (images, {self.last.out_features})")

    def values(self, raw: torch.Tensor) -> dict[str, torch.Tensor]:
        """Parameters by name, from raw outputs (images, outputs); sigma_t in 1/mm."""
        self._check_raw(raw)
        return self._of_shares(torch.sigmoid(raw[:, :len(self.outputs)]))

    def shares(self, raw: torch.Tensor) -> torch.distributions.MultivariateNormal:
        """The distribution that raw outputs say: of the outputs' shares, 0 at the low end of their ranges, 1 at the high one
        (of sigma_t by its logarithm)."""
        if not self.description["distribution"]:
            raise _itn.UsageError("this network says parameters, and no distribution of them")
        self._check_raw(raw)
        n = len(self.outputs)
        deviation = torch.exp(raw[:, n:2 * n]) * torch.tensor(self.description["spread"]).to(raw) / 12 ** 0.5
        factor = torch.eye(n).to(raw).repeat(len(raw), 1, 1)
        row, column = torch.tril_indices(n, n, -1)
        factor[:, row, column] = raw[:, 2 * n:]
        factor = factor / factor.norm(dim=-1, keepdim=True) * deviation[:, :, None]
        return torch.distributions.MultivariateNormal(torch.sigmoid(raw[:, :n]), scale_tril=factor)

    def intervals(self, raw: torch.Tensor) -> dict[str, torch.Tensor]:
        """95 % intervals by name, (images, 2), from raw outputs; sigma_t in 1/mm."""
        shares = self.shares(raw)
        half = torch.special.ndtri(torch.tensor(0.975, dtype=torch.float64)).item() * shares.stddev
        low, high = (self._of_shares((shares.mean + side * half).clamp(0, 1)) for side in (-1, 1))
        return {name: torch.stack([low[name], high[name]], dim=-1) for name in low}

    def _of_shares(self, share: torch.Tensor) -> dict[str, torch.Tensor]:
        return {name: low * (high / low) ** share[:, k] if logarithmic else low + (high - low) * share[:, k]
                for k, (name, low, high, logarithmic) in enumerate(self.outputs)}


def network(file: str | os.PathLike = "shipped") -> Network:
    """The network that ships with itn, or that of a training's folder or a .safetensors file, with its weights."""
    return Network(_itn.network(os.fspath(file)))


class Dataset(torch.utils.data.Dataset):
    """The images of a data set (`itn.dataset`): pairs of luminance (1, size, size), linear, or in colours (3, size, size), and
    a tensor of their `parameters`: sigma_t [1/mm], albedo, g, or in colours sigma_t.R, sigma_t.G, ...

    split: train, validation, unseen_light, unseen_shape, unseen_both; None: all. transform: of the image. `channels(index)`
    are all channels of an image's file by name: standard errors, and in sets that have them the flash's light, normals, depth
    and mask.
    """

    def __init__(self, folder: str | os.PathLike, split: str | None = "train", transform: Any = None):
        self.folder = Path(folder)
        try:
            manifest = json.loads((self.folder / "manifest.json").read_text(encoding="utf-8"))
        except OSError:
            raise _itn.InputError(f"{folder}: has no manifest.json; itn.dataset makes data sets") from None
        self.colours = manifest.get("in_colours", False)
        self.parameters = tuple(f"{name}.{letter}" for name in ("sigma_t", "albedo") for letter in "RGB") + ("g",) \
            if self.colours else ("sigma_t", "albedo", "g")
        self.images = [i for i in manifest["images"] if split in (None, i["split"])]
        if not self.images:
            splits = sorted({i["split"] for i in manifest["images"]})
            raise _itn.UsageError(f"split {split!r}: {folder} has no such images, only {', '.join(splits)}")
        self.transform = transform

    def __len__(self) -> int:
        return len(self.images)

    def __getitem__(self, index: int) -> tuple[torch.Tensor, torch.Tensor]:
        channels = self.channels(index)
        image = torch.stack([channels[letter] for letter in ("RGB" if self.colours else "Y")])
        if self.transform:
            image = self.transform(image)
        truth = self.images[index]
        return image, torch.tensor([float(value) for name in ("sigma_t", "albedo", "g") for value in np.atleast_1d(truth[name])])

    def channels(self, index: int) -> dict[str, torch.Tensor]:
        """All channels of an image's file, (size, size), by name."""
        file = self.folder / self.images[index]["file"]
        return {name: torch.from_numpy(values) for name, values in _itn.read_exr(str(file))[0].items()}
