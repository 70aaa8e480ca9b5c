"""itn export: the same parameters by onnxruntime as by itn predict."""
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import itn
from itn import _itn

onnxruntime = pytest.importorskip("onnxruntime")


def by_itn(program, run, images, *options):
    text = subprocess.run([program, "predict", run, *images, *options, "--json", "-"], check=True, capture_output=True, text=True).stdout
    return [[list(image[name].values()) for name in ("sigma_t", "albedo", "g")] for image in json.loads(text)["images"]]


def known(folder, manifest, image):
    """Channels 1 to 5 of a network's input, as network/model/input.h describes them."""
    shape = itn.read_exr(folder / manifest["shapes"][image["shape"]]["buffers"])
    mask = shape["mask"] > 0
    nearness = np.where(mask, shape["depth"][mask].mean(dtype=np.float64) - shape["depth"], 0)
    normal = np.stack([shape[f"normal.{axis}"] for axis in "XYZ"])
    cosine = np.tensordot(np.array(manifest["lights"][image["light"]]["direction"]), normal, 1)
    return np.concatenate([normal, nearness[None], cosine[None]]).astype(np.float32)


@pytest.mark.parametrize("channels, distribution", [(1, True), (6, False)])
def test_onnxruntime_predicts_what_itn_does(tmp_path, channels, distribution):
    program = os.environ.get("ITN_BINARY")
    if not program:
        pytest.skip("ITN_BINARY is not set")
    folder = tmp_path / "set"
    config = {"preset": "tiny", "size": 16, "spp": 2, "train": {"shapes": ["knot"], "azimuths": [0], "materials": 20},
              "test": {"shapes": ["hare"], "azimuths": [90], "materials": 1}}
    data = itn.dataset(config, folder)
    itn.train(data, "rn", tmp_path / "run", epochs=2, batch=4, width=2, threads=1, channels=channels, distribution=distribution)
    subprocess.run([program, "export", tmp_path / "run", "-o", tmp_path / "net.onnx", "--quiet"], check=True)

    manifest = json.loads((folder / "manifest.json").read_text())
    images = manifest["images"][:4]
    files = [folder / image["file"] for image in images]
    session = onnxruntime.InferenceSession(tmp_path / "net.onnx", providers=["CPUExecutionProvider"])
    inputs = {"luminance": np.stack([itn.read_exr(file)["Y"][None] for file in files])}
    if channels == 6:
        inputs["known"] = np.stack([known(folder, manifest, image) for image in images])
    names = ["parameters", "low", "high"] if distribution else ["parameters"]
    assert [output.name for output in session.get_outputs()] == names
    found = np.stack(session.run(names, inputs), axis=-1)
    expected = by_itn(program, tmp_path / "run", files, *(["--dataset", folder] if channels == 6 else []))
    np.testing.assert_allclose(found, np.array(expected, dtype=float)[..., :len(names)], rtol=2e-4)
    assert session.get_modelmeta().custom_metadata_map["kind"] == "rn"
    assert [o["name"] for o in json.loads(session.get_modelmeta().custom_metadata_map["outputs"])] == ["sigma_t", "albedo", "g"]


def seen_alone(planes, mask, share):
    """What a network that sees the object alone sees of planes (channels, size, size)."""
    return _itn.cut_out(np.ascontiguousarray(planes), np.ascontiguousarray(mask), mask.shape[0], share)


@pytest.mark.parametrize("inputs, alone", [(["image"], False), (["image", "flash", "mask"], False), (["image", "flash", "mask"], True)])
def test_onnxruntime_predicts_what_itn_does_of_networks_that_see_colours_a_flash_and_a_mask(tmp_path, inputs, alone):
    program = os.environ.get("ITN_BINARY")
    if not program:
        pytest.skip("ITN_BINARY is not set")
    config = {"preset": "world", "size": 16, "spp": 2, "flash": 3, "boundary": {"type": "matched"},
              "train": {"random_shapes": 10, "triangles": 400, "materials": 2, "lamps": 0},
              "test": {"shapes": ["hare"], "random_shapes": 0, "materials": 1, "lamps": 0}}
    data = itn.dataset(config, tmp_path / "set")
    files = [Path(data.folder) / image["file"] for image in data.images[:4]]
    channels = [itn.read_exr(file) for file in files]
    for kind in ("rn", "judge"):
        run = tmp_path / kind
        itn.train(data, kind, run, epochs=1, batch=4, width=2, threads=1, inputs=inputs,
                  exposure=alone or len(inputs) == 1, cut_out=alone)
        subprocess.run([program, "export", run, "-o", tmp_path / f"{kind}.onnx", "--quiet"], check=True)
    description = _itn.network(str(tmp_path / "rn")).description
    given = {"rgb": "", "flash_rgb": "flash.", "mask": None}
    assert description["inputs"] == list(given)[:len(inputs)]

    seen = {name: [] for name in description["inputs"]}
    for of_image in channels:
        for name in seen:
            planes = of_image["mask"][None] if name == "mask" else np.stack([of_image[given[name] + letter] for letter in "RGB"])
            if alone:
                cut, mask = seen_alone(planes, of_image["mask"], description["cut_out"])
                planes = mask[None] if name == "mask" else cut
            seen[name].append(planes)
    seen = {name: np.stack(planes).astype(np.float32) for name, planes in seen.items()}
    by = {kind: onnxruntime.InferenceSession(tmp_path / f"{kind}.onnx", providers=["CPUExecutionProvider"]) for kind in ("rn", "judge")}
    assert [one.name for one in by["rn"].get_inputs()] == description["inputs"]
    found, = by["rn"].run(["parameters"], seen)
    doubt = by["judge"].run(["parameters"], seen)[0][:, 0]
    expected = itn.predict(files, tmp_path / "rn", dataset=data.folder if len(inputs) > 1 else None, judge=tmp_path / "judge")
    np.testing.assert_allclose(found, np.stack(list(expected.parameters.values()), -1), rtol=2e-4)
    np.testing.assert_allclose(doubt, expected.doubt, rtol=2e-4)
