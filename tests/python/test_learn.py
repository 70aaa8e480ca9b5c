"""Networks, data sets and shapes."""
import numpy as np
import pytest

import itn
from conftest import ROOT


def test_shapes_are_closed_meshes(tmp_path):
    (shape,) = itn.shapes(names=[], random=1, seed=3)
    assert shape.vertices.shape[1] == shape.triangles.shape[1] == 3 and shape.volume > 0
    shape.write(tmp_path / "a.ply")
    assert (tmp_path / "a.ply").stat().st_size > len(shape.triangles)
    with pytest.raises(itn.UsageError, match="need one of"):
        itn.shapes(names=["nix"])


def test_image_files_keep_their_numbers(tmp_path):
    image = np.random.default_rng(0).random((5, 7, 3), np.float32)
    itn.write_exr(tmp_path / "a.exr", image)
    channels = itn.read_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(np.stack([channels[c] for c in "RGB"], -1), image)
    with pytest.raises(itn.InputError, match="nix.exr"):
        itn.read_exr(tmp_path / "nix.exr")


def test_the_networks_way_from_a_data_set_to_a_prediction(tmp_path):
    config = {"preset": "tiny", "size": 16, "spp": 4,
              "train": {"shapes": ["knot"], "random_shapes": 0, "azimuths": [0], "materials": 20},
              "test": {"shapes": ["hare"], "azimuths": [90], "materials": 1}}
    told = []
    data = itn.dataset(config, tmp_path / "set", progress=told.append)
    assert len(data) == data.rendered and told[-1] == 1 and data.image(0).shape == (16, 16)
    assert itn.dataset(config, tmp_path / "set").rendered == 0  # all were there
    assert "data:image/png" in data._repr_html_()
    with pytest.raises(itn.UsageError, match="need 2 or more"):
        itn.dataset(config, tmp_path / "few", spp=1)
    run = itn.train(data, "rn", tmp_path / "run", epochs=2, batch=4, width=1, threads=1)
    assert len(run.curve) == 2 and (tmp_path / "run/network.safetensors").exists()
    images = [data.image(0), tmp_path / "set" / data.images[1]["file"]]
    found = itn.predict(images, run)
    assert found["sigma_t"].shape == (2,) and found.unit_of_sigma_t == "1/mm" and 20 <= found["sigma_t"][0] <= 300
    assert found.intervals == {}  # it says parameters alone
    sure = itn.train(data, "rn", tmp_path / "sure", init=run, distribution=True, epochs=1, batch=4, threads=1)
    again = itn.predict(images, sure)
    for name, ends in again.intervals.items():
        assert ends.shape == (2, 2) and (ends[:, 0] < again[name]).all() and (again[name] < ends[:, 1]).all()
    assert set(again.intervals) == {"sigma_t", "albedo", "g"} and "95 %:" in repr(again)
    scene = itn.load(ROOT / "scenes/dataset/scene.xml", size=(16, 16))
    photo = itn.render(scene, spp=4)
    assert itn.predict(photo, run, scene=scene).unit_of_sigma_t == "1/scene unit"
    result = itn.evaluate(data, [run], tmp_path / "report", images=0, inversions=0)
    assert result["schema"] == "itn.eval/1" and (tmp_path / "report/report.html").exists()
    with pytest.raises(itn.UsageError, match="its network sees the image alone"):
        itn.predict(images, run, dataset=tmp_path / "set")
    with pytest.raises(itn.UsageError, match="unlabelled: needs a network to begin with"):
        itn.train(network="itn", output=tmp_path / "a", unlabelled=data)
