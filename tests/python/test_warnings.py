"""What the command warns of, Python warns of; what does not match is an error."""
import warnings

import numpy as np
import pytest

import itn
from conftest import BALL

FILM = '<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film>'
HIDDEN = f"""<scene version="3.0.0"><integrator type="%s"><integer name="max_depth" value="2"/>%s</integrator>
<sensor type="perspective">{FILM}</sensor>
<shape type="cube"><transform name="to_world"><translate z="3"/></transform></shape>
<shape type="sphere"><point name="center" value="0,0,9"/><float name="radius" value="0.1"/><emitter type="area"/></shape></scene>"""


def write(folder, text):
    file = folder / "scene.xml"
    file.write_text(text)
    return file


def test_a_scene_that_no_path_lights_is_a_warning(tmp_path):
    dark = itn.load(write(tmp_path, HIDDEN % ("path", "")))
    with pytest.warns(itn.Warning, match="none of 64 paths found light") as told:
        assert not itn.render(dark, spp=4).image.any()
    assert told[0].filename == __file__


def test_images_in_pytorch_warn_too(tmp_path):
    torch = pytest.importorskip("torch")
    import itn.torch as itn_torch
    dark = itn.load(write(tmp_path, HIDDEN % ("path", "")))
    name = next(n for n in dark.parameters if n.endswith("reflectance"))
    for values in (torch.tensor(0.2), torch.tensor([0.2, 0.4])):
        with pytest.warns(itn.Warning, match="found light"):
            itn_torch.render(dark, {name: values}, spp=4)


def test_what_a_file_has_that_is_suspicious_is_a_warning(tmp_path):
    text = (HIDDEN % ("aov", '<string name="aovs" value="dd:depth"/>')).replace('<integer name="max_depth" value="2"/>', "")
    with pytest.warns(itn.Warning, match="computes something else than radiance") as told:
        scene = itn.load(write(tmp_path, text))
    assert told[0].filename == __file__ and scene.warnings
    with pytest.warns(itn.Warning, match="has no sensor"):
        itn.load_dict({"type": "scene", "light": {"type": "constant"}})
    assert issubclass(itn.Warning, UserWarning)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        itn.render(itn.load(BALL), spp=1)  # nothing to say


def test_lists_fill_names_of_the_file(tmp_path):
    file = write(tmp_path, '<scene version="3.0.0"><default name="colour" value="1"/><sensor type="perspective"/>'
                           '<emitter type="constant" id="sky"><rgb name="radiance" value="$colour"/></emitter></scene>')
    for colour in ([0.9, 0.8, 0.7], (0.9, 0.8, 0.7), np.array([0.9, 0.8, 0.7])):
        assert list(itn.load(file, colour=colour).parameters["sky.radiance"]) == [0.9, 0.8, 0.7]
    with pytest.raises(itn.UsageError, match=r"colour: got an array of shape \(2, 2\)"):
        itn.load(file, colour=np.zeros((2, 2)))


def test_parameters_take_values_that_fit_alone(ball):
    for name, value, words in (("skin.sigma_t", [1, 2], r"shape \(2,\), need one number"),
                               ("skin.albedo", [0.1, 0.2], r"shape \(2,\), need an array of shape \(3,\)"),
                               ("skin.sigma_t", "thick", "got str, need a number")):
        with pytest.raises(itn.UsageError, match=words):
            ball.parameters[name] = value


def test_write_exr_writes_nothing_else(tmp_path):
    image = np.zeros((2, 3, 3), np.float32)
    with pytest.raises(itn.UsageError, match=r"got \.png, need a name that ends in \.exr"):
        itn.write_exr(tmp_path / "x.png", image)
    assert not (tmp_path / "x.png").exists()
    for wrong in (np.zeros((2, 3, 4)), np.zeros(3), {}, {"Y": np.zeros((2, 3)), "A": np.zeros((3, 2))}):
        with pytest.raises(itn.UsageError, match="need"):
            itn.write_exr(tmp_path / "x.exr", wrong)
    itn.write_exr(tmp_path / "x.exr", image)
    assert itn.read_exr(tmp_path / "x.exr")["G"].shape == (2, 3)


def test_batches_have_one_target_an_image(ball, photo):
    torch = pytest.importorskip("torch")
    import itn.torch as itn_torch
    two = {"skin.sigma_t": torch.tensor([5.0, 10.0])}
    for target in ([photo] * 8, [photo], photo.image, np.stack([photo.image] * 8), photo):
        with pytest.raises(itn.UsageError, match="target: got .*, need 2"):
            itn_torch.image_loss(ball, two, target, spp=2)
    with pytest.raises(itn.UsageError, match="mask: got 3, need 2"):
        itn_torch.image_loss(ball, two, [photo] * 2, spp=2, mask=[np.ones((24, 32))] * 3)
    with pytest.raises(itn.UsageError, match="target: got an array of shape"):
        itn_torch.image_loss(ball, {"skin.sigma_t": torch.tensor(5.0)}, [photo.image] * 2, spp=2)
    module = itn_torch.network("shipped")
    with pytest.raises(itn.UsageError, match="raw: got a tensor of shape"):
        module.values(torch.zeros(1, 2))
    with pytest.raises(itn.UsageError, match="image: got a tensor of shape"):
        module.input(torch.zeros(4))
