"""Scenes, parameters and errors."""
import numpy as np
import pytest

import itn
from itn import scene_dict
from conftest import BALL, ROOT


def test_parameters_are_a_mapping_with_ranges_and_units(ball):
    p = ball.parameters
    assert p["skin.sigma_t"] == 10
    assert p["skin.albedo.R"] == 0.9 and list(p["skin.albedo"]) == [0.9, 0.8, 0.7]
    info = p.info("haze.g")
    assert (info.low, info.high, info.range, info.differentiable) == (-1, 1, "(-1, 1)", True)
    assert p.info("skin.sigma_t").unit == "1/scene unit"
    assert "haze.g" in p and "skin.albedo" in p and "nix" not in p
    assert len(p) == len(list(p)) == 12
    assert "skin.sigma_t" in repr(p) and "<table>" in p._repr_html_()


def test_parameters_can_be_set_and_copies_are_independent(ball):
    copy = ball.copy()
    ball.parameters["skin.sigma_t"] = 5
    ball.parameters["skin.albedo"] = [0.1, 0.2, 0.3]
    ball.parameters.update({"haze.g": np.float32(0.25)})
    assert ball.parameters["skin.sigma_t"] == 5 and ball.parameters["skin.albedo.B"] == 0.3
    assert ball.parameters["haze.g"] == 0.25
    assert copy.parameters["skin.sigma_t"] == 10


def test_definitions_fill_the_file():
    assert itn.load(BALL, sigma_t=3).parameters["skin.sigma_t"] == 3
    assert itn.load(BALL, defines={"green": 0.5}).parameters["skin.albedo.G"] == 0.5
    assert itn.load(BALL, size=(16, 8)).sensors[0]["width"] == 16
    with pytest.raises(itn.UsageError, match="defines="):
        itn.load(BALL, size="16")
    with pytest.raises(itn.UsageError, match="the scene never uses"):
        itn.load(BALL, sigma=3)


def test_textures_and_grids_are_arrays():
    room = itn.load(ROOT / "scenes/test/textured_room.xml")
    name = next(n for n in room.parameters if room.parameters.info(n).shape)
    texels = room.parameters[name]
    assert texels.dtype == np.float32 and texels.shape == room.parameters.info(name).shape
    room.parameters[name] = 0.5 * texels
    np.testing.assert_array_equal(room.parameters[name], 0.5 * texels)
    with pytest.raises(itn.UsageError, match="need all in"):
        room.parameters[name] = texels + 2


def test_errors_are_exceptions_with_the_message_of_the_command(ball, tmp_path):
    with pytest.raises(itn.InputError, match="no such file"):
        itn.load("nix.xml")
    (tmp_path / "wrong.xml").write_text('<scene version="3.0.0"><shape type="ball"/></scene>')
    with pytest.raises(itn.InputError, match="wrong.xml:1:24: unknown type \"ball\""):
        itn.load(tmp_path / "wrong.xml")
    for wrong in (lambda: ball.parameters.__setitem__("skin.albedo.R", 2), lambda: ball.parameters["nix"],
                  lambda: itn.render(ball, spp=-1), lambda: itn.render(ball, seed=-1), lambda: itn.render(ball, sensor=7),
                  lambda: itn.render(ball, spp=1, operator="both"), lambda: itn.render(ball, spp=1, derivatives=["nix"])):
        with pytest.raises(itn.UsageError):
            wrong()
    with pytest.raises(itn.DeviceError, match="nix"):
        itn.set_device("nix")
    assert issubclass(itn.InputError, itn.Error) and issubclass(itn.DeviceError, itn.Error)


DICTIONARY = {
    "type": "scene",
    "integrator": {"type": "volpath", "max_depth": 64},
    "sensor": {"type": "perspective", "fov": 30.0, "to_world": itn.Transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
               "film": {"type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "box"}},
               "sampler": {"type": "independent", "sample_count": 16}},
    "light": {"type": "constant", "radiance": {"type": "rgb", "value": [1, 0.9, 0.8]}},
    "ball": {"type": "sphere", "glass": {"type": "roughdielectric", "alpha": 0.2},
             "interior": {"type": "homogeneous", "id": "skin", "sigma_t": 10.0,
                          "albedo": {"type": "rgb", "value": [0.9, 0.8, 0.7]}, "haze": {"type": "hg", "g": 0.5}}},
}


def test_a_dictionary_is_the_scene_that_the_file_is(ball):
    scene = itn.load_dict(DICTIONARY)
    assert scene.parameters["light.radiance.G"] == 0.9
    np.testing.assert_array_equal(itn.render(scene, spp=4).image, itn.render(ball, spp=4).image)


def test_transformations_are_applied_from_the_last_to_the_first():
    turned = itn.Transform().translate([1, 0, 0]).rotate([0, 0, 1], 90)
    matrix = itn.Transform([[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    images = []
    for transform in (turned, matrix):
        sensor = {**DICTIONARY["sensor"], "to_world": transform @ itn.Transform().look_at([0, 0, 5], [0.2, 0, 0], [0, 1, 0])}
        images.append(itn.render(itn.load_dict({**DICTIONARY, "sensor": sensor}), spp=4).image)
    np.testing.assert_allclose(*images, atol=1e-4)
    assert np.ptp(images[0]) > 0.1


def test_every_model_of_the_program_has_its_tag_in_dictionaries():
    scene = itn.load_dict({"type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "sphericalharmonics", "c_0_0": 1.0},
                           "ball": {"type": "sphere", "skin": {"type": "oren_nayar", "alpha": 0.5}}})
    assert scene.parameters["skin.alpha"] == 0.5
    families = dict(itn._itn.plugins())
    assert "draine" in families["phase"] and "merl" in families["bsdf"] and "opencv" in families["sensor"]
    assert {kind for types in families.values() for kind in types} == set(scene_dict._TAG)


def test_dictionaries_that_are_wrong_say_where():
    with pytest.raises(itn.InputError, match="'nix', which is not known"):
        itn.load_dict({"type": "scene", "x": {"type": "nix"}})
    with pytest.raises(itn.InputError, match="need {'type': 'scene'"):
        itn.load_dict({"type": "sphere"})
