"""itn export: the same parameters by onnxruntime as by itn predict."""
import json
import os
import subprocess

import numpy as np
import pytest

import itn

onnxruntime = pytest.importorskip("onnxruntime")


def by_itn(program, run, images, *options):
    text = subprocess.run([program, "predict", run, *images, *options, "--json", "-"], check=True, capture_output=True, text=True).stdout
    return [[list(image[name].values()) for name in ("sigma_t", "albedo", "g")] for image in json.loads(text)["images"]]


def known(folder, manifest, image):
    """Channels 1 to 5 of a network's input, as network/input.h describes them."""
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
