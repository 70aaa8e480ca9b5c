"""What pytorch-msssim says of the images of ms_ssim_test.cpp: prints the figures that stand there.

Run with a Python that has torch, numpy and pytorch-msssim (tools/peers --training installs them):
python tests/network/ms_ssim_pytorch.py
"""
import numpy
import torch
from pytorch_msssim import ms_ssim
from pytorch_msssim.ssim import _fspecial_gauss_1d, _ssim


def images(width, height):
    """The pair of ms_ssim_test.cpp: waves, and the same weaker, shifted and with another on top."""
    y, x = numpy.mgrid[0:height, 0:width].astype(numpy.float64)
    reference = 0.5 + 0.25 * numpy.sin(0.07 * x + 0.11 * y) + 0.2 * numpy.sin(0.9 * x) * numpy.cos(1.3 * y)
    image = 0.02 + 0.9 * reference + 0.05 * numpy.sin(2.1 * x - 0.4 * y)
    return [torch.from_numpy(a.astype(numpy.float32).astype(numpy.float64))[None, None] for a in (image, reference)]


def fewer_scales(image, reference, weights):
    """pytorch-msssim refuses images too small for five scales: its own single-scale function, combined as it does."""
    weights = numpy.array(weights) / numpy.sum(weights)
    window = _fspecial_gauss_1d(11, 1.5)[None].to(torch.float64)
    result = 1.0
    for scale, weight in enumerate(weights):
        similarity, structure = _ssim(image, reference, data_range=1.0, win=window, size_average=False)
        result *= torch.relu(similarity if scale == len(weights) - 1 else structure).item() ** weight
        image, reference = (torch.nn.functional.avg_pool2d(a, 2) for a in (image, reference))
    return result


for width, height in [(176, 176), (256, 192)]:
    print(width, height, ms_ssim(*images(width, height), data_range=1.0).item())
print(128, 128, fewer_scales(*images(128, 128), [0.0448, 0.2856, 0.3001, 0.2363]))
print(64, 64, fewer_scales(*images(64, 64), [0.0448, 0.2856, 0.3001]))
print(96, 64, fewer_scales(*images(96, 64), [0.0448, 0.2856, 0.3001]))
