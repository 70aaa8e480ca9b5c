"""itn: differentiable volumetric path tracing on OpenCL, from Python.

    import itn
    scene = itn.load("scene.xml")
    result = itn.render(scene, spp=64, derivatives=["wax.albedo"])
    result.image, result.stderr, result.derivatives["wax.albedo"]     # numpy arrays (height, width, channels)

Everything runs in the libraries behind the command `itn`: the same scene, samples and seed give the same bits.
`itn.torch` brings it into PyTorch.
"""
import os as _os

from .driver import offer_pip_driver as _offer_pip_driver

_offer_pip_driver()

# Threads of the networks wait for each other asleep: several times faster where the machine has other work. OpenMP looks
# at this when it is loaded, and PyTorch's, which is another one, is to have its own way.
_given = _os.environ.get("OMP_WAIT_POLICY")
_os.environ.setdefault("OMP_WAIT_POLICY", "passive")
try:
    from . import _itn
except ImportError as error:
    if "libOpenCL" not in str(error):
        raise
    raise ImportError("itn needs OpenCL, and libOpenCL.so.1 is not there: install it with a driver, on Debian and "
                      "Ubuntu by `apt install pocl-opencl-icd ocl-icd-libopencl1`") from None

finally:
    if _given is None:
        del _os.environ["OMP_WAIT_POLICY"]

from ._itn import DeviceError, Error, InputError, ResultError, UsageError, Warning, __version__, device, devices, set_device
from .exr import read_exr, write_exr
from .gradient import Gradcheck, Gradient, gradcheck, gradient, photo
from .invert import Interval, Inversion, invert
from .learn import DataSet, Prediction, Shape, Training, dataset, evaluate, predict, shapes, train
from .rendering import Rendering, render
from .scene import Parameter, Parameters, Scene, load
from .scene_dict import load_dict
from .transform import Transform

__all__ = ["DataSet", "DeviceError", "Error", "Gradcheck", "Gradient", "InputError", "Interval", "Inversion",
           "Parameter", "Parameters", "Prediction", "Rendering", "ResultError", "Scene", "Shape", "Training", "Transform", "UsageError", "Warning",
           "__version__", "dataset", "device", "devices", "evaluate", "gradcheck", "gradient", "invert", "load", "load_dict", "photo", "predict",
           "read_exr", "render", "set_device", "shapes", "train", "write_exr"]
