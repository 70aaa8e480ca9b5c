"""itn: differentiable volumetric path tracing on OpenCL, from Python.

    import itn
    scene = itn.load("scene.xml")
    result = itn.render(scene, spp=64, derivatives=["wax.albedo"])
    result.image, result.stderr, result.derivatives["wax.albedo"]     # numpy arrays (height, width, channels)

Everything runs in the libraries behind the command `itn`: the same scene, samples and seed give the same bits.
`itn.torch` brings it into PyTorch.
"""
try:
    from . import _itn
except ImportError as error:
    if "libOpenCL" not in str(error):
        raise
    raise ImportError("itn needs OpenCL, and libOpenCL.so.1 is not there: install it with a driver, on Debian and "
                      "Ubuntu by `apt install pocl-opencl-icd ocl-icd-libopencl1`") from None

from ._itn import DeviceError, Error, InputError, ResultError, UsageError, __version__, device, devices, set_device
from .gradient import Gradcheck, Gradient, gradcheck, gradient
from .rendering import Rendering, render
from .scene import Parameter, Parameters, Scene, load

__all__ = ["DeviceError", "Error", "Gradcheck", "Gradient", "InputError", "Parameter", "Parameters", "Rendering", "ResultError", "Scene",
           "UsageError", "__version__", "device", "devices", "gradcheck", "gradient", "load", "render", "set_device"]
