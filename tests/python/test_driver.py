"""PoCL that pip installed is the driver where the system has none."""
import importlib
import os

import pytest

from itn.driver import offer_pip_driver


@pytest.fixture
def pip_driver(tmp_path, monkeypatch):
    """The files of the package pocl-binary-distribution, as far as they matter; its library."""
    packages = tmp_path / "packages"
    library = packages / "pyopencl" / ".libs" / "libpocl-0123.so"
    for file in (packages / "pocl_binary_distribution" / "__init__.py", library):
        file.parent.mkdir(parents=True)
        file.write_bytes(b"")
    monkeypatch.syspath_prepend(packages)
    monkeypatch.setenv("OCL_ICD_VENDORS", "")  # so that it is as before afterwards
    monkeypatch.delenv("OCL_ICD_VENDORS")
    importlib.invalidate_caches()
    return library


def test_it_is_offered_where_the_system_has_no_driver(pip_driver, tmp_path):
    offer_pip_driver(tmp_path / "none")
    assert os.environ["OCL_ICD_VENDORS"] == str(pip_driver)


def test_a_driver_of_the_system_comes_first(pip_driver, tmp_path):
    (tmp_path / "gpu.icd").write_text("libgpu.so\n")
    offer_pip_driver(tmp_path)
    assert "OCL_ICD_VENDORS" not in os.environ


def test_without_a_linker_it_is_not_offered(pip_driver, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    offer_pip_driver(tmp_path / "none")
    assert "OCL_ICD_VENDORS" not in os.environ


def test_what_the_environment_says_stays(pip_driver, tmp_path, monkeypatch):
    monkeypatch.setenv("OCL_ICD_VENDORS", "/elsewhere")
    offer_pip_driver(tmp_path / "none")
    assert os.environ["OCL_ICD_VENDORS"] == "/elsewhere"
