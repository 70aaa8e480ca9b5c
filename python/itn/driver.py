"""PoCL that pip has installed, for the OpenCL loader, which looks in the system's folders alone."""
from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path


def offer_pip_driver(system: Path = Path("/etc/OpenCL/vendors")) -> None:
    """Makes PoCL of the package pocl-binary-distribution the driver where the system has none and nobody has said where
    drivers are (OCL_ICD_VENDORS). system: the folder where the loader finds them. PoCL links kernels by `ld`, and ends the
    process where there is none: then it is not offered."""
    if "OCL_ICD_VENDORS" in os.environ or any(system.glob("*.icd")) or shutil.which("ld") is None:
        return
    package = importlib.util.find_spec("pocl_binary_distribution")
    if package is None or not package.submodule_search_locations:
        return
    beside = Path(package.submodule_search_locations[0]).parent / "pyopencl" / ".libs"
    for library in sorted(beside.glob("libpocl*.so*")):
        os.environ["OCL_ICD_VENDORS"] = str(library)
        return
