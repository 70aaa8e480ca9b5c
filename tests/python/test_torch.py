"""itn inside PyTorch; skipped where torch is not installed."""
import numpy as np
import pytest

import itn
from conftest import BALL, BY

torch = pytest.importorskip("torch")
import itn.torch  # noqa: E402


def tensors(dtype=torch.float64):
    return {"skin.sigma_t": torch.tensor(10.0, dtype=dtype, requires_grad=True),
            "haze.g": torch.tensor(0.5, dtype=dtype, requires_grad=True)}


def test_an_image_is_that_of_numpy_and_its_gradient_that_of_its_derivatives(ball):
    by = tensors()
    image = itn.torch.render(ball, by, spp=64, seed=3, independent=False)
    plain = itn.render(ball, spp=64, seed=3, derivatives=BY)
    assert torch.equal(image, torch.from_numpy(itn.render(ball, spp=64, seed=3).image))
    weight = torch.linspace(-1, 2, image.numel()).reshape(image.shape)
    (weight * image).sum().backward()
    for name, tensor in by.items():
        of_images = (weight.numpy() * plain.derivatives[name]).sum()
        noise = np.sqrt(((weight.numpy() * plain.derivatives_stderr[name]) ** 2).sum())
        assert abs(tensor.grad.item() - of_images) < 5 * noise


def test_gradients_against_differences_with_common_random_numbers(ball):
    """The mean over seeds of the adjoint against that of central differences, each with the same samples."""
    step, gaps = 0.2, {name: [] for name in BY}
    for seed in range(24):
        by = tensors()
        itn.torch.render(ball, by, spp=32, seed=seed, independent=False).mean().backward()
        for name, tensor in by.items():
            size = step * (1 if name == "haze.g" else 10) * 0.5
            moved = []
            for sign in (-1, 1):
                at = {n: t.detach() + (sign * size if n == name else 0) for n, t in tensors().items()}
                moved.append(itn.torch.render(ball, at, spp=32, seed=seed).double().mean().item())
            gaps[name].append(tensor.grad.item() - (moved[1] - moved[0]) / (2 * size))
    for name, gap in gaps.items():
        assert abs(np.mean(gap)) < 5 * np.std(gap, ddof=1) / np.sqrt(len(gap)) + 0.02 * abs(np.mean(gap)), name


def test_forward_mode_is_the_adjoint_of_backward(ball):
    import torch.autograd.forward_ad as forward
    by = tensors()
    itn.torch.render(ball, by, spp=64).mean().backward()
    with forward.dual_level():
        g = forward.make_dual(torch.tensor(0.5, dtype=torch.float64), torch.tensor(1.0, dtype=torch.float64))
        sigma_t = forward.make_dual(torch.tensor(10.0, dtype=torch.float64), torch.tensor(0.0, dtype=torch.float64))
        image = itn.torch.render(ball, {"skin.sigma_t": sigma_t, "haze.g": g}, spp=64)
        tangent = forward.unpack_dual(image).tangent
    assert tangent.mean().item() == pytest.approx(by["haze.g"].grad.item(), abs=0.01)


def test_the_image_loss_is_that_of_the_gradient_command_and_repeats_its_bits(ball, photo):
    results = []
    for _ in range(2):
        by = tensors()
        loss = itn.torch.image_loss(ball, by, photo, spp=16, seed=4)
        (3 * loss).backward()
        results.append((loss.item(), [t.grad.item() for t in by.values()]))
    assert results[0] == results[1]
    plain = itn.gradient(ball, photo, BY, spp=16, seed=4)
    assert results[0][0] == pytest.approx(plain.loss, rel=1e-6)
    assert results[0][1] == pytest.approx([3 * plain[n] for n in BY], rel=1e-6)


def test_the_naive_loss_is_biased_and_the_image_loss_is_not(ball):
    """At the truth both the loss and its gradient are 0 in the mean."""
    target = itn.torch.target(ball, itn.render(ball, spp=4096, seed=1000))
    truth = itn.render(ball, spp=4096, seed=1000).image
    naive, ours, gradients = [], [], []
    for seed in range(32):
        by = tensors()
        loss = itn.torch.image_loss(ball, by, target, spp=4, seed=seed)
        loss.backward()
        ours.append(loss.item())
        gradients.append(by["skin.sigma_t"].grad.item())
        naive.append(float(((itn.render(ball, spp=4, seed=seed).image - truth) ** 2).mean()))
    error = lambda x: np.std(x, ddof=1) / np.sqrt(len(x))
    assert abs(np.mean(ours)) < 5 * error(ours) + 1e-4 < np.mean(naive)
    assert abs(np.mean(gradients)) < 5 * error(gradients)


def test_a_batch_is_its_images_side_by_side(ball, photo):
    sigma_t = torch.tensor([5.0, 10.0, 20.0], dtype=torch.float64, requires_grad=True)
    g = torch.tensor([0.5, 0.2, 0.5], dtype=torch.float64, requires_grad=True)
    images = itn.torch.render(ball, {"skin.sigma_t": sigma_t, "haze.g": g}, spp=8, seed=7)
    losses = itn.torch.image_loss(ball, {"skin.sigma_t": sigma_t, "haze.g": g}, [photo] * 3, spp=8, seed=7)
    losses.sum().backward()
    for k in range(3):
        one = {"skin.sigma_t": sigma_t[k].detach(), "haze.g": g[k].detach()}
        assert torch.equal(itn.torch.render(ball, one, spp=8, seed=7 + k), images[k])
    assert losses.shape == (3,) and sigma_t.grad[2] > 0 and sigma_t.grad.shape == g.grad.shape == (3,)
    with pytest.raises(itn.UsageError, match="elsewhere"):
        itn.torch.render(ball, {"skin.sigma_t": sigma_t, "haze.g": g[:2]}, spp=1)


def test_networks_are_equal_to_rounding():
    module = itn.torch.network("shipped")
    own = itn._itn.network("shipped")
    size, channels = module.description["size"], module.description["channels"]
    images = torch.rand(3, channels, size, size, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        raw = module(images)
    torch.testing.assert_close(raw, torch.from_numpy(own.forward(images.numpy())), rtol=1e-4, atol=1e-4)
    values = module.values(raw)
    assert set(values) == {"sigma_t", "albedo", "g"}


def test_networks_say_the_intervals_that_predict_says(tmp_path):
    config = {"preset": "tiny", "size": 16, "spp": 2, "train": {"shapes": ["knot"], "azimuths": [0], "materials": 20},
              "test": {"shapes": ["hare"], "azimuths": [90], "materials": 1}}
    data = itn.dataset(config, tmp_path / "set")
    run = itn.train(data, "rn", tmp_path / "run", epochs=2, batch=4, width=1, threads=1, distribution=True)
    module = itn.torch.network(run)
    with torch.no_grad():
        raw = module(module.input(torch.from_numpy(data.image(0))[None]))
        intervals, shares = module.intervals(raw), module.shares(raw)
    found = itn.predict([data.image(0)], run)
    for k, name in enumerate(found.intervals):
        np.testing.assert_allclose(intervals[name].numpy(), found.intervals[name], rtol=1e-4)
    assert shares.covariance_matrix.shape == (1, 3, 3)
    torch.testing.assert_close(torch.sigmoid(raw[:, :3]), shares.mean)


def test_a_data_set_is_one_of_torchs(tmp_path):
    config = {"preset": "tiny", "size": 16, "spp": 2,
              "train": {"shapes": ["knot"], "random_shapes": 0, "azimuths": [0], "materials": 20},
              "test": {"shapes": ["hare"], "azimuths": [90], "materials": 1}}
    data = itn.dataset(config, tmp_path)
    pairs = itn.torch.Dataset(tmp_path)
    image, parameters = pairs[0]
    assert image.shape == (1, 16, 16) and parameters.shape == (3,)
    np.testing.assert_array_equal(image[0].numpy(), data.image(data.images.index(pairs.images[0])))
    batches = torch.utils.data.DataLoader(pairs, batch_size=4)
    assert next(iter(batches))[0].shape == (4, 1, 16, 16)
    with pytest.raises(itn.UsageError, match="has no such images"):
        itn.torch.Dataset(tmp_path, split="nix")


@pytest.mark.parametrize("alone", [False, True])
def test_networks_that_see_colours_a_flash_and_a_mask_are_torchs_too(tmp_path, alone):
    config = {"preset": "world", "size": 16, "spp": 2, "flash": 3, "boundary": {"type": "matched"},
              "train": {"random_shapes": 10, "triangles": 400, "materials": 2, "lamps": 0},
              "test": {"shapes": ["hare"], "random_shapes": 0, "materials": 1, "lamps": 0}}
    data = itn.dataset(config, tmp_path / "set")
    assert data.image(0).shape == (16, 16, 3)
    run = itn.train(data, "rn", tmp_path / "run", epochs=1, batch=4, threads=1, inputs=["image", "flash", "mask"],
                    exposure=alone, cut_out=alone)
    pairs = itn.torch.Dataset(data.folder, split="unseen_shape")
    image, truth = pairs[0]
    assert image.shape == (3, 16, 16) and truth.shape == (7,) and pairs.parameters[3] == "albedo.R"
    channels = pairs.channels(0)
    flash = torch.stack([channels[f"flash.{letter}"] for letter in "RGB"])
    module = itn.torch.network(run)
    with torch.no_grad():
        values = module.values(module(module.input(image, flash=flash, mask=channels["mask"])[None]))
    with pytest.raises(itn.UsageError, match="sees 'flash'"):
        module.input(image, mask=channels["mask"])
    by_data = itn.predict([tmp_path / "set" / pairs.images[0]["file"]], run, dataset=data.folder)
    for name in pairs.parameters:
        np.testing.assert_allclose(values[name].numpy(), by_data[name], rtol=1e-4)
    judge = itn.train(data, "judge", tmp_path / "judge", epochs=1, batch=4, width=2, threads=1, inputs=["image", "flash", "mask"],
                      exposure=alone, cut_out=alone)
    judged = itn.predict([tmp_path / "set" / pairs.images[0]["file"]], run, dataset=data.folder, judge=judge)
    assert by_data.doubt is None and judged.doubt_limit == judge.record["limit"]
    seen = itn.torch.network(judge)
    with torch.no_grad():
        doubt = seen.values(seen(seen.input(image, flash=flash, mask=channels["mask"])[None]))["doubt"]
    np.testing.assert_allclose(judged.doubt, doubt.numpy(), rtol=1e-3)
    if alone:
        assert 0.2 < module.description["cut_out"] < 0.9
        return  # photos are cut and averaged anew around the mask
    rows = image.permute(1, 2, 0).numpy()
    found = itn.predict([rows], run, flash=[(image + flash).permute(1, 2, 0).numpy()],
                        mask=[channels["mask"].numpy()])
    for name in pairs.parameters:
        np.testing.assert_allclose(found[name], by_data[name], rtol=1e-3)


def test_no_parameter_is_no_gradient(ball):
    assert not itn.torch.render(ball, {}, spp=1).requires_grad
    with pytest.raises(itn.UsageError, match="need one number"):
        itn.torch.render(ball, {"haze.g": torch.zeros(2, 2)}, spp=1)
