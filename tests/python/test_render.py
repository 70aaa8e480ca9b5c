"""Images, gradients, checks and inversions."""
import os
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib

import numpy as np
import pytest

import itn
from conftest import BALL, BY, ROOT


def test_an_image_has_errors_and_derivatives(ball):
    r = itn.render(ball, spp=16, derivatives=BY)
    assert r.image.shape == r.stderr.shape == (24, 32, 3) and r.image.dtype == np.float32
    assert list(r.derivatives) == BY and r.derivatives["haze.g"].shape == r.image.shape
    assert r.spp == 16 and r.paths >= 16 * 32 * 24
    np.testing.assert_allclose(r.image.mean((0, 1)), r.mean, rtol=1e-5)
    assert np.asarray(r).shape == r.image.shape
    assert "data:image/png;base64" in r._repr_html_() and "32 x 24" in repr(r)


def test_the_same_bits_as_the_command(ball, tmp_path):
    program = os.environ.get("ITN_BINARY")
    if not program:
        pytest.skip("ITN_BINARY is not set")
    arguments = ["--spp", "8", "--seed", "3", "--quiet", *(w for n in BY for w in ("--derivative", n))]
    subprocess.run([program, "render", str(BALL), "-o", str(tmp_path / "a.exr"), *arguments], check=True)
    r = itn.render(ball, spp=8, seed=3, derivatives=BY)
    itn.write_exr(tmp_path / "b.exr", r)
    a, b = itn.read_exr(tmp_path / "a.exr"), itn.read_exr(tmp_path / "b.exr")
    assert set(a) == set(b) and len(a) == 18
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def test_a_renderer_that_is_used_again_gives_the_bits_of_a_new_one(ball):
    values = [(10, 0, BY), (7, 0, BY), (7, 1, BY), (7, 1, []), (10, 0, BY)]
    used = []
    for sigma_t, seed, by in values:
        ball.parameters["skin.sigma_t"] = sigma_t
        used.append(itn.render(ball, spp=4, seed=seed, derivatives=by))
    for (sigma_t, seed, by), again in zip(values, used):
        new = itn.render(itn.load(BALL, sigma_t=sigma_t), spp=4, seed=seed, derivatives=by)
        np.testing.assert_array_equal(new.image, again.image)
        for name in by:
            np.testing.assert_array_equal(new.derivatives[name], again.derivatives[name])


def test_progress_is_told_and_may_stop(ball):
    told = []
    itn.render(ball, spp=64, progress=told.append)
    assert told and all(0 <= f <= 1 for f in told) and told == sorted(told)

    class Enough(Exception):
        pass

    def stop(fraction):
        raise Enough

    with pytest.raises(Enough):
        itn.render(ball, spp=100000, progress=stop)
    itn.render(ball, spp=4)  # and it renders on


def test_threads_render_while_others_run(ball):
    """The interpreter's lock is released; results of threads are those of one thread."""
    expected = [itn.render(ball, spp=8, seed=k).image for k in range(4)]
    results = [None] * 4

    def work(k):
        results[k] = itn.render(ball, spp=8, seed=k).image

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for got, want in zip(results, expected):
        np.testing.assert_array_equal(got, want)


def test_ctrl_c_ends_a_rendering_at_once():
    script = f"import itn; s = itn.load({str(BALL)!r}); itn.render(s, spp=4); print('begin', flush=True); itn.render(s, spp=1 << 22)"
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begin\n"
    time.sleep(0.5)
    start = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert errors.rstrip().endswith("KeyboardInterrupt") and time.monotonic() - start < 10


def test_gradients_by_images_and_by_replay_agree(ball, photo):
    ways = [itn.gradient(ball, photo, BY, spp=256, mode=mode) for mode in ("images", "adjoint")]
    assert ways[0].loss == pytest.approx(ways[1].loss, rel=1e-6)
    for name in BY:
        assert ways[0][name] == pytest.approx(ways[1][name], abs=6 * (ways[0].stderr[name] + 1e-7))
    assert ways[0]["skin.sigma_t"] > 0  # 10 is too much
    assert "d loss" in repr(ways[0]) and "<table>" in ways[0]._repr_html_()


def test_targets_are_checked(ball, photo):
    with pytest.raises(itn.UsageError, match="the size of the sensor's film"):
        itn.gradient(ball, photo.image[:10], BY, spp=4)
    with pytest.raises(itn.UsageError, match=r"pixel \(1, 0\) is nan"):
        wrong = photo.image.copy()
        wrong[0, 1] = np.nan
        itn.gradient(ball, wrong, BY, spp=4)
    with pytest.raises(itn.UsageError, match=r"pixel \(2, 1\) is -5, which noise around black is not"):
        wrong = photo.image.copy()
        wrong[1, 2] = -5
        itn.gradient(ball, wrong, BY, spp=4)
    with pytest.raises(itn.UsageError, match="every pixel is 0"):
        itn.gradient(ball, photo, BY, spp=4, mask=np.zeros((24, 32)))


def test_a_mask_of_a_file_is_a_file_or_an_array(ball, photo, tmp_path):
    weights = (np.arange(24 * 32).reshape(24, 32) % 3).astype(np.float32)
    itn.write_exr(tmp_path / "photo.exr", photo)
    itn.write_exr(tmp_path / "mask.exr", weights)
    file = tmp_path / "photo.exr"
    losses = {itn.gradient(ball, target, BY, spp=16, mask=mask).loss
              for target, mask in ((photo, weights), (file, weights), (file, tmp_path / "mask.exr"))}
    assert len(losses) == 1
    with pytest.raises(itn.UsageError, match="mask.exr for a target that is an array"):
        itn.gradient(ball, photo, BY, spp=16, mask=tmp_path / "mask.exr")


def write_png(path, image):
    """8 bits a sample, sRGB."""
    linear = np.clip(image, 0, 1)
    samples = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    rows = np.rint(255 * samples).astype(np.uint8)
    height, width, _ = rows.shape
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))) + chunk(b"IEND", b""))


def test_a_photo_is_a_target(ball, photo, tmp_path):
    write_png(tmp_path / "photo.png", np.repeat(np.repeat(0.5 * photo.image, 2, axis=0), 2, axis=1))
    target = itn.photo(ball, tmp_path / "photo.png")
    assert "noise of a pixel" in target.note and "64 x 48 pixels, averaged down to 32 x 24" in target.note
    as_it_is = itn.gradient(ball, photo, BY, spp=64, exposure=True)
    as_photo = itn.gradient(ball, target, BY, spp=64, exposure=True)
    assert as_photo.exposures[0] == pytest.approx(0.5 * as_it_is.exposures[0], rel=0.01)
    by_name = itn.gradient(ball, tmp_path / "photo.png", BY, spp=64, exposure=True)
    assert by_name.loss == as_photo.loss
    with pytest.raises(itn.UsageError, match="need auto, srgb, linear, or an exponent"):
        itn.photo(ball, tmp_path / "photo.png", curve="film")
    (tmp_path / "cut.png").write_bytes((tmp_path / "photo.png").read_bytes()[:300])
    with pytest.raises(itn.InputError, match="cut.png: image is damaged"):
        itn.photo(ball, tmp_path / "cut.png")
    with pytest.raises(itn.UsageError, match="adam finds exposures alone"):
        itn.invert(ball, target, BY, method="adam", white_balance=True)


def test_derivatives_agree_with_differences(ball):
    check = itn.gradcheck(ball, BY, spp=64)
    assert check and list(check.parameters) == BY and "passed" in repr(check)


def test_an_inversion_finds_what_the_photo_was_made_with(ball, photo, tmp_path):
    told = []
    found = itn.invert(ball, photo, ["skin.sigma_t", "haze.g"], method="gauss-newton", spp=32, prior={"haze.g": (0.45, 0.55)},
                       output=tmp_path, progress=told.append)
    assert found.converged and told[-1] <= 1
    assert 6.3 < found["skin.sigma_t"].value < 7.7 and found["skin.sigma_t"].low < found["skin.sigma_t"].value
    assert (tmp_path / "report.html").exists() and found.images[0].shape == (24, 32, 3)
    assert "95 %" in repr(found) and "<table>" in found._repr_html_()
    assert ball.parameters["skin.sigma_t"] == 10
    found.apply(ball)
    assert ball.parameters["skin.sigma_t"] == found["skin.sigma_t"].value
    ball.parameters["skin.sigma_t"] = 9
    with pytest.raises(itn.UsageError):  # the folder holds another inversion
        itn.invert(ball, photo, BY, method="gauss-newton", spp=32, output=tmp_path)


def test_a_photo_of_another_scene_gives_a_warning_and_marked_intervals(ball, photo):
    moved = np.roll(photo.image, 1, axis=1)
    with pytest.warns(UserWarning, match="not converged: .*do not hold"):
        found = itn.invert(ball, moved, ["skin.sigma_t", "haze.g"], spp=32, method="gauss-newton", starts=1, iterations=8)
    assert not found.converged and not found["skin.sigma_t"].holds and not found.json["fit"]["fits"]
    assert found.json["misfit"]["looks_like"] == "shift" and found.json["misfit"]["x"] == pytest.approx(1, abs=0.4)
    assert "(does not hold)" in repr(found) and "(does not hold)" in found._repr_html_()


def test_a_posterior_needs_no_start_and_keeps_its_renderings(ball, photo, tmp_path):
    ask = dict(method="posterior", iterations=2, spp=16, range={"skin.sigma_t": (3, 20)}, renderings=tmp_path)
    found = itn.invert(ball, photo, ["skin.sigma_t"], **ask)
    assert found["skin.sigma_t"].low < 7 < found["skin.sigma_t"].high and found.json["fit"]["fits"]
    ball.parameters["skin.sigma_t"] = 12  # is looked for, so the renderings are those of the same scene
    again = itn.invert(ball, photo, ["skin.sigma_t"], **{**ask, "method": None})  # is the default of a few numbers
    assert again.json["method"] == "posterior" and again.json["renderings"]["found"] > 0
    for wrong in ({"start": {"skin.sigma_t": 9}}, {"starts": 2}, {"range": {"haze.g": (0, 0.5)}}):
        with pytest.raises(itn.UsageError):
            itn.invert(ball, photo, ["skin.sigma_t"], **{**ask, **wrong})
    with pytest.raises(itn.UsageError):
        itn.invert(ball, photo, ["skin.sigma_t"], method="gauss-newton", range={"skin.sigma_t": (3, 20)})


def test_memory_stays_as_it_is(ball):
    def resident():
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    def renders(count):
        for k in range(count):
            ball.parameters["skin.sigma_t"] = 5 + 0.01 * k
            itn.render(ball, spp=1, seed=k)

    renders(100)
    before = resident()
    renders(500)
    assert resident() - before < 4
