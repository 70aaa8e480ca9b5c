"""Dictionaries with arrays in place of files, and with what Mitsuba's objects look like."""
import numpy as np
import pytest

import itn

SENSOR = {"type": "perspective", "fov": 30.0, "to_world": itn.Transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
          "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}}


def scene(**members):
    return {"type": "scene", "integrator": {"type": "path"}, "sensor": SENSOR, "light": {"type": "constant"}, **members}


def textured(**bitmap):
    return itn.load_dict(scene(card={"type": "rectangle", "paint": {"type": "diffuse",
                                                                  "reflectance": {"type": "bitmap", **bitmap}}}))


def texels(loaded):
    return next(loaded.parameters[name] for name in loaded.parameters if loaded.parameters.info(name).shape)


class Swizzling:
    """As a vector of Dr.Jit: names are components, or else a ValueError."""

    def __init__(self, *numbers):
        self.numbers = numbers

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        if name == "matrix":
            return [0] * 6
        raise ValueError(f"invalid swizzle: {name}")

    def __array__(self, dtype=None, copy=None):
        return np.array(self.numbers, dtype)


class Bitmap:
    """As mitsuba.Bitmap."""

    def __init__(self, array, encoded):
        self.array, self.encoded = array, encoded

    def srgb_gamma(self):
        return self.encoded

    def __array__(self, dtype=None, copy=None):
        return np.array(self.array, dtype)


class Matrix:
    """As Transform4f of Mitsuba's vectorised variants."""

    def __init__(self, matrix):
        self.matrix = np.asarray(matrix)[..., None]


def test_three_numbers_are_colours_points_or_directions():
    loaded = itn.load_dict(scene(ball={"type": "sphere", "center": Swizzling(1, 2, 3), "paint": {"type": "diffuse", "id": "paint",
                                                                                                "reflectance": [0.1, 0.2, 0.3]}},
                                 sun={"type": "directional", "direction": Swizzling(0, 0, -1), "irradiance": (1, 2, 3)},
                                 lamp={"type": "point", "position": np.array([0, 0, 4])}))
    assert list(loaded.parameters["paint.reflectance"]) == [0.1, 0.2, 0.3]
    assert list(loaded.parameters["sun.irradiance"]) == [1, 2, 3]
    assert itn.load_dict(scene(ball={"type": "sphere", "paint": {"type": "diffuse", "id": "paint", "reflectance": {
        "type": "rgb", "value": Swizzling(0.5, 0.25, 0.75)}}})).parameters["paint.reflectance.G"] == 0.25


def test_pictures_are_arrays_and_eight_bits_are_srgb():
    picture = np.linspace(0, 1, 12, dtype=np.float32).reshape(2, 2, 3)
    np.testing.assert_array_equal(texels(textured(bitmap=picture)), picture)
    np.testing.assert_array_equal(texels(textured(data=picture[..., 0]))[..., 0], picture[..., 0])
    bytes_ = np.array([[[0, 128, 255]]], np.uint8)
    np.testing.assert_allclose(texels(textured(bitmap=bytes_)), [[[0, 0.21586, 1]]], atol=1e-5)
    np.testing.assert_allclose(texels(textured(bitmap=bytes_, raw=True)), bytes_ / 255, atol=1e-6)
    np.testing.assert_allclose(texels(textured(bitmap=Bitmap(bytes_, False))), bytes_ / 255, atol=1e-6)
    transparent = np.concatenate([picture, np.ones((2, 2, 1), np.float32)], -1)
    np.testing.assert_array_equal(texels(textured(bitmap=Bitmap(transparent, False))), picture)


def test_environment_maps_and_grids_are_arrays():
    sky = np.arange(24, dtype=np.float32).reshape(4, 2, 3)
    loaded = itn.load_dict({"type": "scene", "sensor": SENSOR, "sky": {"type": "envmap", "bitmap": sky}})
    np.testing.assert_array_equal(texels(loaded), sky)
    grid = np.random.default_rng(3).random((2, 3, 4), np.float32)
    fog = {"type": "cube", "skin": {"type": "null"},
           "interior": {"type": "heterogeneous", "albedo": 0.5, "sigma_t": {"type": "gridvolume", "grid": grid}}}
    np.testing.assert_array_equal(texels(itn.load_dict(scene(fog=fog)))[..., 0], grid)


def test_meshes_are_arrays():
    square = {"vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "faces": np.array([[0, 1, 2], [2, 3, 0]])}
    paint = {"paint": {"type": "diffuse", "reflectance": 0.25}}
    images = [itn.render(itn.load_dict(scene(card=shape)), spp=4).image
              for shape in ({"type": "rectangle", **paint}, {"type": "mesh", **square, **paint},
                            {"type": "ply", **square, "normals": [[0, 0, 1]] * 4, "texcoords": np.zeros((4, 2)), **paint})]
    assert images[0].min() < 0.3 < images[0].max()
    np.testing.assert_allclose(images[1], images[0], atol=1e-6)
    np.testing.assert_allclose(images[2], images[0], atol=1e-6)


def test_arrays_that_do_not_fit_are_told_by_their_shape():
    for members, words in (({"card": {"type": "rectangle", "radius": np.zeros((300, 300))}}, r"card.radius is an array of shape \(300, 300\)"),
                           ({"card": {"type": "mesh", "vertices": np.zeros((4, 3)), "faces": [[0, 1, 4]]}}, "from 0 to 3"),
                           ({"card": {"type": "mesh", "vertices": np.zeros((4, 3))}}, "lacks faces"),
                           ({"card": {"type": "mesh", "vertices": np.zeros((4, 2)), "faces": [[0, 1, 2]]}}, r"need \(4, 3\)"),
                           ({"sky": {"type": "envmap", "bitmap": np.zeros((4, 4, 7))}}, "7 channels"),
                           ({"sky": {"type": "envmap", "bitmap": np.zeros(4)}}, "2 or 3 dimensions"),
                           ({"sky": {"type": "envmap", "bitmap": np.full((3, 3), np.nan)}}, "not finite"),
                           ({"sky": {"type": "envmap", "bitmap": np.zeros((3, 3)), "filename": "a.exr"}}, "one or the other"),
                           ({"card": {"type": "rectangle", "to_world": object()}}, "need a number, a text")):
        with pytest.raises(itn.InputError, match=words) as told:
            itn.load_dict(scene(**members))
        assert len(str(told.value)) < 500


def test_transformations_have_inverses_and_take_one_number():
    t = itn.Transform().translate([1, 2, 3]).rotate([0, 1, 0], 30).scale([1, 2, 4]).look_at([1, 0, 0], [0, 0, 2], [0, 1, 0])
    np.testing.assert_allclose((t @ t.inverse()).matrix, np.eye(4), atol=1e-12)
    np.testing.assert_array_equal(itn.Transform().translate(-0.5).matrix[:3, 3], [-0.5] * 3)
    np.testing.assert_array_equal(np.diag(itn.Transform().scale(3).matrix), [3, 3, 3, 1])
    assert 'value="-0.5, -0.5, -0.5"' in itn.Transform().translate(-0.5).xml()
    np.testing.assert_array_equal((t @ Matrix(np.eye(4))).matrix, t.matrix)
    itn.load_dict(scene(box={"type": "cube", "to_world": Matrix(np.diag([2, 2, 2, 1.0]))}))
    with pytest.raises(itn.UsageError, match="3 or 1"):
        itn.Transform().translate([1, 2])
    with pytest.raises(itn.UsageError, match="flattens"):
        itn.Transform().scale(0).inverse()


def test_the_matrix_is_what_the_file_says():
    steps = itn.Transform().translate([0.1, 0.2, -0.3]).rotate([0, 0.6, 0.8], 40).scale([1, 0.7, 1.2])
    images = [itn.render(itn.load_dict(scene(box={"type": "cube", "to_world": t, "paint": {"type": "diffuse"}})), spp=16).image
              for t in (steps, itn.Transform(steps.matrix))]
    np.testing.assert_allclose(*images, atol=1e-4)


def test_a_sensor_may_come_with_the_call(ball):
    own = {"type": "perspective", "fov": 30.0, "to_world": itn.Transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
           "film": {"type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "box"}}}
    np.testing.assert_array_equal(itn.render(ball, spp=4, sensor=own).image, itn.render(ball, spp=4).image)
    assert itn.render(ball, spp=4, sensor={**own, "film": {**own["film"], "width": 16}}).image.shape == (24, 16, 3)
    with pytest.raises(itn.UsageError, match="no medium of the scene has this id; need one of: skin"):
        itn.render(ball, spp=4, sensor={**own, "medium": {"type": "ref", "id": "nix"}})
    with pytest.raises(itn.UsageError, match="need one of: perspective"):
        itn.render(ball, sensor={"type": "sphere"})


def test_what_mitsuba_itself_makes():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    rng = np.random.default_rng(5)
    picture, grid = rng.random((3, 4, 3), np.float32), rng.random((2, 3, 4, 1), np.float32)
    loaded = itn.load_dict(scene(
        sun={"type": "directional", "direction": mi.ScalarVector3f(0, 0, -1), "irradiance": {"type": "rgb", "value": mi.ScalarColor3f(1, 2, 3)}},
        lamp={"type": "point", "position": mi.ScalarPoint3f(0, 0, 4)},
        card={"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(2),
              "paint": {"type": "diffuse", "reflectance": {"type": "bitmap", "bitmap": mi.Bitmap(picture)}}}))
    np.testing.assert_array_equal(texels(loaded), picture)
    fog = {"type": "cube", "skin": {"type": "null"}, "interior": {"type": "heterogeneous", "albedo": 0.5, "sigma_t": {
        "type": "gridvolume", "grid": mi.VolumeGrid(grid)}}}
    np.testing.assert_array_equal(texels(itn.load_dict(scene(fog=fog))), grid)
